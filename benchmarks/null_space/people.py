"""Reaches of the people of UE_ADL, as tracked: both arms, four tasks, three repeats."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.calibration.scaling import scale
from ikns.errors import IknsError
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.nullspace.hinge_swivel import arm_swivel
from ikns.recording.files import read

Array = np.ndarray
#: F reach forward, A reach across, D drink, C comb hair.
TASKS = "FADC"
REPEATS = (1, 2, 3)
#: A hand slower than this rests, m/s; a reach goes this far, m, and lasts this long, s.
GATE, FAR, LONG = 0.05, 0.10, 0.3


@dataclass(frozen=True)
class ArmTrial:
    """One recording of one arm.

    Parameters
    ----------
    task : str
    repeat : int
    time : (T,) array
        s.
    wrist, hand : (T, 3) arrays
        Thorax frame, m; the wrist of a left arm is mirrored to the right.
    speed : (T,) array
        Of the hand in the thorax frame, m/s.
    swivel : (T,) array
        Of the hinge, rad.
    angles : (T, 18) array
        All joint angles, rad.
    """

    task: str
    repeat: int
    time: Array
    wrist: Array
    hand: Array
    speed: Array
    swivel: Array
    angles: Array

    @property
    def known(self) -> Array:
        """Frames in which wrist and swivel are known."""
        return np.isfinite(self.swivel) & np.isfinite(self.wrist).all(axis=1)

    def reaches(self) -> list[tuple[int, int]]:
        """First and last sample of each reach between two rests of the hand."""
        moving = self.speed >= GATE
        ends = np.flatnonzero(np.diff(np.r_[False, moving, False]))
        return [
            (int(a), int(b - 1))
            for a, b in ends.reshape(-1, 2)
            if self.time[b - 1] - self.time[a] >= LONG
            and np.linalg.norm(self.hand[b - 1] - self.hand[a]) >= FAR
        ]


@dataclass(frozen=True)
class Arm:
    """One arm of one person with its recordings."""

    person: str
    side: str
    skeleton: Skeleton
    trials: tuple[ArmTrial, ...]

    @property
    def chain(self) -> str:
        """Name of the chain."""
        return f"{self.side}_arm"


def arm_trial(skeleton: Skeleton, motion: Motion, chain: str, name: str) -> ArmTrial:
    """Take what is needed of a motion; `name` is the task and the repeat."""
    angles = np.where(motion.in_sight(chain)[:, None], motion.angles, np.nan)
    wrist, swivel = arm_swivel(skeleton, angles, chain)
    return ArmTrial(
        name[0],
        int(name[1]),
        motion.time,
        wrist,
        motion.task_position(chain),
        motion.hand_speed(chain),
        swivel,
        angles,
    )


def real_arms(
    folder: Path, *, people: int | None = None, marker_set: str = "ue_adl"
) -> list[Arm]:
    """Both arms of the people in a folder of UE_ADL, of the first ones alone if asked.

    Recordings that cannot be read or tracked are left out.
    """
    arms = []
    names = sorted(path.name for path in folder.iterdir() if path.is_dir())
    for name in names[:people]:
        static = read(folder / name / f"{name}_static.csv")
        # One static trial lasts 0.21 s.
        skeleton, _ = scale(
            Skeleton.load(), static, marker_set=marker_set, min_duration=0.2
        )
        for side in SIDES:
            chain, trials = f"{side}_arm", []
            for task in TASKS:
                for repeat in REPEATS:
                    file = folder / name / f"{name}{task}{side[0].upper()}{repeat}.csv"
                    try:
                        motion = MarkerIK(skeleton).track(read(file), chain=chain)
                    except IknsError:
                        continue
                    one = arm_trial(skeleton, motion, chain, f"{task}{repeat}")
                    if one.known.any():
                        trials.append(one)
            arms.append(Arm(name, side, skeleton, tuple(trials)))
    return arms
