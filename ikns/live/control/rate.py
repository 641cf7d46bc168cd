"""Rate mode: only the null-space part of the joint velocity moves c.

The paper's position mode computes c from the posture, so c also changes when a reach
changes the posture. Rate mode integrates the joint velocity within the null space::

    dc/dt = beyond(Z^ P v / (M^ - m^), carry * hand speed)

P projects onto the null space, learned (the span of Z^) or analytic (that of the hand's
Jacobian). A natural reach moves the arm within its null space too, and the more so the
faster the hand is; rates below `carry` times the hand's speed are attributed to the
reach and ignored (:func:`ikns.live.control.null_rate.garrote`).

An integral drifts, so c is pulled towards the position mode's value: while the person
moves c (`travel`), where the correction is not noticed, and optionally with time while
the hand is held (`tau`). With an infinite `tau`, c rests while the elbow rests.
"""

from __future__ import annotations

import math
from math import isfinite, isnan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns._kernels.row_space import write_bases
from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.errors import InvalidInput
from ikns.live.control.local_map import LocalMap
from ikns.live.control.null_rate import checked_metric, garrote, null_rate
from ikns.motion.motion import Motion
from ikns.nullspace.map import NullSpaceMap
from ikns.numerics.subspace import null_spaces

Array = NDArray[np.float64]

#: Samples farther apart are not integrated across, s.
_GAP = 0.1


class RateControl:
    """Control signal c from joint velocities, sample by sample; use one per thread.

    Parameters
    ----------
    null_space_map : NullSpaceMap
        Fitted, for `chain`.
    skeleton : Skeleton, optional
        Projects onto the null space of its Jacobian; without one, onto the span of Z^.
    chain : str
        See :data:`ikns.body.chains.CHAINS`.
    task : {"pose", "position"}
        What of the hand is held, for the Jacobian.
    metric : (n,) or (n, n) array, optional
        W of :func:`ikns.live.control.null_rate`, or its diagonal. Default: the
        identity.
    carry : float or (d,) array
        Change of c per meter of hand path that a reach causes; see
        :func:`ikns.live.control.reach_gain`. The default was chosen on virtual subjects
        that are not part of the results of ``benchmarks/rate_mode.py``.
    travel : float
        A small offset from the position mode shrinks to 1/e while c moves by this much.
        The correction never exceeds the motion: c at most stops or moves twice as fast,
        and never moves against the person. Infinite: the offset stays.
    tau : float
        Time in which the offset shrinks to 1/e while the hand is held, s. This moves c
        without any motion of the person.
    max_hand_speed : float
        Slower hands count as held, m/s.
    limits : (float, float) or None
        c is clipped to this range at every step: moving on against a limit corrects an
        offset, and moving back takes effect at once. None for analysis.

    Raises
    ------
    InvalidInput
        When a parameter is out of its range or the map is of other joints.

    Examples
    --------
    Two of seven joints move by 0.2 rad; c knows the second, by 2 per rad.

    >>> corners = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    >>> Z = np.outer(np.ones(8), np.eye(7)[1])
    >>> learned = NullSpaceMap.from_arrays(corners, Z, np.zeros(8), np.full(8, 0.5))
    >>> control = RateControl(learned)
    >>> v = np.array([1.0, 1.0, 0, 0, 0, 0, 0])
    >>> for k in range(21):
    ...     c = control.step(0.01 * k * v, v, [0.5, 0.5, 0.5], 0.01)
    >>> c.round(6)
    array([0.4])
    """

    def __init__(
        self,
        null_space_map: NullSpaceMap,
        skeleton: Skeleton | None = None,
        chain: str = "right_arm",
        *,
        task: str = "pose",
        metric: ArrayLike | None = None,
        carry: ArrayLike = 1.0,
        travel: float = 0.1,
        tau: float = np.inf,
        max_hand_speed: float = 0.05,
        limits: tuple[float, float] | None = (0.0, 1.0),
    ) -> None:
        _, d, n = null_space_map.directions_.shape
        joints = chain_joints(chain)
        self.null_space_map, self.skeleton, self.chain = null_space_map, skeleton, chain
        self.task, self.metric = task, checked_metric(metric, n)
        self.carry = np.asarray(carry, dtype=np.float64)
        self.travel, self.tau, self.max_hand_speed = travel, tau, max_hand_speed
        self.limits = (-np.inf, np.inf) if limits is None else limits
        for right, sentence in (
            (
                n == len(joints),
                f"a map of {len(joints)} joints for {chain}, not {n}",
            ),
            (task in ("pose", "position"), f"task 'pose' or 'position', not '{task}'"),
            (
                self.carry.shape in ((), (1,), (d,)) and bool((self.carry >= 0).all()),
                f"carry of at least 0, one or {d}, found {self.carry.tolist()}",
            ),
            (travel > 0, f"travel above 0, found {travel}"),
            (tau > 0, f"tau above 0 s, found {tau}"),
            (max_hand_speed > 0, f"max_hand_speed above 0 m/s, not {max_hand_speed}"),
            (self.limits[0] < self.limits[1], f"limits low < high, found {limits}"),
        ):
            if not right:
                raise InvalidInput(f"expected {sentence}.")
        self._here = LocalMap(null_space_map)
        self._columns: list[int] | slice = slice(None)
        self._shapes: tuple[tuple[int], ...] = ((n,),)
        if skeleton is not None:
            names = skeleton.joint_names
            self._columns = [names.index(j) - len(names) for j in joints]
            self._shapes = ((7 + len(names),), (len(names),))
        self.reset()

    def reset(self, c: ArrayLike | None = None) -> None:
        """Restart at `c`, or at the position mode's value of the next sample."""
        d = self.null_space_map.directions_.shape[1]
        self.c: Array = np.full(d, np.nan)
        self._rate: Array | None = None
        self._place: Array | None = None
        if c is not None:
            given = np.asarray(c, dtype=np.float64)
            if given.shape not in ((), (d,)) or not np.isfinite(given).all():
                raise InvalidInput(
                    f"expected a finite c for {d} degrees of freedom, found "
                    f"{given.tolist()}."
                )
            self.c = self._within(np.broadcast_to(given, d))

    def step(
        self,
        q: ArrayLike,
        v: ArrayLike,
        x: ArrayLike,
        dt: float,
        *,
        hand_speed: float | None = None,
    ) -> Array:
        """Process the next sample.

        Rates are integrated by the trapezoidal rule, so the error of a sampled motion
        shrinks with the square of `dt`. An incomplete sample, or one more than 0.1 s
        after the last, leaves c unchanged and restarts the integration: c never jumps.

        Parameters
        ----------
        q : (25,) or (18,) array
            Configuration of the skeleton, or its joint angles; without a skeleton the
            (n,) joint angles of the chain, rad.
        v : (n,) array
            Joint velocity of the chain, rad/s.
        x : (3,) array
            Hand in the thorax frame, m.
        dt : float
            Time since the last sample, s.
        hand_speed : float, optional
            m/s, smoothed like `v`. Default: from `x` and the last sample.

        Returns
        -------
        (d,) array
            Within the limits; NaN before the first complete sample.
        """
        place = np.asarray(x, dtype=np.float64)
        if hand_speed is None:
            before = place if self._place is None else self._place
            hand_speed = float(np.linalg.norm(place - before)) / dt if dt > 0 else 0.0
        rate, position = self.rate(q, v, place)
        if not (0 <= dt <= _GAP and isfinite(rate.sum() + position.sum() + hand_speed)):
            self._rate = self._place = None
            return self.c.copy()
        rate = garrote(rate, self.carry * hand_speed)
        if isnan(self.c[0]):
            self.c = self._within(position)
        elif self._rate is not None:
            step = (self._rate + rate) * (dt / 2)
            most = np.abs(step)
            moved = self.c + step
            pull = -np.expm1(-most / self.travel) * (position - moved)
            moved += np.minimum(np.maximum(pull, -most), most)
            if hand_speed < self.max_hand_speed:
                moved -= math.expm1(-dt / self.tau) * (position - moved)
            self.c = self._within(moved)
        self._rate, self._place = rate, place
        return self.c.copy()

    def rate(self, q: ArrayLike, v: ArrayLike, x: ArrayLike) -> tuple[Array, Array]:
        """Null rate of c before `carry`, (d,) 1/s, and the position mode's c, (d,).

        NaN where something is missing, or the map has no value or no range.
        """
        given, velocity = np.asarray(q, float), np.asarray(v, float)
        d, n = self._here.shape
        if velocity.shape != (n,) or given.shape not in self._shapes:
            raise InvalidInput(
                f"expected q {self._shapes[0]} and v ({n},), found {given.shape} and "
                f"{velocity.shape}."
            )
        angles = given[self._columns]
        Z, low, width = self._here(np.asarray(x, dtype=np.float64))
        known = isfinite(angles.sum() + velocity.sum() + width.sum())
        if not (known and width.min() > 0):
            return np.full(d, np.nan), np.full(d, np.nan)
        position = (Z @ angles - low) / width
        if self.skeleton is None and self.metric is None:  # Z P = Z
            return Z @ velocity / width, position
        basis = Z
        if self.skeleton is not None:
            basis = _null_space(
                self.skeleton.chain_jacobian(given, self.chain, task=self.task)
            )
        return null_rate(Z, width, basis, velocity, metric=self.metric), position

    def _within(self, c: Array) -> Array:
        return np.minimum(np.maximum(c, self.limits[0]), self.limits[1])

    def track(self, motion: Motion) -> Array:
        """Restart and process all samples of a motion.

        Returns
        -------
        (T,) array, or (T, d) for several degrees of freedom
            Control signal of each sample, as from :meth:`step`.
        """
        self.reset()
        steps = np.diff(motion.time, prepend=motion.time[:1])
        samples = zip(
            *samples_of(self, motion), steps, motion.hand_speed(self.chain), strict=True
        )
        c = np.array(
            [self.step(q, v, x, dt, hand_speed=s) for q, v, x, dt, s in samples]
        )
        return c[:, 0] if c.shape[1] == 1 else c


def samples_of(control: RateControl, motion: Motion) -> tuple[Array, Array, Array]:
    """Return q, v and x for :meth:`RateControl.step`, one row per sample."""
    chain = control.chain
    q = motion.chain_angles(chain) if control.skeleton is None else motion.q
    return q, motion.chain_velocities(chain), motion.task_position(chain)


def _null_space(J: Array) -> Array:
    """As :func:`ikns.numerics.subspace.null_space`, without its checks."""
    k, n = J.shape
    basis, rank = np.empty((1, max(n - k, 0), n)), np.empty(1, dtype=np.int64)
    write_bases(J[None], 1e-9, False, basis, rank)
    # A stretched arm has a larger null space.
    return basis[0] if rank[0] == min(k, n) else null_spaces(J)[0]
