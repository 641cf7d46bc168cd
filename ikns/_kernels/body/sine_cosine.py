"""Sine and cosine of many angles together, without calls of the C library.

Half of what it took to place the joints were two such calls for each. Here nothing
depends on an angle but numbers, so that the processor computes several angles at once.
An angle is reduced by multiples of a quarter turn in two parts, of which the first has
33 bits, and the rest goes through polynomials; these and their constants are fdlibm's
(k_sin.c, k_cos.c and e_rem_pio2.c, Sun Microsystems 1993), which are within one unit in
the last place.
"""

from __future__ import annotations

import numpy as np

from ikns._kernels.compiled import borrowing
from ikns.arrays import Array

#: Up to this angle, rad, the first part times the number of quarters is exact.
_LARGEST = 1e6
_QUARTERS = 2 / np.pi
_QUARTER, _REST = 1.57079632673412561417, 6.07710050650619224932e-11


@borrowing
def sines_cosines(angles: Array, turns: Array) -> None:
    """Write the sines and the cosines of angles (N,), rad, into `turns` (2, N)."""
    sines, cosines = turns[0], turns[1]
    others = 0
    for i in range(len(angles)):
        sines[i], cosines[i] = _sine_cosine(angles[i])
        # NaN is not smaller either.
        others += 0 if abs(angles[i]) < _LARGEST else 1
    if others > 0:
        for i in range(len(angles)):
            if not abs(angles[i]) < _LARGEST:
                sines[i], cosines[i] = np.sin(angles[i]), np.cos(angles[i])


@borrowing
def _sine_cosine(angle: float) -> tuple[float, float]:
    turns = np.floor(angle * _QUARTERS + 0.5)
    x = (angle - turns * _QUARTER) - turns * _REST
    z = x * x
    s = 2.75573137070700676789e-06 + z * (
        -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
    )
    s = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * s)
    s = x + x * z * (-1.66666666666666324348e-01 + z * s)
    c = -2.75573143513906633035e-07 + z * (
        2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
    )
    c = -1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + z * c)
    c = z * z * (4.16666666666666019037e-02 + z * c)
    near = 1.0 - 0.5 * z
    c = near + (((1.0 - near) - 0.5 * z) + c)
    quarter = turns - 4.0 * np.floor(0.25 * turns)
    odd = quarter == 1.0 or quarter == 3.0
    sine, cosine = (c, s) if odd else (s, c)
    sine = -sine if quarter >= 2.0 else sine
    cosine = -cosine if quarter == 1.0 or quarter == 2.0 else cosine
    return sine, cosine
