"""Frames one after the other: where each starts, and when to start from scratch.

A frame starts from the pose before, which is trusted while nothing speaks against it.
After a frame whose markers cannot be believed the next starts from the last pose that
could; and a pose whose cost is suspicious is compared with one from scratch, as a
minimum need not be the minimum.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ikns._kernels.body.descent import copy, errors_at
from ikns._kernels.body.marker_gate import (
    MarkerGate,
    fits,
    gate_figures,
    pack_gate,
    unpack_gate,
)
from ikns._kernels.body.marker_ik import far_cost, solve_frame
from ikns._kernels.body.marker_problem import (
    MarkerProblem,
    Scratch,
    cut,
    pack,
    unpack,
)
from ikns._kernels.compiled import borrowing, inner_borrowing
from ikns.arrays import Array, Indices

#: Suspicious: so many times the usual root mean square error, which is of this size at
#: least, m; joints far beyond their limits; markers that do not fit.
_TIMES, _LEAST = 3.0, 0.01
#: How slowly the usual error follows, by frame.
_USUAL = 0.02
#: A pose from scratch is taken with less than this share of the cost.
_BETTER = 0.5
#: Frames between two attempts double up to this number while none is better.
_LONGEST_WAIT = 128.0
# When the markers of all limbs fitted last.
_JUST_NOW, _LATELY, _LONG_AGO = 0.0, 1.0, 2.0
# Entries of `FrameMemory.numbers`.
_WAIT, _SINCE, _TRIED, _COST, _BEFORE, _AGE = 0, 1, 2, 3, 4, 5


class FrameMemory(NamedTuple):
    """What is known of the frames before."""

    numbers: Array  # (5 + limbs,)
    good: Array  # (nq,) of each limb the last pose whose markers fit
    start: Array  # (nq,) where the next frame starts


def new_memory(nq: int, limbs: int) -> Array:
    """Return the memory before a first frame, as one array; it ends with the start."""
    memory = np.zeros(_AGE + limbs + 2 * nq)
    memory[_COST] = np.nan
    memory[_AGE : _AGE + limbs] = np.inf
    return memory


@inner_borrowing
def cut_memory(memory: Array, limbs: int) -> FrameMemory:
    """Divide it, for a kernel that borrows its arrays, too."""
    good = _AGE + limbs
    start = (good + len(memory)) // 2
    return FrameMemory(memory[:good], memory[good:start], memory[start:])


def pack_frames(problem: MarkerProblem, gate: MarkerGate) -> tuple[Indices, Array]:
    """Pack a problem and a gate behind it into integers and reals."""
    whole, real = pack(problem)
    own_whole, own_real = pack_gate(gate)
    return np.concatenate([whole, own_whole]), np.concatenate([real, own_real])


@borrowing
def solve_frames(
    whole: Indices,
    real: Array,
    markers: Array,
    first: int,
    last: int,
    way: int,
    from_scratch: bool,
    patience: int,
    memory: Array,
    work: Array,
    rows: Array,
) -> None:
    """Solve frames from `first` to before `last`, `way` (1 or -1) one after the other.

    `whole` and `real` are those of :func:`pack_frames`, `markers` (T, M, 3) in the
    world, m, NaN where not seen. `memory` is that of :func:`new_memory` and ends with
    the pose before the first frame, unless that is solved `from_scratch`. Later frames
    start from the previous one, or after frames that do not fit from the last that did,
    if no more than `patience` frames passed. `work` is scratch of
    :func:`ikns._kernels.body.marker_problem.scratch_size` reals.

    Written are the `rows` (T, nq + 3 + limbs): the solution, the previous pose where no
    marker is seen; the residual, the root mean square distance of the seen markers (m;
    NaN without any, infinite where the previous pose is not finite); the iterations,
    `INFINITE` where a marker is infinite, not seen and not NaN; and 1 where it
    converged, and for each limb where its markers passed the gate, else 0.
    """
    problem = unpack(whole, real)
    s = cut(problem, work)
    gate = unpack_gate(whole[whole[8] :], real[whole[9] :])
    known = cut_memory(memory, problem.n_branches)
    nq = len(s.q)
    for i in range(first, last, way):
        row, q = rows[i], rows[i, :nq]
        residual, iterations, converged = follow_frame(
            problem, s, gate, markers[i], known, from_scratch and i == first, q
        )
        row[nq], row[nq + 1] = residual, iterations
        row[nq + 2] = 1.0 if converged else 0.0
        copy(s.passed, row[nq + 3 :])
        _remember(problem, known, s.passed, q, patience)


@inner_borrowing
def follow_frame(
    problem: MarkerProblem,
    s: Scratch,
    gate: MarkerGate,
    markers: Array,
    memory: FrameMemory,
    from_scratch: bool,
    q: Array,
) -> tuple[float, int, bool]:
    """Solve one frame from `memory.start`, and from scratch where that is suspicious.

    Written is the pose `q` (nq,); `s` is left with the errors at that pose, the figures
    of :func:`ikns._kernels.body.marker_gate.gate_figures` and whether each limb passed.
    """
    before = memory.numbers[_BEFORE]
    loose = before == _LATELY
    residual, iterations, converged = solve_frame(
        problem, s, markers, memory.start, from_scratch, loose, q
    )
    gate_figures(s, gate, markers)
    fit = fits(s, gate, residual)
    if not np.isfinite(residual):
        return residual, iterations, converged
    beyond = far_cost(problem, q)
    n_seen = 0
    for m in range(len(s.weight)):
        n_seen += s.weight[m] > 0
    cost = residual**2 + beyond / n_seen
    if from_scratch:
        if fit:
            memory.numbers[_COST] = cost
        return residual, iterations, converged
    # After a long time without a pose to trust, the start is as good as any other.
    better = 1.0 if fit and before == _LONG_AGO else _BETTER
    if _due(memory, fit, beyond, cost) or better == 1.0:
        copy(q, s.kept)
        again = solve_frame(problem, s, markers, memory.start, True, False, q)
        other = again[0] ** 2 + far_cost(problem, q) / n_seen
        if other < better * cost:
            residual, iterations, converged = again
            gate_figures(s, gate, markers)
            fits(s, gate, residual)
            memory.numbers[_WAIT] = 0.0
        else:
            copy(s.kept, q)
            errors_at(problem, s, q)
    return residual, iterations, converged


@borrowing
def _due(memory: FrameMemory, fit: bool, beyond: float, cost: float) -> bool:
    """Whether a pose is suspicious, and its turn has come to be compared."""
    known = memory.numbers
    unusual = cost > _LEAST**2 and cost > _TIMES**2 * known[_COST]
    if fit and not unusual and not beyond > 0:
        if np.isnan(known[_COST]):
            known[_COST] = cost
        known[_COST] += _USUAL * (cost - known[_COST])
        known[_WAIT] = known[_SINCE] = known[_TRIED] = 0.0
        return False
    known[_SINCE] += 1.0
    # What was tried in vain under a ghost is worth another try once that has gone.
    if known[_SINCE] < known[_WAIT] and cost > _BETTER * known[_TRIED]:
        return False
    known[_WAIT] = min(max(1.0, 2.0 * known[_WAIT]), _LONGEST_WAIT)
    known[_SINCE], known[_TRIED] = 0.0, cost
    return True


@borrowing
def _remember(
    problem: MarkerProblem, memory: FrameMemory, passed: Array, q: Array, patience: int
) -> None:
    """Write where the next frame starts, limb by limb."""
    ages = memory.numbers[_AGE:]
    every, recent = True, False
    memory.numbers[_BEFORE] = _JUST_NOW
    for limb in range(len(passed)):
        ages[limb] = 0.0 if passed[limb] > 0 else ages[limb] + 1.0
        every = every and ages[limb] > 0
        recent = recent or ages[limb] <= patience
        if ages[limb] > patience:
            memory.numbers[_BEFORE] = _LONG_AGO
    for limb in range(len(passed)):
        if 0 < ages[limb] <= patience:
            memory.numbers[_BEFORE] = _LATELY
    for i in range(len(q)):
        limb = problem.q_branch[i]
        if limb < 0:
            # The thorax, with which all limbs fit or none.
            back = every and recent
            if not every:
                memory.good[i] = q[i]
        else:
            back = 0 < ages[limb] <= patience
            if ages[limb] == 0:
                memory.good[i] = q[i]
        memory.start[i] = memory.good[i] if back else q[i]
