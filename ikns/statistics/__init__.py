"""Statistics of the two experiments: the paper's tests, and more appropriate ones.

`analysis` runs everything on a table of trials. Each test has a small frozen result
with a ``sentence()`` in plain words, which never takes a difference that was not found
for equality. `pairs` prepares the data of paired tests; `paired_tests` repeats those of
the paper; `equivalence`, `effects`, `mixed_model`, `within_subject_anova`, `success`,
`times` and `learning` add to them; `power` and `plan` determine the number of
participants. Computed by scipy and statsmodels.
"""

from ikns.statistics.analysis import (
    PickAnalysis,
    TrackingAnalysis,
    analyze_picking,
    analyze_tracking,
)
from ikns.statistics.effects import (
    Effect,
    cohens_dz,
    effect_sizes,
    hedges_g_av,
    hodges_lehmann,
)
from ikns.statistics.equivalence import Equivalence, equivalence
from ikns.statistics.learning import LearningCurves, learning_curves
from ikns.statistics.mixed_model import mixed_model
from ikns.statistics.paired_tests import (
    PairedT,
    exact_sign,
    normality,
    pooled_t,
    signed_rank,
    subject_means_t,
)
from ikns.statistics.pairs import Pairs, pair_arrays, pair_trials
from ikns.statistics.plan import sample_size
from ikns.statistics.power import Design, Spread, simulated_power
from ikns.statistics.success import SuccessTest, success_pairs, success_test
from ikns.statistics.times import restricted_mean, time_test
from ikns.statistics.within_subject_anova import within_subject_anova

__all__ = [
    "Design",
    "Effect",
    "Equivalence",
    "LearningCurves",
    "PairedT",
    "Pairs",
    "PickAnalysis",
    "Spread",
    "SuccessTest",
    "TrackingAnalysis",
    "analyze_picking",
    "analyze_tracking",
    "cohens_dz",
    "effect_sizes",
    "equivalence",
    "exact_sign",
    "hedges_g_av",
    "hodges_lehmann",
    "learning_curves",
    "mixed_model",
    "normality",
    "pair_arrays",
    "pair_trials",
    "pooled_t",
    "restricted_mean",
    "sample_size",
    "signed_rank",
    "simulated_power",
    "subject_means_t",
    "success_pairs",
    "success_test",
    "time_test",
    "within_subject_anova",
]
