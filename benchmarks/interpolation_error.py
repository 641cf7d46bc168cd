"""Which interpolation, how many points, which gate? Five tables.

For each question a table, a figure (``--figures DIR``) and a conclusion that is
worded by the numbers of the run. Everything is simulated: virtual subjects whose
self-motion comes from their own Jacobian. What is true at a place is the null space of
the true body's Jacobian, averaged over the postures that the person visits there; no
interpolation has a part in it. Errors: the angle between interpolated and true
direction; the root mean square error of c over the visited postures, in % of the range;
the jump of c across the hull; its largest step on reaches between places in and around
the box.

The first two questions take the true joint angles of an unsteady hand, the others whole
recordings: markers with 1 mm noise, 3 % of them hidden, scaling, marker inverse
kinematics, the map; and a second recording of the same person to test it. "Varied"
habits differ from place to place as people's do; "alike" ones are the same everywhere,
which leaves the error of interpolation alone. "Left out" is what a lab can measure by
itself: each point against the others. Entries are the median person and in brackets the
worst; intervals are bootstrapped over people.
"""

import argparse
import contextlib
import io
import json
import os
import platform
import sys
import time
from pathlib import Path

import numpy as np
import scipy
import sklearn
from interpolation import figures, tables, words
from interpolation.field import one_person
from interpolation.layouts import LAYOUTS, SIZES
from interpolation.recordings import CONDITIONS, PAPER, SWEEPS, record, sweep
from interpolation.truth import person
from threadpoolctl import threadpool_limits

from ikns.errors import InvalidInput

QUESTIONS = {
    "schemes": "Which interpolation?",
    "points": "How many points, and where?",
    "gate": "Which gate on hand speed?",
    "variance": "How much variance?",
    "radius": "Which radius of a cluster?",
    "verdict": "Is the paper's choice good?",
}


def swept(
    seeds: range, *, n_tests: int, seconds: float, few: bool
) -> dict[str, dict[str, dict]]:
    """By question, kind of hand and setting: the numbers of every person."""
    hands = dict(list(CONDITIONS.items())[: 1 if few else None])
    found = {
        what: {hand: {value: [] for value in values} for hand in hands}
        for what, values in SWEEPS.items()
    }
    for seed in seeds:
        for name, hand in hands.items():
            try:
                recorded = record(
                    person(seed), seed, hand, n_tests=n_tests, seconds=seconds
                )
            except InvalidInput as reason:  # an arm without room somewhere
                tell(f"left out, {name} hand of person {seed}: {reason}")
                continue
            usual = sweep(recorded, **PAPER)
            for what, values in SWEEPS.items():
                for value in values:
                    numbers = (
                        usual
                        if value == PAPER[what]
                        else sweep(recorded, **{**PAPER, what: value})
                    )
                    found[what][name][value].append(numbers)
        tell(f"recordings of person {seed}")
    return found


def tell(what: str) -> None:
    """Say on stderr how far it is."""
    print(f"  {what} after {time.process_time():.0f} s", file=sys.stderr, flush=True)


def measured(options: argparse.Namespace) -> dict[str, object]:
    """Run everything."""
    few = options.quick
    seeds = range(options.first, options.first + (2 if few else options.seeds))
    about = {
        "seeds": [seeds[0], seeds[-1]],
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "scikit-learn": sklearn.__version__,
        "machine": platform.machine(),
        "cores": os.cpu_count(),
    }
    people = []
    for seed in seeds:
        try:
            people.append(
                one_person(
                    seed,
                    sizes=(8, 12) if few else SIZES,
                    kinds=list(LAYOUTS)[: 2 if few else None],
                    n_tests=8 if few else 100,
                    n_reaches=2 if few else 20,
                )
            )
        except InvalidInput as reason:  # an arm without room somewhere
            tell(f"left out, person {seed}: {reason}")
        tell(f"places of person {seed}")
    sweeps = swept(
        seeds[:1] if few else seeds,
        n_tests=3 if few else 20,
        seconds=2.0 if few else 5.0,
        few=few,
    )
    about["seconds of one core"] = round(time.process_time())
    return {"about": about, "simulated": True, "people": people, "sweeps": sweeps}


def restored(found: object) -> object:
    """Undo what JSON does to names that are numbers or None."""
    if isinstance(found, list):
        return [restored(one) for one in found]
    if not isinstance(found, dict):
        return found
    return {_name(key): restored(value) for key, value in found.items()}


def _name(key: str) -> str | int | float | None:
    for kind in (int, float):
        with contextlib.suppress(ValueError):
            return kind(key)
    return None if key == "null" else key


def present(result: dict, folder: Path | None) -> dict[str, list[str]]:
    """Print tables and conclusions, draw figures; return the conclusions."""
    about, people, sweeps = (result[key] for key in ("about", "people", "sweeps"))
    said = {
        "schemes": words.about_schemes(people),
        "points": words.about_numbers(people) + words.about_layouts(people),
        **{what: words.about_sweep(what, PAPER[what], sweeps[what]) for what in sweeps},
        "verdict": words.verdict(people, sweeps, PAPER),
    }
    shown = {
        "schemes": tables.schemes_table(people),
        "points": tables.layouts_table(people),
        **{what: tables.sweep_table(what, sweeps[what]) for what in sweeps},
        "verdict": [],
    }
    print("Virtual subjects: everything here is simulated.")
    print(", ".join(f"{key} {value}" for key, value in about.items()))
    print(f"\n{tables.GLOSSARY}")
    for what, question in QUESTIONS.items():
        of = next(iter(sweeps[what].values())) if what in sweeps else {0: people}
        print(f"\n{question} (simulated, {len(next(iter(of.values())))} people)\n")
        if shown[what]:
            print("\n".join(shown[what]) + "\n\nConclusion, worded by these numbers:\n")
        print("\n".join(f"- {line}" for line in said[what]))
    if folder:
        drawn = {
            "schemes": figures.schemes_figure(people),
            "points": figures.layouts_figure(people),
            **{
                what: figures.sweep_figure(what, PAPER[what], sweeps[what])
                for what in sweeps
            },
        }
        print()
        for what, figure in drawn.items():
            print(figures.save(figure, folder, what))
    return said


def main() -> None:
    """Print the tables and draw the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10, help="how many people")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--quick", action="store_true", help="2 people, few places")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--figures", type=Path, help="folder to write figures to")
    parser.add_argument(
        "--again", type=Path, help="do not run, present what --json printed before"
    )
    options = parser.parse_args()
    if options.again:
        result = restored(json.loads(options.again.read_text()))
    else:
        result = measured(options)
    with contextlib.redirect_stdout(io.StringIO() if options.json else sys.stdout):
        said = present(result, options.figures)
    if options.json:
        print(json.dumps(result | {"conclusions": said}, indent=2))


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
