"""Judge ordinary movement by a natural posture that the rest of it taught."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.body.chains import whole_arms
from ikns.calibration.readouts import moving_samples
from ikns.calibration.subject import Subject
from ikns.motion.motion import Motion
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.readout import IntentMap
from ikns.nullspace.readout.intent import wrapped

#: Parts of the ordinary movement: each is judged by what the others teach.
_PARTS = 4


class Folds:
    """Natural postures that a part of the ordinary movement had no say in.

    Parameters
    ----------
    subject : Subject
    explorations, natural : sequences of Motion
        What its natural posture was learned from.
    speed : float
        Faster hands move, m/s.

    Attributes
    ----------
    postures : list of NaturalPosture
        Without each quarter; empty where nothing of one's own was learned.
    """

    def __init__(
        self,
        subject: Subject,
        explorations: Sequence[Motion],
        natural: Sequence[Motion],
        speed: float,
    ) -> None:
        self.postures: list[NaturalPosture] = []
        self._part: dict[int, Array] = {}
        if "intent" not in subject.readouts or len(whole_arms(subject.chain)) != 1:
            return
        learned = subject.readout("intent").map
        assert isinstance(learned, IntentMap)
        if not learned.natural_.coverage_["frames"]:
            return
        found = moving_samples(
            subject.skeleton,
            subject.null_space_map,
            explorations,
            natural,
            subject.chain,
            max_hand_speed=speed,
        )
        # Part of each frame: by how much of the movement lies before it.
        counts = np.cumsum(np.concatenate([row for _, _, row in found]))
        parts = np.minimum(_PARTS * counts // (counts[-1] + 1), _PARTS - 1)
        start = 0
        for motion, (_, _, row) in zip([*explorations, *natural], found, strict=True):
            self._part[id(motion)] = parts[start : start + len(row)]
            start += len(row)
        row = np.concatenate([row for _, _, row in found])
        w = np.concatenate([w for w, _, _ in found])
        s = np.concatenate([s for _, s, _ in found])
        for part in range(_PARTS):
            others = row & (parts != part)
            posture = NaturalPosture(penalty=learned.natural_.penalty)
            # Of a map that knows the wrist alone, no more is learned.
            known = w[others, : learned.n_features_in_]
            self.postures.append(posture.fit(known, s[others]))

    def signal(
        self,
        learned: IntentMap,
        motion: Motion,
        frames: NDArray[np.int64],
        s: Array,
        w: Array,
    ) -> Array:
        """Return c (N,) of frames of a motion, by what the other parts taught."""
        a, b = learned.ends_
        parts = self._part[id(motion)][frames]
        natural = np.array(
            [
                float(self.postures[part].swivel(at))
                for part, at in zip(parts, w, strict=True)
            ]
        )
        return (wrapped(s - natural) - a) / (b - a)
