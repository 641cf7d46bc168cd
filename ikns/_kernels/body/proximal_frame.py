"""The signal of the method proximal for a frame that was just solved.

A file of its own, and a second call after that of the frame: it is compiled when a map
of proximal is loaded, and other methods do not wait for it.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.body.marker_problem import cut, unpack
from ikns._kernels.body.proximal_signal import ProximalNumbers, proximal_signal
from ikns._kernels.body.uncertainty import Segments, deviation, factor_information
from ikns._kernels.compiled import borrowing
from ikns.arrays import Array, Indices


@borrowing
def proximal_frame(
    whole: Indices,
    real: Array,
    segments: Segments,
    numbers: ProximalNumbers,
    seen_before: Array,
    q: Array,
    work: Array,
    place: Array,
    c: Array,
    deviations: Array,
) -> bool:
    """Write the signal c and its standard deviation, (1,) each.

    After :func:`ikns._kernels.body.control_frame.control_frame`, or `recorded_signals`
    of one frame, with the same arguments: `work` has the errors at the pose `q`. The
    segments come by themselves, as what they are packed with takes longer to compile
    than all else here. Both are NaN without a marker; returned is whether the `place`
    (3,), m, is among the points.
    """
    problem = unpack(whole, real)
    s = cut(problem, work)
    c[0] = deviations[0] = np.nan
    posed = hidden = False
    for m in range(len(seen_before)):
        if s.weight[m] > 0:
            posed = True
        elif segments.of_marker[m] >= 0 and problem.marker_weight[m] > 0:
            hidden = True
    if not posed:
        return False
    solvable = factor_information(problem, s, q, segments, seen_before)
    for a in range(6):
        s.gradient[a] = 0.0
    c[0], inside = proximal_signal(numbers, q[7:], place, s.gradient[6:])
    if solvable and np.isfinite(c[0]):
        deviations[0], _ = deviation(
            problem, s, s.gradient, segments, seen_before, hidden, False
        )
    return inside
