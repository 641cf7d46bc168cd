"""How well a frame's markers determine a signal that is read off the pose.

A signal with the gradient g over the joints follows the markers by v = H^-1 g, where

    H = sum_seen weight J'J + diag(pull^2 / n)

is the cost's curvature at the pose (J a marker's Jacobian). The pull towards the pose
before acts anew in every frame, so after n frames a joint that is badly seen has gone
n times as far towards where the markers want it: its weight is pull^2 / n. The signal's
variance is the sum of

- what camera noise does, NOISE^2 v' (sum_seen weight J'J) v;
- what hidden joints do: a joint next to a segment with a marker that has not been seen
  for a time t may have turned by its speed times t, of which the pull keeps
  pull^2 / n v;
- what hidden markers leave: markers never fit a body exactly. While all are seen their
  residuals r balance; without the hidden ones the pose goes where the others want it,
  which shifts the signal by -sum_seen weight (J v) . r, with r, of the body less the
  marker, from when all were seen. It counts as an error, unless the shift is taken
  off the signal: then what changes of it does, as of the residuals;
- what changes of these residuals as the arm moves on.

First-order propagation of errors through the minimum of a cost; see e.g. Bjorck 1996,
Numerical Methods for Least Squares Problems, sections 1.4 and 2.7.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ikns._kernels.body.articulated import solve
from ikns._kernels.body.descent import factor_at
from ikns._kernels.body.marker_errors import penalties
from ikns._kernels.body.marker_problem import MarkerProblem, Scratch
from ikns._kernels.body.tree import joint_axes
from ikns._kernels.compiled import borrowing, inner, inner_borrowing
from ikns.arrays import Array, Indices

#: Noise of a marker of weight 1, m: what the pull towards the pose before assumes too.
NOISE = 1e-3
#: A joint goes no farther than what it turns in this time, s.
LONGEST = 0.5
#: Frames after which the pull towards the pose before counts no more.
SETTLED = 100.0
#: How fast the remembered residual of a marker follows, by frame.
FOLLOW = 0.1
#: A residual changes by as much as it is large within this time, s: of people who reach
#: and drink by 0.1 to 0.2 of it within 0.1 s, by 0.2 to 0.5 within 0.3 s.
CHANGED = 1.0
# Columns of the memory of markers.
_UNSEEN, _FRAMES, _LEFT = 0, 1, 2
#: Columns of it.
WIDTH = 5


class Segments(NamedTuple):
    """Segments between which joints lie, for M markers and n degrees of freedom."""

    of_marker: Indices  # (M,) segment, or -1 for a marker that is not the signal's
    of_joint: Indices  # (n, 2) segments on both sides of each, or -1
    speed: Array  # (n,) ordinary rate of each, rad/s or m/s
    total: int


def new_marker_memory(n_markers: int) -> Array:
    """Return the memory of markers that were never seen, (M, WIDTH)."""
    memory = np.zeros((n_markers, WIDTH))
    memory[:, [_UNSEEN, _FRAMES]] = np.inf
    return memory


@inner_borrowing
def note_markers(
    problem: MarkerProblem,
    s: Scratch,
    dt: float,
    believed: bool,
    segments: Segments,
    memory: Array,
) -> bool:
    """Remember which markers a solved frame shows, and how they fit.

    `dt` is the time since the frame before, s. Residuals are kept in the frame of the
    marker's joint, if the markers are `believed` and none of the signal's is hidden,
    unless it is so for long. Joints and errors at the
    pose are in `s`. Returns whether one of the signal's is hidden.
    """
    step = dt if 0 < dt < np.inf else 0.0
    hidden = lately = False
    for m in range(len(memory)):
        if s.weight[m] > 0:
            memory[m, _UNSEEN] = memory[m, _FRAMES] = 0.0
            continue
        memory[m, _UNSEEN] += step
        memory[m, _FRAMES] += 1.0
        if segments.of_marker[m] >= 0 and problem.marker_weight[m] > 0:
            hidden = True
            lately = lately or memory[m, _UNSEEN] < LONGEST
    if not believed or lately:
        return hidden
    for m in range(len(memory)):
        if s.weight[m] == 0:
            continue
        j = problem.marker_joint[m]
        for a in range(3):
            local = 0.0
            for b in range(3):
                local += s.rotation[j, b, a] * s.error[m, b]
            memory[m, _LEFT + a] += FOLLOW * (local - memory[m, _LEFT + a])
    return hidden


@inner
def factor_information(
    problem: MarkerProblem,
    s: Scratch,
    q: Array,
    segments: Segments,
    memory: Array,
) -> bool:
    """Factor H into `s.rows` after :func:`note_markers`; False where it cannot be.

    Written are `s.weak_pull` and `s.unseen_turn`.
    """
    penalties(
        problem.tree,
        problem.angle,
        problem.lower,
        problem.upper,
        q,
        0.0,
        problem.limit,
        q,
        s.moved,
        s.beyond,
    )
    ages = np.zeros((segments.total, 2))
    for m in range(len(memory)):
        k = segments.of_marker[m]
        if k >= 0:
            for a in range(2):
                ages[k, a] = max(ages[k, a], memory[m, a])
    for d in range(len(s.extra)):
        unseen = frames = 0.0
        for a in range(2):
            k = segments.of_joint[d, a]
            if k >= 0:
                unseen = max(unseen, ages[k, _UNSEEN])
                frames = max(frames, ages[k, _FRAMES])
        n = min(frames, SETTLED) if frames > 0 else SETTLED
        s.weak_pull[d] = problem.pull**2 / n
        s.unseen_turn[d] = segments.speed[d] * min(unseen, LONGEST)
        s.extra[d] = s.weak_pull[d]
        if s.beyond[d] != 0:
            s.extra[d] += problem.limit**2
    joint_axes(problem.tree, s.rotation, s.translation, s.axes)
    return factor_at(problem, s, s.extra, 0.0)


@inner_borrowing
def deviation(
    problem: MarkerProblem,
    s: Scratch,
    gradient: Array,
    segments: Segments,
    memory: Array,
    hidden: bool,
    shifted: bool,
) -> tuple[float, float]:
    """Return the standard deviation of a signal with this `gradient` (n,) over joints.

    And how far hidden markers shift it: an error too unless `shifted`, which says that
    it is taken off. After :func:`factor_information`; `hidden` as :func:`note_markers`
    returns. Degrees of freedom that are held do not count.
    """
    v = s.step
    for d in range(len(v)):
        v[d] = gradient[d] * problem.free[d]
    solve(problem.tree, s.rows, s.twist, v)
    noise = turned = 0.0
    for d in range(len(v)):
        noise += v[d] * (gradient[d] - s.weak_pull[d] * v[d])
        turned += (s.weak_pull[d] * v[d] * s.unseen_turn[d]) ** 2
    variance, shift = NOISE**2 * max(noise, 0.0) + turned, 0.0
    if hidden:
        shift, changed, unseen, lag = _misfit(problem, s, segments, memory)
        if shifted:
            age = min(unseen + lag, LONGEST) / CHANGED
            variance += age**2 * (changed + shift**2)
        else:
            variance += shift**2 + (min(unseen, LONGEST) / CHANGED) ** 2 * changed
    return math.sqrt(variance), shift


@borrowing
def _misfit(
    problem: MarkerProblem, s: Scratch, segments: Segments, memory: Array
) -> tuple[float, float, float, float]:
    """Shift by markers that do not fit without the hidden, and variance of changes.

    The latter for residuals that change entirely. Then for how long a marker has been
    hidden, s, and how far remembered residuals lag behind, s. `s.twist` are those of
    the joints at the rates v.
    """
    left = changed = longest = lag = 0.0
    for m in range(len(memory)):
        if problem.marker_weight[m] == 0 or segments.of_marker[m] < 0:
            continue
        if s.weight[m] == 0:
            if memory[m, _UNSEEN] > longest:
                longest = memory[m, _UNSEEN]
                lag = longest / memory[m, _FRAMES] / FOLLOW
            continue
        j, carrier = problem.marker_joint[m], problem.marker_carrier[m]
        t0, t1, t2 = s.twist[carrier, 0], s.twist[carrier, 1], s.twist[carrier, 2]
        w0, w1, w2 = s.twist[carrier, 3], s.twist[carrier, 4], s.twist[carrier, 5]
        u0 = s.weight[m] * (t0 + w1 * s.x[m, 2] - w2 * s.x[m, 1])
        u1 = s.weight[m] * (t1 + w2 * s.x[m, 0] - w0 * s.x[m, 2])
        u2 = s.weight[m] * (t2 + w0 * s.x[m, 1] - w1 * s.x[m, 0])
        r0 = _turned(s, j, 0, memory[m])
        r1 = _turned(s, j, 1, memory[m])
        r2 = _turned(s, j, 2, memory[m])
        left += u0 * r0 + u1 * r1 + u2 * r2
        changed += (u0**2 + u1**2 + u2**2) * (r0**2 + r1**2 + r2**2) / 3
    return -left, changed, longest, lag if lag < LONGEST else LONGEST


@borrowing
def _turned(s: Scratch, j: int, a: int, kept: Array) -> float:
    return (
        s.rotation[j, a, 0] * kept[_LEFT]
        + s.rotation[j, a, 1] * kept[_LEFT + 1]
        + s.rotation[j, a, 2] * kept[_LEFT + 2]
    )
