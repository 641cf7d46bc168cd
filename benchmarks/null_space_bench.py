"""Does c say what the person means? Real reaches, and wishes planted into them.

People of UE_ADL who mean nothing by their elbows reach, drink and comb; each is judged
with other people's natural posture from which this person is left out, and 20 s of
ordinary movement of their own.

- same tasks: one repeat of every task is judged, the others are one's own movement;
- unseen task: one task is judged, the other three are one's own movement;
- change: mean change of c over a reach (from rest to rest, 0.10 m or more), in units of
  the explored range of 70 deg; in brackets 95 % of a bootstrap over people;
- AUC: chance that a wish of 20 or 10 deg of swivel at a held hand (with 4 mm of drift
  and 1.2 deg of tilt) moves c by more than a reach does. Wishes are simulated;
- turned hand: change of c when the forearm pronates from -29 to +29 deg.

Nobody swivelled on purpose there: paper and proximal explore the self-motion in closed
form at ten places that the hand visited in one's own movement.

Virtual people of another making (:mod:`null_space.virtual_people`) mean a known c:
markers are recorded, the package calibrates, and c is compared with what was meant.

Entrants other than the shipped ones are named as ``--method module:Class``; what they
are told, and what they answer, is in :mod:`null_space.entrants`.
"""

import argparse
import json
import platform
from pathlib import Path

import numpy as np
from natural_posture_people import moving, own_fit
from null_space.entered import entered
from null_space.entrants import PACKAGE, SHIPPED, entrant
from null_space.methods import METHODS
from null_space.people import Arm, real_arms
from null_space.scores import of_people, summary
from null_space.virtual_table import (
    figure,
    print_virtual,
    virtual_people,
    virtual_verdicts,
)

from ikns.nullspace.posture_terms import wrist_of

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
#: What was asked of intent: at most this change, and at least these AUCs.
GOALS = {
    ("intent", "same"): {
        "change": 0.055,
        "above_0.2": 0.02,
        "auc_20": 0.99,
        "auc_10": 0.93,
    },
    ("intent", "unseen"): {"change": 0.10, "auc_20": 0.96},
    ("people alone", "same"): {"change": 0.10},
}
#: Of those that learn nothing of one's own, the split means nothing.
REAL_ONLY = tuple(name for name in METHODS if name not in PACKAGE)
UNLEARNED = ("swivel about down", "hinge swivel", "people alone")


def left_out(arms: list[Arm], *, hand: bool = True) -> dict[str, np.ndarray]:
    """Mean coefficients of all other people, by person; without `hand` of the wrist."""
    found = [moving(arm) for arm in arms]
    means = {}
    for person in {arm.person for arm in arms}:
        others = [
            moved
            for arm, moved in zip(arms, found, strict=True)
            if arm.person != person
        ]
        means[person] = np.mean(
            [own_fit(x if hand else wrist_of(x), s) for x, s in others], axis=0
        )
    return means


def verdicts(table: dict[tuple[str, str], dict]) -> list[str]:
    """One sentence a goal."""
    lines = []
    for (method, kind), goals in GOALS.items():
        if (method, kind) not in table:
            continue
        for name, goal in goals.items():
            value = table[method, kind][name]
            ok = value >= goal if name.startswith("auc") else value <= goal
            word = "reached" if ok else "NOT REACHED"
            lines.append(f"{method}, {kind}: {name} {value:.3f}, asked {goal}: {word}")
    return lines


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--quick", action="store_true", help="two people, no maps")
    parser.add_argument(
        "--method", action="append", metavar="NAME", help="shipped, or module:Class"
    )
    parser.add_argument("--virtual", type=int, default=20, help="virtual people")
    parser.add_argument("--no-real", action="store_true", help="virtual people alone")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--figure", type=Path, help="picture to write")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    for name in options.method or []:
        if name not in METHODS:
            entrant(name)
    entrants = ["intent", "swivel"] if options.quick else [*PACKAGE, *SHIPPED]
    virtual = virtual_people(
        1 if options.quick else options.virtual,
        [m for m in options.method or entrants if m not in REAL_ONLY],
        jobs=1 if options.quick else options.jobs,
    )
    table = {} if options.no_real else real_people(options)
    if options.json:
        rows = {f"{m}, {k}": row for (m, k), row in table.items()}
        known = {
            name: {k: None if np.isnan(v) else v for k, v in row.items()}
            for name, row in virtual.items()
        }
        print(json.dumps(rows | {"virtual, simulated": known}, indent=1))
    else:
        if table:
            print_real(table, quick=options.quick)
        print_virtual(virtual)
        if not options.quick:
            print("\n" + "\n".join(virtual_verdicts(virtual)))
    if options.figure:
        figure(table, virtual, options.figure)


def real_people(options: argparse.Namespace) -> dict[tuple[str, str], dict]:
    """Scores of all methods on the people of UE_ADL."""
    arms = real_arms(options.data / "ue_adl", people=2 if options.quick else None)
    people = left_out(arms)
    # The hinge swivel alone is in both lists under its own name.
    chosen = options.method or [
        name
        for name in [*METHODS, *(n for n in SHIPPED if n != "swivel")]
        if not (
            options.quick and name not in ("hinge swivel", "people alone", "intent")
        )
    ]
    return {
        (name, kind): summary(of_people(arms, people, entered(name), kind))
        for name in chosen
        for kind in (("same",) if name in UNLEARNED else ("same", "unseen"))
    }


def print_real(table: dict[tuple[str, str], dict], *, quick: bool) -> None:
    """Print the table of real people."""
    print(
        f"{len(next(iter(table.values()))['people'])} real people, both arms; wishes "
        f"are simulated. numpy {np.__version__}, Python {platform.python_version()}, "
        "seeds from 0.\n"
    )
    print(
        "| method | own movement | reaches | change | > 0.2 | AUC 20 deg | AUC 10 deg "
        "| turned hand |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for (name, kind), row in table.items():
        low, high = row["interval"]
        words = {"same": "same tasks", "unseen": "other tasks"}[kind]
        print(
            f"| {name} | {'-' if name in UNLEARNED else words} | {row['reaches']} "
            f"| {row['change']:.3f} ({low:.3f} to {high:.3f}) "
            f"| {row['above_0.2']:.1%} | {row['auc_20']:.3f} | {row['auc_10']:.3f} "
            f"| {row['turned']:.2f} |"
        )
    if quick:
        print("\nOther people are one person here: goals are for all of them.")
    else:
        print("\n" + "\n".join(verdicts(table)))


if __name__ == "__main__":
    main()
