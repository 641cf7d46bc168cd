"""Sizes, axes and marker places from the static trial and many moving frames together.

A static trial knows lengths as well as markers are placed, and no axis at all. Frames
in which joints turn show where the axes are, wherever the markers sit. The cost is that
of :mod:`ikns.calibration.size_fit`, and

    (tilt / its spread)^2                  axes of elbow, forearm and wrist
    |p_m(q_k) - seen_mk|^2 / sd^2          in each of F moving frames

What markers are off has two parts. That of the cameras is new in every frame. Skin that
moves with the posture, and what the model lacks, is not: it does not average out, so
all frames together count it as one would. With their variances c and s,

    sd^2 = c + F s

c comes from second differences of neighboring frames, s is what is left of the
residual. Without skin motion the frames decide; with 6 mm of it they add little, and
the spreads say so.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ikns.arrays import Array, Indices
from ikns.body.joint_axes import TILTS
from ikns.body.model_file import SEGMENTS
from ikns.body.skeleton import Skeleton
from ikns.calibration.size_fit import (
    KNOWN_SD,
    MARKER_SD,
    POSE_SD,
    SizeFit,
    size_covariance,
    size_factors,
)
from ikns.calibration.static_trial import seen_markers

#: No camera places a marker better than this, m.
_LEAST_SD = 1e-4
#: The spread of the markers is measured on the fitted body and the fit repeated.
_ROUNDS = 3
#: The fit has converged when the predicted gain of a step is below this, in squared
#: standard deviations; most steps of a round.
_GAIN, _STEPS = 0.01, 30


class MotionFit(NamedTuple):
    """The fitted body; K tilts in the order of `TILTS`."""

    skeleton: Skeleton  # with all markers of the set at their places
    log_sizes: Array  # (S,) as in `SizeFit`
    tilts: Array  # (K,) rad
    covariance: Array  # (S + K, S + K) of both
    camera_sd: float  # m per axis
    skin_sd: float  # m per axis
    converged: bool


class _Shape(NamedTuple):
    """What all frames share."""

    sizes: Array  # (S,)
    offsets: Array  # (M, 3)
    tilts: Array  # (K,)

    def plus(self, step: Array) -> _Shape:
        s, k = len(self.sizes), len(self.tilts)
        return _Shape(
            self.sizes + step[:s],
            self.offsets + step[s:-k].reshape(-1, 3),
            self.tilts + step[-k:],
        )


def fit_motion(
    reference: Skeleton,
    target: Array,
    start: SizeFit,
    q: Array,
    markers: Array,
    *,
    camera_sd: float,
    known: bool = False,
) -> MotionFit:
    """Fit the body to a static trial and F moving frames.

    Parameters
    ----------
    reference : Skeleton
        The generic body with the set's markers at their nominal places.
    target : (M, 3) array
        Mean markers of the static trial in the world, m; NaN where never seen.
    start : SizeFit
        The fit to the static trial alone.
    q : (F, 25) array
        Postures of the moving frames to start from.
    markers : (F, M, 3) array
        Their markers in the world, m; NaN where not seen or not to be used.
    camera_sd : float
        Error of a marker that is new in every frame, m per axis.
    known : bool
        Whether the reference is the person's body, whose sizes and axes stay.
    """
    problem = _Problem(reference, target, markers, known=known)
    nominal = reference.resized(size_factors(start.log_sizes)).marker_positions
    offsets = start.positions - nominal
    shape = _Shape(start.log_sizes, offsets, np.zeros(len(TILTS)))
    q = np.vstack([start.q, q])
    camera_sd = max(camera_sd, _LEAST_SD)
    skin_sd = problem.skin_sd(shape, q, camera_sd)
    for _ in range(_ROUNDS):
        sd = float(np.sqrt(camera_sd**2 + len(markers) * skin_sd**2))
        shape, q, information, converged = _descend(problem, shape, q, sd)
        before, skin_sd = skin_sd, problem.skin_sd(shape, q, camera_sd)
        if abs(skin_sd - before) < 0.05 * max(before, camera_sd / 10):
            break
    covariance = np.linalg.inv(information)
    s, k = len(SEGMENTS), len(TILTS)
    both = np.r_[np.arange(s), np.arange(len(covariance) - k, len(covariance))]
    return MotionFit(
        problem.body(shape)[1],
        shape.sizes,
        shape.tilts,
        covariance[np.ix_(both, both)],
        camera_sd,
        skin_sd,
        converged,
    )


class _Problem:
    """Residuals and normal equations; frame 0 is the static trial."""

    def __init__(
        self, reference: Skeleton, target: Array, markers: Array, *, known: bool
    ) -> None:
        self.reference, self.worn = reference, reference.marker_set
        self.seen = np.concatenate([target[None], markers])
        self.shown = seen_markers(self.seen)
        self.trust = np.array([m.weight for m in self.worn.markers])
        self.placement = np.array([m.placement_sd for m in self.worn.markers])
        held = reference.columns(self.worn.held)
        self.free: Indices = np.setdiff1d(np.arange(reference.nv), held)
        self.prior = np.zeros((len(SEGMENTS) + self.placement.size + len(TILTS),) * 2)
        s = len(SEGMENTS)
        self.prior[:s, :s] = np.linalg.inv(size_covariance(known=known))
        tilts = [KNOWN_SD if known else sd for _, _, sd in TILTS]
        rest = np.r_[self.placement.ravel(), tilts]
        self.prior[range(s, len(rest) + s), range(s, len(rest) + s)] = rest**-2.0
        self._last: tuple[_Shape | None, Any] = None, None
        self._last_errors: tuple[_Shape | None, Any, Any] = None, None, None

    def body(self, shape: _Shape) -> tuple[Skeleton, Skeleton]:
        """Return the body with markers at nominal places and at their own."""
        known, bodies = self._last
        if known is not shape:  # errors and slopes ask for the same one
            bodies = self._bodies(shape)
            self._last = shape, bodies
        return bodies

    def _bodies(self, shape: _Shape) -> tuple[Skeleton, Skeleton]:
        tilts: dict[str, Array] = {}
        for (joint, component, _), angle in zip(TILTS, shape.tilts, strict=True):
            tilts.setdefault(joint, np.zeros(3))[component] = angle
        sized = self.reference.resized(size_factors(shape.sizes), tilts=tilts)
        places = sized.marker_positions + shape.offsets
        return sized, sized.with_markers(self.worn.at(places))

    def errors(self, shape: _Shape, q: Array) -> Array:
        """Markers of the body minus those seen, (1 + F, M, 3) m; 0 where not seen."""
        last_shape, last_q, errors = self._last_errors
        if last_shape is not shape or last_q is not q:  # the spread asks for them too
            _, placed = self.body(shape)
            off = placed.markers_in_world(q) - self.seen
            errors = np.where(self.shown[..., None], off, 0.0)
            self._last_errors = shape, q, errors
        return errors

    def weights(self, sd: float) -> Array:
        """Inverse variances, (1 + F, M) 1/m^2."""
        weights = self.shown * self.trust / sd**2
        weights[0] = self.shown[0] / MARKER_SD**2
        return weights

    def pulls(self) -> Array:
        """Inverse variances of the joint angles about zero, (1 + F, 1) 1/rad^2."""
        frames = len(self.seen) - 1
        return np.r_[1.0, np.full(frames, 1 / frames)][:, None] / POSE_SD**2

    def cost(self, shape: _Shape, q: Array, sd: float, errors: Array) -> float:
        """Sum of all squares."""
        y = np.concatenate([shape.sizes, shape.offsets.ravel(), shape.tilts])
        return float(
            np.sum(self.weights(sd) * (errors**2).sum(axis=2))
            + y @ self.prior @ y
            + np.sum(self.pulls() * q[:, 7:] ** 2)
        )

    def skin_sd(self, shape: _Shape, q: Array, camera_sd: float) -> float:
        """Return what cameras do not explain of the residual, m per axis."""
        squares = self.trust * (self.errors(shape, q)[1:] ** 2).sum(axis=2)
        shown = self.shown[1:]
        freedom = 3 * shown.sum() - len(self.free) * len(shown) - 3 * shown.shape[1]
        # The variance is known to sqrt(2 / freedom) of itself; what hides within twice
        # that is counted as skin motion.
        variance = squares.sum() / max(freedom, 1)
        variance *= 1 + 2 * np.sqrt(2 / max(freedom, 1))
        return float(np.sqrt(max(variance - camera_sd**2, 0.0)))

    def slopes(self, shape: _Shape, q: Array) -> tuple[Array, Array]:
        """Jacobians by the free pose (1 + F, 3 M, n) and the shape (1 + F, 3 M, P)."""
        sized, placed = self.body(shape)
        axes = [(joint, component) for joint, component, _ in TILTS]
        M, S, K = len(self.placement), len(SEGMENTS), len(axes)
        by_shape = np.zeros((len(q), M, 3, len(self.prior)))
        by_shape[..., :S], by_place = sized.size_jacobian(q)
        places = by_shape[..., S:-K].reshape(len(q), M, 3, M, 3)
        own = np.arange(M)
        places[:, own, :, own] = np.swapaxes(by_place, 0, 1)
        by_shape[..., S:-K] = places.reshape(len(q), M, 3, 3 * M)
        by_shape[..., -K:] = placed.tilt_jacobian(q, axes)
        by_pose = np.take(placed.marker_jacobian(q)[1], self.free, axis=-1)
        return (
            by_pose.reshape(len(q), 3 * M, -1),
            by_shape.reshape(len(q), 3 * M, -1),
        )


def _descend(
    problem: _Problem, shape: _Shape, q: Array, sd: float
) -> tuple[_Shape, Array, Array, bool]:
    """Gauss-Newton with step halving; also the information on the shape (P, P)."""
    free = problem.free
    angles = free >= 6
    errors = problem.errors(shape, q)
    cost = problem.cost(shape, q, sd, errors)
    for _ in range(_STEPS):
        A, B = problem.slopes(shape, q)
        w = np.repeat(problem.weights(sd), 3, axis=1)[..., None]
        r = errors.reshape(len(q), -1, 1)
        At, Bt = np.swapaxes(w * A, 1, 2), np.swapaxes(w * B, 1, 2)
        H = At @ A
        pull = problem.pulls() * angles
        H[:, range(len(free)), range(len(free))] += pull + 1e-9
        g = (At @ r)[..., 0] + pull * np.hstack([np.zeros((len(q), 6)), q[:, 7:]])[
            :, free
        ]
        C = At @ B
        y = np.concatenate([shape.sizes, shape.offsets.ravel(), shape.tilts])
        # Only frame k depends on its pose, which is taken out of the whole.
        both = np.linalg.solve(H, np.concatenate([C, g[..., None]], axis=2))
        into, alone = both[..., :-1], both[..., -1]
        information = (Bt @ B - np.swapaxes(C, 1, 2) @ into).sum(axis=0) + problem.prior
        slope = (Bt @ r)[..., 0].sum(axis=0) + problem.prior @ y
        slope -= np.einsum("fnp,fn->p", C, alone)
        step = -np.linalg.solve(information, slope)
        moves = np.zeros((len(q), 24))
        moves[:, free] = -alone - into @ step
        gain = -slope @ step + np.einsum("fn,fn->", g, alone)
        if gain < _GAIN:
            return shape, q, information, True
        length = min(1.0, 0.5 / max(np.abs(moves).max(), np.abs(step).max()))
        while length > 1e-4:
            trial = shape.plus(length * step)
            there = np.stack(
                [
                    problem.reference.integrate(a, length * b)
                    for a, b in zip(q, moves, strict=True)
                ]
            )
            trial_errors = problem.errors(trial, there)
            trial_cost = problem.cost(trial, there, sd, trial_errors)
            if trial_cost <= cost:
                break
            length /= 2
        else:
            return shape, q, information, False
        shape, q, errors, cost = trial, there, trial_errors, trial_cost
    return shape, q, information, False


def camera_noise(recordings: Sequence[Array]) -> float:
    """Error of a marker that is new in every frame, m per axis.

    From the second differences of each recording's markers (T, M, 3): of slow markers
    they hold the noise of three frames, 6 variances. The median is blind to the moments
    in which markers are fast, or exchanged.
    """
    bends = [np.diff(markers, n=2, axis=0).ravel() for markers in recordings]
    sizes = np.abs(np.concatenate(bends)) if bends else np.empty(0)
    sizes = sizes[np.isfinite(sizes)]
    if not sizes.size:
        return _LEAST_SD
    # 0.6745 is the median size of a standard normal number.
    return float(np.median(sizes) / 0.6745 / np.sqrt(6))
