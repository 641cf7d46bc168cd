"""Uncontrolled manifold: joint variance that does or does not affect a task.

The joint variance over repetitions is split along the null space of the task's Jacobian
(V_UCM) and across it (V_ORT), each per degree of freedom (Scholz and Schoner 1999, Exp
Brain Res 126:289). `split` works on plain arrays, `designs` on motions of a skeleton;
`split_analysis` adds intervals and surrogates to either design.
"""

from ikns.analysis.ucm.designs import across_trials, within_trial
from ikns.analysis.ucm.intervals import confidence_interval, mean_interval
from ikns.analysis.ucm.split import VarianceSplit, delta_vz, variance_split
from ikns.analysis.ucm.split_analysis import (
    SplitAnalysis,
    analyze_points,
    analyze_trials,
)
from ikns.analysis.ucm.surrogates import surrogate_test
from ikns.analysis.ucm.tasks import chain_task, numerical_task
from ikns.analysis.ucm.trials import aligned_angles, movement, normalize_time

__all__ = [
    "SplitAnalysis",
    "VarianceSplit",
    "across_trials",
    "aligned_angles",
    "analyze_points",
    "analyze_trials",
    "chain_task",
    "confidence_interval",
    "delta_vz",
    "mean_interval",
    "movement",
    "normalize_time",
    "numerical_task",
    "surrogate_test",
    "variance_split",
    "within_trial",
]
