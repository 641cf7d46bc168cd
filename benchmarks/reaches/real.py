"""Reaches of two real people (UE_ADL), and a map of each arm's null space.

Nobody swivelled an elbow for us there, so the map is explored on paper: at the places
where the hand has been, the scaled skeleton's self-motion is followed from the person's
own posture, 35 deg of elbow swivel either way, and the map is learned from that.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.calibration import elbow_reference
from ikns.calibration.scaling import scale
from ikns.errors import InvalidInput
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.nullspace.clustering import BoundingBoxKMeans
from ikns.nullspace.map import NullSpaceMap
from ikns.numerics.subspace import principal_components
from ikns.recording.files import read
from ikns.simulation.arm import ArmKinematics, self_motion

#: Figures are of these two, whoever else is in the folder.
PEOPLE = ("ADL001", "ADL005")
_HALF = np.radians(35.0)
#: A place where the elbow has less room is left out, rad.
_LEAST = np.radians(30.0)
#: The hand is also put this far to every side of the places, so that paths between
#: them lie within the map's volume, m.
_ASIDE = 0.08
#: A reach goes this far and takes this long, m and s.
_FAR, _LONG = 0.10, 0.3
_GATE = 0.05


@dataclass(frozen=True)
class RealArm:
    """One arm of one person.

    Parameters
    ----------
    skeleton : Skeleton
    chain : str
    null_space_map : NullSpaceMap
    trials : dict of str to Motion
        By task: F reach forward, A reach across, D drink, C comb hair.
    """

    skeleton: Skeleton
    chain: str
    null_space_map: NullSpaceMap
    trials: dict[str, Motion]

    def reaches(self, task: str) -> list[tuple[int, int]]:
        """First and last sample of each reach within the map's volume."""
        motion = self.trials[task]
        moving = motion.hand_speed(self.chain) >= _GATE
        x, time = motion.task_position(self.chain), motion.time
        inside = self.null_space_map.inside(x)
        ends = np.flatnonzero(np.diff(np.r_[False, moving, False]))
        return [
            (int(a), int(b - 1))
            for a, b in ends.reshape(-1, 2)
            if time[b - 1] - time[a] >= _LONG
            and np.linalg.norm(x[b - 1] - x[a]) >= _FAR
            and inside[a:b].mean() > 0.5
        ]

    def swivel(self, task: str) -> np.ndarray:
        """Elbow swivel of the fitted skeleton, (T,) rad."""
        side = SIDES.index(self.chain.split("_")[0])
        return self.skeleton.swivel(self.trials[task].q)[:, side]


def real_arms(folder: Path, *, quick: bool) -> list[RealArm]:
    """Both arms of both people; the first one for a quick look."""
    arms = []
    for name in PEOPLE:
        static = read(folder / name / f"{name}_static.csv")
        skeleton, _ = scale(
            Skeleton.load(), static, marker_set="ue_adl", min_duration=0.3
        )
        for side in SIDES:
            trials = {
                task: MarkerIK(skeleton).track(
                    read(folder / name / f"{name}{task}{side[0].upper()}1.csv")
                )
                for task in "FADC"
            }
            chain = f"{side}_arm"
            learned = _explored(skeleton, side, trials)
            arms.append(RealArm(skeleton, chain, learned, trials))
            if quick:
                return arms
    return arms


def _explored(skeleton: Skeleton, side: str, trials: dict[str, Motion]) -> NullSpaceMap:
    arm, chain = ArmKinematics(skeleton, side), f"{side}_arm"
    x = np.concatenate([motion.task_position(chain) for motion in trials.values()])
    angles = np.concatenate([motion.angles for motion in trials.values()])
    centers = BoundingBoxKMeans(10).fit(x).cluster_centers_
    reference = elbow_reference(skeleton, angles.mean(axis=0), chain)[0]
    places, directions, ends = [], [], []
    for center in centers:
        nearest = angles[np.linalg.norm(x - center, axis=1).argmin()]
        position, rotation = arm.hand(nearest)
        for aside in np.vstack([np.zeros(3), _ASIDE * np.eye(3), -_ASIDE * np.eye(3)]):
            try:
                at = arm.to_pose(nearest, position + aside, rotation)
                swivel = arm.swivel(at)
                found = self_motion(
                    arm, at, lowest=swivel - _HALF, highest=swivel + _HALF
                )
            except InvalidInput:  # out of reach
                continue
            if np.ptp(found.swivel) < _LEAST:
                continue
            # Evenly by swivel, however many steps the walk took.
            q = found.at(np.linspace(*found.swivel[[0, -1]], 50))[:, 2:]
            Z = principal_components(q)[0][0]
            Z *= np.sign(Z @ reference)
            places.append(arm.hand(at)[0])
            directions.append(Z)
            ends.append(((q @ Z).min(), (q @ Z).max()))
    return NullSpaceMap.from_arrays(
        places, directions, *np.transpose(ends), outside="project"
    )
