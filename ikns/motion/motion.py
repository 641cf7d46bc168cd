"""A motion: joints and hands over time, and what of them was seen."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from ikns.arrays import Array, Indices, Mask
from ikns.body.chains import SIDES, ChainLike, as_chain, chain_joints, chain_sides
from ikns.errors import InvalidInput
from ikns.motion.labeled import data_frame, dataset


@dataclass(frozen=True, eq=False)
class Motion:
    """Joints and hands over time, NaN where they were not seen.

    `q` alone has a number in every frame, so that there is a posture to draw and to
    compute with: what was not seen stays where it was. Everything else is NaN where it
    is not known: an angle and its velocity by `known`, the pose of the thorax by `seen`
    of the thorax, a hand while the thorax or a segment of its arm is out of sight; and
    all of an arm, and the thorax if it is of both, in frames whose markers were
    rejected.

    Parameters
    ----------
    time : (T,) array
        Seconds.
    q : (T, nq) array
        Configuration of the skeleton; the last ``len(joint_names)`` columns are the
        joint angles in radians, preceded by the pose of the thorax in the world (meters
        and a unit quaternion x, y, z, w) if the skeleton has one.
    v : (T, nv) array
        Velocity of `q` in the tangent space, m/s and rad/s.
    joint_names : tuple of str
        Names of the last columns of `q` and `v`.
    hand_in_thorax : (T, 2, 3) array
        Hand positions, meters; the side axis follows :data:`~ikns.body.chains.SIDES`.
    hand_rotation_in_thorax : (T, 2, 3, 3) array
        Hand orientations.
    hand_velocity_in_thorax : (T, 2, 3) array
        Velocity of the hand positions as seen from the thorax, m/s.
    residual : (T,) array
        Root mean square distance of the seen markers from the model's, meters.
    iterations : (T,) integer array
        Iterations that the solver took.
    converged : (T,) boolean array
        Whether the solver met its tolerance.
    held : tuple of str
        Joints that the markers cannot observe; they stayed at their prior. Their angle
        is that prior, and NaN where a segment next to the joint was not seen.
    segments : tuple of S str
        Links that carry markers, and the thorax.
    seen : (T, S) boolean array
        Whether each was visible. By default there are none, and everything was visible.
    known : (T, J) boolean array
        Whether the frame shows each joint, in the order of `joint_names`; the rule is
        that of :func:`ikns.motion.marker_ik.visibility.visible_segments`.
    rejected : (T, 2) integer array
        By side, why the markers of thorax and arm were rejected: an index into
        `reasons`, -1 where they were not; see
        :class:`ikns.motion.marker_ik.gate.GateLimits` and
        :func:`ikns.motion.marker_ik.rejection.count_rejections`.
    reasons : tuple of str
        In words.
    ends : tuple of (str, str)
        Other links than hands whose pose is known, each with the link from which it is
        seen; see :func:`ikns.motion.ends.with_ends`.
    end_in_base, end_rotation_in_base, end_velocity_in_base : array
        Their pose and velocity, (T, E, 3) m, (T, E, 3, 3) and (T, E, 3) m/s.

    Examples
    --------
    >>> import ikns
    >>> run = ikns.simulate_protocol(
    ...     ikns.virtual_subject(1), seed=1, n_points=1, rate=25, quick=True
    ... )
    >>> motion = ikns.MarkerIK(run.subject.skeleton).track(run.static.recording)
    >>> motion.hand_in_thorax.shape == (len(motion.time), 2, 3)
    True
    >>> bool(np.nanmedian(motion.hand_speed("right_arm")) < 0.05)  # stands still
    True
    """

    time: Array
    q: Array
    v: Array
    joint_names: tuple[str, ...]
    hand_in_thorax: Array
    hand_rotation_in_thorax: Array
    hand_velocity_in_thorax: Array
    residual: Array
    iterations: Indices
    converged: Mask
    held: tuple[str, ...] = ()
    segments: tuple[str, ...] = ()
    seen: Mask = field(default_factory=lambda: np.ones((1, 0), bool))
    known: Mask = field(default_factory=lambda: np.ones((1, 1), bool))
    rejected: Indices = field(default_factory=lambda: np.full((1, len(SIDES)), -1))
    reasons: tuple[str, ...] = ()
    ends: tuple[tuple[str, str], ...] = ()
    end_in_base: Array = field(default_factory=lambda: np.empty((1, 0, 3)))
    end_rotation_in_base: Array = field(default_factory=lambda: np.empty((1, 0, 3, 3)))
    end_velocity_in_base: Array = field(default_factory=lambda: np.empty((1, 0, 3)))

    def __post_init__(self) -> None:
        """Hide what was not seen, and freeze the arrays."""
        n, joints = len(self.time), len(self.joint_names)
        seen = np.broadcast_to(self.seen, (n, len(self.segments)))
        known = np.broadcast_to(self.known, (n, joints))
        rejected = np.broadcast_to(self.rejected, (n, len(SIDES)))
        if (rejected >= 0).any():
            known = known & believed_joints(self.joint_names, rejected)
        for name in ("end_in_base", "end_rotation_in_base", "end_velocity_in_base"):
            # Without ends, the number of frames is that of no array.
            of_ends = getattr(self, name)[: None if self.ends else 1]
            of_ends = np.broadcast_to(of_ends, (n, *of_ends.shape[1:]))
            object.__setattr__(self, name, of_ends)
        object.__setattr__(self, "seen", seen)
        object.__setattr__(self, "known", known)
        object.__setattr__(self, "rejected", rejected)
        thorax = np.repeat(
            self._thorax_known()[:, None], self.v.shape[1] - joints, axis=1
        )
        arms = np.stack([all_seen(self.segments, seen, side) for side in SIDES], axis=1)
        arms &= rejected < 0
        for name, shown in (
            ("v", np.hstack([thorax, known])),
            ("hand_in_thorax", arms),
            ("hand_rotation_in_thorax", arms),
            ("hand_velocity_in_thorax", arms),
        ):
            if not shown.all():
                hidden = np.array(getattr(self, name), dtype=np.float64)
                hidden[~shown] = np.nan
                object.__setattr__(self, name, hidden)
        for one in fields(self):
            value = getattr(self, one.name)
            if isinstance(value, np.ndarray):
                frozen = value.view()
                frozen.flags.writeable = False
                object.__setattr__(self, one.name, frozen)

    @property
    def angles(self) -> Array:
        """Joint angles, (T, len(joint_names)) radians; NaN where not known."""
        return np.where(self.known, self.q[:, -len(self.joint_names) :], np.nan)

    @property
    def thorax_in_world(self) -> Array:
        """Pose of the thorax, (T, 7) m and a quaternion; NaN where it is not known."""
        pose = self.q[:, : -len(self.joint_names)]
        return np.where(self._thorax_known()[:, None], pose, np.nan)

    def in_sight(self, chain: ChainLike) -> Mask:
        """Whether the thorax and every segment of a chain were seen, (T,)."""
        return all_seen(self.segments, self.seen, *chain_sides(chain))

    def believed(self, chain: ChainLike) -> Mask:
        """Whether the markers of the thorax and a chain were not rejected, (T,)."""
        return np.asarray((self.rejected[:, self._sides(chain)] < 0).all(axis=1))

    def never_seen(self, chain: ChainLike) -> tuple[str, ...]:
        """Segments of a chain, or the thorax, that no frame shows."""
        own = ("thorax", *chain_sides(chain))
        return tuple(
            link
            for link, seen in zip(self.segments, self.seen.T, strict=True)
            if link.startswith(own) and not seen.any()
        )

    def chain_angles(self, chain: ChainLike) -> Array:
        """Joint angles of a chain, (T, n) radians in chain order; NaN where not known.

        That is where the chain is out of sight or its markers were rejected.
        """
        return self._while_in_sight(chain, self.angles)

    def chain_velocities(self, chain: ChainLike) -> Array:
        """Joint velocities of a chain, (T, n) rad/s, likewise."""
        return self._while_in_sight(chain, self.v[:, -len(self.joint_names) :])

    def task_position(self, chain: ChainLike) -> Array:
        """Where the task happens: the hand, or the midpoint of both, (T, 3) m.

        Of a chain with other ends, these in its base. NaN while the chain is out of
        sight.
        """
        return self._of_ends(chain, "in").mean(axis=1)

    def task_rotation(self, chain: ChainLike) -> Array:
        """Orientation of the (first) hand or end of a chain, (T, 3, 3), likewise."""
        return self._of_ends(chain, "rotation_in")[:, 0]

    def hand_speed(self, chain: ChainLike) -> Array:
        """Speed of the chain's fastest hand relative to the thorax, (T,) m/s.

        NaN while the chain is out of sight.
        """
        velocity = self._of_ends(chain, "velocity_in")
        return np.linalg.norm(velocity, axis=2).max(axis=1)

    def to_dataframe(self) -> Any:
        """Return a pandas DataFrame with one row per frame; needs pandas.

        Its index is ``time_s``; the columns are ``<joint>_rad``,
        ``<side>_hand_<axis>_m`` in the thorax frame, ``residual_m`` and ``converged``.
        """
        columns = {
            f"{name}_rad": angle
            for name, angle in zip(self.joint_names, self.angles.T, strict=True)
        }
        for hand, side in enumerate(SIDES):
            for axis, name in enumerate("xyz"):
                columns[f"{side}_hand_{name}_m"] = self.hand_in_thorax[:, hand, axis]
        return data_frame(
            self.time,
            columns | {"residual_m": self.residual, "converged": self.converged},
        )

    def to_xarray(self) -> Any:
        """Return an xarray Dataset along time, joint, side and axis; needs xarray.

        Variables are ``angles`` and ``velocities`` of the joints, ``hand_in_thorax``,
        ``hand_rotation_in_thorax``, ``hand_velocity_in_thorax``, ``residual`` and
        ``converged``, each with its unit.
        """
        hand = ("time", "side", "axis")
        velocities = self.v[:, -len(self.joint_names) :]
        return dataset(
            {
                "time": self.time,
                "joint": list(self.joint_names),
                "side": list(SIDES),
                "axis": list("xyz"),
                "column": list("xyz"),
            },
            {
                "angles": (("time", "joint"), self.angles, "rad"),
                "velocities": (("time", "joint"), velocities, "rad/s"),
                "hand_in_thorax": (hand, self.hand_in_thorax, "m"),
                "hand_rotation_in_thorax": (
                    (*hand, "column"),
                    self.hand_rotation_in_thorax,
                    "1",
                ),
                "hand_velocity_in_thorax": (hand, self.hand_velocity_in_thorax, "m/s"),
                "residual": (("time",), self.residual, "m"),
                "converged": (("time",), self.converged, "1"),
            },
        )

    def _while_in_sight(self, chain: ChainLike, values: Array) -> Array:
        columns = [self.joint_names.index(name) for name in chain_joints(chain)]
        shown = self.in_sight(chain) & self.believed(chain)
        return np.where(shown[:, None], values[:, columns], np.nan)

    def _thorax_known(self) -> Mask:
        # Its markers are judged with each arm's.
        judged = np.asarray((self.rejected < 0).any(axis=1), dtype=bool)
        return all_seen(self.segments, self.seen) & judged

    def _of_ends(self, chain: ChainLike, what: str) -> Array:
        """Return what is known of a chain's ends, (T, E, ...)."""
        own = as_chain(chain)
        if own.hands is not None:
            return np.asarray(getattr(self, f"hand_{what}_thorax"))[:, list(own.hands)]
        wanted = [(end, own.base) for end in own.ends]
        if not set(wanted) <= set(self.ends):
            raise InvalidInput(
                f"the motion does not hold where {' and '.join(own.ends)} of the chain "
                f"'{own}' is; track it with that chain, or add it with "
                "ikns.motion.ends.with_ends."
            )
        columns = [self.ends.index(each) for each in wanted]
        return np.asarray(getattr(self, f"end_{what}_base"))[:, columns]

    def _sides(self, chain: ChainLike) -> list[int]:
        return [SIDES.index(side) for side in chain_sides(chain)]


def all_seen(segments: tuple[str, ...], seen: Mask, *sides: str) -> Mask:
    """Whether the thorax and every segment of these arms were seen, (T,).

    Arguments are those of :class:`Motion`, and names of :data:`ikns.body.chains.SIDES`.
    """
    own = [link.startswith(("thorax", *sides)) for link in segments]
    return np.asarray(seen[:, own].all(axis=1))


def believed_joints(joint_names: tuple[str, ...], rejected: Indices) -> Mask:
    """Which joints (T, J) belong to no arm whose markers were rejected (T, 2)."""
    kept = np.ones((len(rejected), len(joint_names)), dtype=bool)
    for side, numbers in zip(SIDES, rejected.T, strict=True):
        own = [name.startswith(side) for name in joint_names]
        kept[np.ix_(numbers >= 0, own)] = False
    return kept
