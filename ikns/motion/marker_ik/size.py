"""How large a body in the markers is, compared with its calibration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ikns.body.chains import ChainLike
from ikns.body.skeleton import Skeleton
from ikns.motion.marker_ik.visibility import segment_pairs

#: Fewer distances say nothing about a size: one of them may be a ghost's.
_FEWEST = 3
#: Shorter distances are left out, m; marker noise changes them by much.
_SHORTEST = 0.01
#: Of a body of another unit, most ratios are alike; of markers that are anywhere, or
#: named wrongly, they scatter: so much of them must be within so many powers of ten.
_ALIKE, _WITHIN = 2 / 3, 0.18
#: Frames are taken in such steps, to keep their number below this.
_GLANCES = 100


def power_of_ten(
    skeleton: Skeleton, chain: ChainLike, markers: NDArray[np.float64]
) -> int:
    """Return the power of ten by which a body is larger than at calibration.

    That of the median ratio of the distances within segments, over distances and
    frames, so that some markers may be astray. 0 for the right size, and where too few
    distances show one or they disagree; 3 where millimeters were read as meters.

    Parameters
    ----------
    skeleton : Skeleton
    chain : str
        See :class:`ikns.Chain`.
    markers : (T, M, 3) array
        m in the world, in the order of the skeleton's marker set; NaN = not seen.

    Examples
    --------
    >>> body = Skeleton.load()
    >>> markers = body.markers_in_world(body.neutral())[None]
    >>> [power_of_ten(body, "right_arm", k * markers) for k in (1, 2, 1000, 0.1)]
    [0, 0, 3, -1]
    """
    pairs, worn = segment_pairs(skeleton, chain)
    pairs, worn = pairs[worn >= _SHORTEST], worn[worn >= _SHORTEST]
    step = max(1, len(markers) // _GLANCES)
    first, second = np.moveaxis(markers[::step][:, pairs], 2, 0)
    with np.errstate(invalid="ignore"):  # infinite positions
        ratio = np.linalg.norm(first - second, axis=2) / worn
    shown = np.isfinite(ratio) & (ratio > 0)
    ratio = ratio[shown.sum(axis=1) >= _FEWEST]
    shown = np.isfinite(ratio) & (ratio > 0)
    if not shown.any():
        return 0
    powers = np.log10(ratio[shown])
    middle = float(np.median(powers))
    alike = np.mean(np.abs(powers - middle) < _WITHIN) >= _ALIKE
    return round(middle) if alike else 0


def say_size(power: int) -> str:
    """Say that a body is so much larger or smaller than at calibration.

    >>> print(say_size(3))
    the body is 1000 times as large as at calibration
    """
    return f"the body is {10.0**power:g} times as large as at calibration"
