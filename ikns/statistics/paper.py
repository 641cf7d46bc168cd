"""What the paper prints of its experiments (T. Lisini Baldi et al., arXiv 2012.03600).

Only what a plan or a report needs, as text where the last digit says how far a number
was rounded. `benchmarks/paper_statistics.py` examines all that is printed.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import stats

SUBJECTS = 10
TRAJECTORIES = ("T1", "T2", "T3")
#: Of a control signal of 0 to 100, for each trajectory: mean and standard deviation.
RMSE = {
    "ikns": (("3.35", "0.83"), ("5.43", "0.92"), ("4.50", "1.54")),
    "gamepad": (("4.13", "0.76"), ("4.98", "1.33"), ("4.15", "1.10")),
}
#: Of the paired t-test over all subjects and trajectories, counted alike.
POOLED_P = "0.979"
#: Of pick and place, s: mean and standard deviation.
TIME = {"ikns": ("8.94", "3.26"), "ring": ("6.34", "0.71")}


def subject_spread_limit() -> float:
    """Largest standard deviation of the subjects' mean differences of RMSE.

    The p-value and the mean difference give the sum of squares of all differences,
    subjects times trajectories. What the trajectories' means do not take of it belongs
    to the subjects at most.

    >>> round(subject_spread_limit(), 4)
    1.2984
    """
    n, k = SUBJECTS, len(TRAJECTORIES)
    d = np.array(
        [
            float(a) - float(b)
            for (a, _), (b, _) in zip(RMSE["ikns"], RMSE["gamepad"], strict=True)
        ]
    )
    degrees = n * k - 1
    error = abs(float(d.mean())) / float(stats.t.isf(float(POOLED_P) / 2, degrees))
    total = degrees * error**2 * (degrees + 1)
    between = n * float(np.sum(np.abs(d - d.mean()) ** 2))
    return math.sqrt((total - between) / (k * (n - 1)))
