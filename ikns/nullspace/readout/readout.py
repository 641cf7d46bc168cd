"""One interface to the three methods: a motion in, c out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ikns.arrays import Array, Mask
from ikns.body.chains import ChainLike
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.readout.coordinates import (
    METHODS,
    Method,
    posture_samples,
    readout_samples,
)
from ikns.nullspace.readout.intent import IntentMap


@dataclass(frozen=True, eq=False)
class Readout:
    """A method's map, and what it reads of a motion.

    Parameters
    ----------
    method : {"paper", "proximal", "intent"}
    chain : str
        Joints of the map, see :class:`ikns.Chain`.
    map : NullSpaceMap or IntentMap
        Fitted; it takes places and coordinates of
        :func:`ikns.nullspace.readout.readout_samples`.
    reference : (S, 3, 3) array, optional
        Reference orientations of the upper arms, for ``"proximal"``.
    """

    method: Method
    chain: ChainLike
    map: NullSpaceMap | IntentMap
    reference: Array | None = None

    def samples(self, skeleton: Skeleton, motion: Motion) -> tuple[Array, Array]:
        """Places (T, 3) and coordinates (T, k) of a motion of this skeleton."""
        return readout_samples(
            skeleton, motion, self.chain, self.method, reference=self.reference
        )

    def control_signal(self, skeleton: Skeleton, motion: Motion) -> Array:
        """Control signal of a motion, not clipped, (T,) or (T, d).

        As the poses say: what hidden markers shift takes the recording, see
        :func:`ikns.live.control.recorded.control_table`.
        """
        x, y = self.samples(skeleton, motion)
        return np.asarray(self.map.control_signal(y, self.led(x)))

    def led(self, x: Array) -> Array:
        """Places of a motion, in order of time, as they count: :meth:`IntentMap.led`.

        Of other methods they are what they are.
        """
        return self.map.led(x) if isinstance(self.map, IntentMap) else x

    def of_postures(self, skeleton: Skeleton, q: Array) -> tuple[Array, Mask]:
        """Signal (T,) or (T, d) and :meth:`inside` of postures (T, nq), seen or not.

        In order of time.
        """
        angles = q[:, -len(skeleton.joint_names) :]
        x, y = posture_samples(
            skeleton, angles, self.chain, self.method, reference=self.reference
        )
        c = np.asarray(self.map.control_signal(y, self.led(x)))
        return c, self.map.inside(x)

    def inside(self, skeleton: Skeleton, motion: Motion) -> Mask:
        """Whether the map was taught where the arm is, (T,)."""
        return self.map.inside(self.samples(skeleton, motion)[0])

    def table(self) -> dict[str, Any]:
        """Return what a file holds: text, numbers, lists and dicts."""
        about: dict[str, Any] = {"method": self.method, "chain": str(self.chain)}
        if isinstance(self.map, IntentMap):
            return about | _intent_table(self.map)
        known = self.map
        return about | {
            "interpolation": known.interpolation,
            "outside": known.outside,
            "reference": None if self.reference is None else self.reference.tolist(),
            "centers_m": known.centers_.tolist(),
            "directions": known.directions_.tolist(),
            "lower_rad": known.lower_.tolist(),
            "upper_rad": known.upper_.tolist(),
            "samples": known.counts_.tolist(),
        }

    @classmethod
    def from_table(
        cls, table: dict[str, Any], chain: ChainLike | None = None
    ) -> Readout:
        """Make a readout from what a file holds; of a chain that has the name there.

        Raises
        ------
        InvalidInput, LookupError, TypeError, ValueError
            When something is missing or not as it should be.
        """
        method = table["method"]
        if method not in METHODS:
            raise InvalidInput(
                f"expected a method of {', '.join(METHODS)}, found '{method}'."
            )
        chain = table["chain"] if chain is None else chain
        if method == "intent":
            return cls(method, chain, _intent_map(table))
        made = NullSpaceMap.from_arrays(
            table["centers_m"],
            table["directions"],
            table["lower_rad"],
            table["upper_rad"],
            counts=table["samples"],
            interpolation=table["interpolation"],
            outside=table["outside"],
        )
        reference = np.array(table["reference"], dtype=np.float64)
        if reference.shape != (made.directions_.shape[2] // 4, 3, 3) or not np.allclose(
            reference @ np.swapaxes(reference, 1, 2), np.eye(3), atol=1e-6
        ):
            raise InvalidInput("expected a rotation matrix for each upper arm.")
        return cls(method, chain, made, reference)


def _intent_table(learned: IntentMap) -> dict[str, Any]:
    natural = learned.natural_
    return {
        "natural_posture": {
            "coefficients_rad": natural.coefficients_.tolist(),
            "people_rad": natural.people_.tolist(),
            "offset_rad": natural.offset_,
            "leverage": natural.leverage_.tolist(),
            "taught_leverage": natural.taught_leverage_,
            "guard": natural.guard,
            "penalty": natural.penalty,
            "places_m": natural.places_.tolist(),
            "heights_rad": natural.heights_.tolist(),
            "coverage": natural.coverage_,
        },
        "leash_m": learned.leash,
        "centers_m": learned.centers_.tolist(),
        "lower_rad": learned.lower_.tolist(),
        "upper_rad": learned.upper_.tolist(),
        "samples": learned.counts_.tolist(),
    }


def _intent_map(table: dict[str, Any]) -> IntentMap:
    held = table["natural_posture"]
    natural = NaturalPosture.from_arrays(
        held["coefficients_rad"],
        held["people_rad"],
        held["leverage"],
        offset=held["offset_rad"],
        taught_leverage=held["taught_leverage"],
        # Older folders have none.
        places=held.get("places_m", ()),
        heights=held.get("heights_rad", ()),
        coverage=held["coverage"],
        penalty=held["penalty"],
        guard=held["guard"],
    )
    # Those of before followed a hand at once.
    leash = float(table.get("leash_m", 0.0))
    return IntentMap.from_arrays(
        natural,
        table["centers_m"],
        table["lower_rad"],
        table["upper_rad"],
        counts=table["samples"],
        penalty=held["penalty"],
        leash=leash,
    )
