"""What the paper's numbers say, and whether the tests keep their word.

Two tables. The first examines the paper's printed figures again; nothing is simulated.
The second simulates studies of the paper's size (10 subjects x 3 trajectories x 3
repeats x 2 conditions) in which the truth is known, and counts how often each test
finds a difference that is not there, shows an equivalence that does not hold, or has an
interval that misses. Without a person's own preference for a condition, all counts of
trials are independent; with it, only persons are. Shares come with their exact 95 %
interval (Clopper and Pearson 1934); what should come out was written down before.
"""

import argparse
import os
import platform
import time

import numpy as np
import scipy
from paper.reexamined import paper_reexamined
from scipy.stats import binomtest

from ikns.statistics import (
    Pairs,
    Spread,
    cohens_dz,
    equivalence,
    hedges_g_av,
    hodges_lehmann,
    mixed_model,
    pair_trials,
    pooled_t,
    sample_size,
    signed_rank,
    subject_means_t,
    within_subject_anova,
)
from ikns.statistics.paper import subject_spread_limit

SUBJECTS, TRAJECTORIES, REPEATS = 10, ("T1", "T2", "T3"), 3
SKILL, TRIAL = 0.8, 0.9  # standard deviations of RMSE, as the paper's are about 1
TASTES = (0.0, 0.7)  # of a person's own difference between the conditions
MARGIN = 0.5


def study(
    rng: np.random.Generator, taste: float, difference: float
) -> dict[str, list[object]]:
    """Simulate one study: a table of trials."""
    rows: list[tuple[object, ...]] = []
    for who in range(SUBJECTS):
        skill, own = rng.normal(0, SKILL), rng.normal(difference, taste)
        for sign, name in ((0.5, "IKNS"), (-0.5, "gamepad")):
            for k, place in enumerate(TRAJECTORIES):
                rows += [
                    (who, name, place, 4 + k + skill + sign * own + e)
                    for e in rng.normal(0, TRIAL, REPEATS)
                ]
    names = ("subject", "condition", "trajectory", "rmse")
    return dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))


def decisions(pairs: Pairs, truth: float = 0.0) -> dict[str, bool]:
    """Ask each quick test."""
    anova = {name: p for name, _, _, p in within_subject_anova(pairs).effects}
    found = {
        "paired t, pooled as the paper did": pooled_t(pairs).p < 0.05,
        "paired t, subject means": subject_means_t(pairs).p < 0.05,
        "Wilcoxon, subject means": signed_rank(pairs.subject_means()).p < 0.05,
        "analysis of variance, condition": anova["condition"] < 0.05,
        "analysis of variance, interaction": anova["condition x level"] < 0.05,
    }
    for effect in (
        hodges_lehmann(pairs),
        cohens_dz(pairs),
        hedges_g_av(pairs, resamples=999),
    ):
        found[f"interval of {effect.name} misses"] = (
            not effect.low <= truth <= effect.high
        )
    return found


def share(label: str, hits: list[bool], expected: str) -> str:
    """One row of the table."""
    test = binomtest(sum(hits), len(hits))
    interval = test.proportion_ci(method="exact")
    return (
        f"| {label} | {100 * test.statistic:.1f} | {100 * interval.low:.1f} to "
        f"{100 * interval.high:.1f} | {expected} | {len(hits)} |"
    )


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--studies", type=int, default=2000)
    parser.add_argument("--mixed", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    studies, mixed = (20, 3) if options.quick else (options.studies, options.mixed)
    start = time.perf_counter()
    print(
        "| the paper prints | verdict | what its numbers imply |\n| --- | --- | --- |"
    )
    for finding in paper_reexamined():
        print(f"| {finding.claim} | {finding.verdict} | {finding.implies} |")
    print(
        f"\nSimulated studies, seed {options.seed}: {SUBJECTS} subjects, "
        f"{len(TRAJECTORIES)} trajectories, {REPEATS} repeats, two conditions; "
        f"standard deviations {SKILL} of subjects, {TRIAL} of trials, "
        f"margin {MARGIN}.\n"
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python "
        f"{platform.python_version()}, numpy {np.__version__}, scipy "
        f"{scipy.__version__}.\n\n"
        "| own preference | test | % | 95 % interval | should be | studies |\n"
        "| --- | --- | --- | --- | --- | --- |"
    )
    for taste in TASTES:
        rng = np.random.default_rng([options.seed, int(10 * taste)])
        found: dict[str, list[bool]] = {}
        for _ in range(studies):
            pairs = pair_trials(study(rng, taste, 0.0), "rmse")
            for name, hit in decisions(pairs).items():
                found.setdefault(name, []).append(bool(hit))
            edge = pair_trials(study(rng, taste, MARGIN), "rmse")
            found.setdefault("equivalence at the edge of the margin", []).append(
                equivalence(edge, margin=MARGIN).p < 0.05
            )
        for name, hits in found.items():
            print(f"| {taste} ", end="")
            print(share(name, hits, "at most 5" if "equivalence" in name else "5"))
        for name in ("condition", "interaction"):
            found[name] = []
        simpler = 0
        for _ in range(mixed):
            model = mixed_model(study(rng, taste, 0.0), "rmse")
            simpler += bool(model.message)
            if model.condition is not None:
                found["condition"].append(model.condition.p < 0.05)
                found["interaction"].append(model.interaction_p < 0.05)
        for name in ("condition", "interaction"):
            label = f"mixed model, {name} ({simpler} of {mixed} made simpler)"
            print(f"| {taste} ", end="")
            print(share(label, found[name], "5"))
    print(
        "\nSubjects for a power of 80 %, if differences spread as the paper's p "
        "implies beyond the trajectories' means, all from subject to subject, or all "
        "within a subject:"
    )
    deviation = subject_spread_limit()
    runs = 500 if options.quick else 10_000
    spreads = {
        "subjects": Spread(deviation),
        "within": Spread(0.0, level=deviation),
    }
    for label, spread in spreads.items():
        for margin in (0.5, 1.0):
            size = sample_size(spread, margin=margin, simulations=runs)
            print(f"- {label}: {size.sentence()}")
        size = sample_size(spread, difference=0.5, simulations=runs)
        print(f"- {label}: {size.sentence()}")
    print(f"\n{time.perf_counter() - start:.0f} s.")


if __name__ == "__main__":
    main()
