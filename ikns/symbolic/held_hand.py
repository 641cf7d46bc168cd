"""Self-motions of an arm that holds its hand: sweeps, and the range of c.

Every posture x of a chain that keeps the hand where it is obeys

    hand(x) = hand(q),   lower <= x <= upper,   clearance(x) >= 0.

With one degree of freedom left these postures are a curve. The longest sweep along it
is found by direct transcription: K postures a side, one equal step h apart,

    maximize h   with   |x_k - x_(k-1)|^2 = h^2,   no turning back,

all of the above at each. The range of a direction Z is where Z x is least and greatest
over the curve, or, with more freedom left, over all postures that hold the hand. IPOPT
solves both with exact derivatives (Waechter & Biegler 2006, Math Program 106:25).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ikns.arrays import Array
from ikns.body.chains import ChainLike
from ikns.body.skeleton import Robot, Skeleton
from ikns.errors import InvalidInput
from ikns.symbolic.chain import Pair, chain_of, held
from ikns.symbolic.path_following import STRIDE, Function, Walk, come_back, walk
from ikns.symbolic.posture import Start, binding, start_of
from ikns.symbolic.programs import NODES, Climber, Sweeper
from ikns.symbolic.results import AvailableRange, Sweep

#: A posture or postures, active limits, whether it is a solution, optimizer status.
Found = tuple[Array, tuple[str, ...], bool, str]

#: Postures to search from, besides the given one, where much freedom is left.
_STARTS = 5
#: With less room than this a side of a sweep is only its start, rad.
_ROOM = 1e-4


class HeldHand:
    """The postures of a chain that hold a hand; built once, solved at many places.

    Parameters
    ----------
    body : Skeleton or Robot
    chain : str, optional
        Of a skeleton, see :class:`ikns.Chain`.
    task : {"pose", "position"}
        What the hand keeps.
    pairs : sequence of (Capsule, Capsule), optional
        What must not overlap, see :func:`ikns.symbolic.volumes.arm_pairs`, the default
        for a skeleton; empty for limits alone.
    """

    def __init__(
        self,
        body: Skeleton | Robot,
        chain: ChainLike | None = None,
        *,
        task: str = "pose",
        pairs: Sequence[Pair] | None = None,
    ) -> None:
        self.chain = chain_of(body, chain, hands_move=task == "position", pairs=pairs)
        self.held = held(self.chain, task=task)

    def sweep(self, q: ArrayLike, *, direction: ArrayLike | None = None) -> Sweep:
        """Find the longest sweep through a posture, both ways.

        Parameters
        ----------
        q : (18,) or (25,) array
            Joint angles or configuration of a skeleton; (n,) of a robot.
        direction : (n,) array, optional
            Increases from the first posture to the last; default: the joint that
            moves most at the start.

        Raises
        ------
        InvalidInput
            When `q` is not finite, beyond a limit or has volumes that overlap, or the
            held hand does not leave exactly one degree of freedom.
        """
        at = start_of(self.chain, self.held, q)
        if at.freedom != 1:
            raise InvalidInput(
                "a sweep needs one degree of freedom left with the hand held, found "
                f"{at.freedom}."
            )
        null = at.null[0]
        rises = null[np.abs(null).argmax()]
        if direction is not None:
            rises = null @ self._direction(direction)
        null = -null if rises < 0 else null
        down, up = self._side(at, -null), self._side(at, null)
        postures = np.concatenate([down[0][:0:-1], up[0]])
        return Sweep(
            postures=postures,
            length=float(np.linalg.norm(np.diff(postures, axis=0), axis=1).sum()),
            stops=(down[1], up[1]),
            solved=(down[2], up[2]),
            status=(down[3], up[3]),
        )

    def range(
        self,
        q: ArrayLike,
        direction: ArrayLike,
        *,
        starts: int = _STARTS,
        seed: int = 0,
    ) -> AvailableRange:
        """Find how far a direction Z over the joints goes while the hand is held.

        Parameters
        ----------
        q : (18,) or (25,) array
            As :meth:`sweep` takes it.
        direction : (n,) array
        starts, seed : int
            Where more than one degree of freedom is left: how many random postures
            besides `q` to search from.

        Raises
        ------
        InvalidInput
            As :meth:`sweep`, or when the held hand leaves no joint free.
        """
        at, Z = start_of(self.chain, self.held, q), self._direction(direction)
        if at.freedom == 1:
            walks = [self._walk(at, way * at.null[0]) for way in (-1.0, 1.0)]
            curve = np.concatenate([w.postures for w in walks])
            low, high = (self._end_of_curve(at, w * Z, curve) for w in (-1.0, 1.0))
        else:
            begin = self._scattered(at, starts, np.random.default_rng(seed))
            low, high = (self._farthest(at, w * Z, begin) for w in (-1.0, 1.0))
        return AvailableRange(
            lower=float(Z @ low[0]),
            upper=float(Z @ high[0]),
            postures=np.stack([low[0], high[0]]),
            stops=(low[1], high[1]),
            solved=(low[2], high[2]),
            status=(low[3], high[3]),
            freedom=at.freedom,
        )

    def _direction(self, direction: ArrayLike) -> Array:
        Z = np.asarray(direction, dtype=np.float64)
        n = len(self.chain.columns)
        if Z.shape != (n,) or not np.isfinite(Z).all() or not Z.any():
            raise InvalidInput(
                f"expected a finite direction ({n},) over {self.chain.names[0]} to "
                f"{self.chain.names[-1]}, not zero, found an array {Z.shape}."
            )
        return Z

    # --- a sweep ----------------------------------------------------------------------

    def _side(self, at: Start, ahead: Array) -> Found:
        """From the start to one end."""
        walked = self._walk(at, ahead)
        guess = np.array([self._back(at, x) for x in _spread(walked.postures)])
        if walked.beyond is None:
            why = {"singular": "singular posture"}.get(walked.why, walked.why)
            return guess, (why,), True, "walked"
        if len(walked.postures) == 1:
            guess = at.x + np.linspace(0, _ROOM, NODES + 1)[:, None] * ahead
            beyond = self._back(at, guess[-1])
            if not self._free(beyond, at):
                still = np.repeat(at.x[None], NODES + 1, axis=0)
                return still, self._binding(beyond, at), True, "no room"
        postures, solved, status = self._sweeper.solve(guess, at.hold, ahead)
        if not solved:
            return guess, self._binding(walked.beyond, at), False, status
        # Usually the last one is at a limit, but an earlier one may be.
        stopped = [self._binding(x, at) for x in postures[:0:-1]]
        return postures, next(filter(None, stopped), ()), True, status

    def _walk(self, at: Start, ahead: Array) -> Walk:
        return walk(*self._hand(at), lambda x: self._free(x, at), at.x, ahead)

    # --- the ends of a direction ------------------------------------------------------

    def _end_of_curve(self, at: Start, Z: Array, curve: Array) -> Found:
        """Posture with the greatest Z x on the curve through the start."""
        guess = curve[int(np.argmax(curve @ Z))]
        x, solved, status = self._climber.solve(guess, at.hold, Z)
        # Farther away it would be on another curve.
        if solved and np.linalg.norm(x - guess) <= 2 * STRIDE:
            return x, self._binding(x, at) or ("turns back",), True, status
        return guess, self._binding(guess, at), False, status

    def _farthest(self, at: Start, Z: Array, begin: Array) -> Found:
        """Posture with the greatest Z x that a search from any beginning finds."""
        tries = [self._climber.solve(x, at.hold, Z) for x in begin]
        good = [(x, status) for x, solved, status in tries if solved]
        if not good:
            return at.x, self._binding(at.x, at), False, tries[0][2]
        x, status = max(good, key=lambda found: float(Z @ found[0]))
        return x, self._binding(x, at) or ("turns back",), True, status

    def _scattered(self, at: Start, n: int, rng: np.random.Generator) -> Array:
        """Postures that hold the hand, the given one first."""
        steps = rng.normal(size=(n, at.freedom)) @ at.null
        return np.array([at.x, *(self._back(at, at.x + step) for step in steps)])

    # --- what both need ---------------------------------------------------------------

    def _hand(self, at: Start) -> tuple[Function, Function]:
        """How far the hand is off, and the Jacobian, as functions of the joints."""
        off, jacobian, given = self.held.off, self.held.jacobian, at.angles
        return (
            lambda x: off(x, given, at.positions, at.rotations).full().ravel(),
            lambda x: np.asarray(jacobian(x, given).full()),
        )

    def _back(self, at: Start, x: Array) -> Array:
        """Return the posture near x that holds the hand; the start if none is found."""
        inside = np.clip(x, self.chain.lower, self.chain.upper)
        back = come_back(*self._hand(at), inside)
        return at.x if back is None else back

    def _free(self, x: Array, at: Start) -> bool:
        within = (x >= self.chain.lower).all() and (x <= self.chain.upper).all()
        return bool(within and (self.held.clearance(x, at.angles).full() >= 0).all())

    def _binding(self, x: Array, at: Start) -> tuple[str, ...]:
        return binding(self.chain, self.held, x, at.angles)

    @cached_property
    def _climber(self) -> Climber:
        return Climber(self.chain, self.held)

    @cached_property
    def _sweeper(self) -> Sweeper:
        return Sweeper(self.chain, self.held)


def available_range(
    body: Skeleton | Robot,
    q: ArrayLike,
    chain: ChainLike | None,
    direction: ArrayLike,
    *,
    task: str = "pose",
    pairs: Sequence[Pair] | None = None,
    starts: int = _STARTS,
    seed: int = 0,
) -> AvailableRange:
    """Find how far a direction goes at one posture; see :meth:`HeldHand.range`.

    Examples
    --------
    >>> skeleton = Skeleton.load()
    >>> q = np.radians([0, 0, 30, 40, 0, 90, 0, 0, 0] * 2)
    >>> [swivel] = skeleton.null_spaces(q, "right_arm")[0]
    >>> found = available_range(skeleton, q, "right_arm", swivel)
    >>> found.stops[0]
    ('right_wrist_deviation at its lower limit',)
    """
    hand = HeldHand(body, chain, task=task, pairs=pairs)
    return hand.range(q, direction, starts=starts, seed=seed)


def _spread(postures: Array) -> Array:
    """Return postures evenly along a polygon, (K + 1, n)."""
    if len(postures) == 1:
        return np.repeat(postures, NODES + 1, axis=0)
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(postures, axis=0), axis=1))]
    at = np.linspace(0, length[-1], NODES + 1)
    return np.stack([np.interp(at, length, c) for c in postures.T], axis=1)
