"""Take the error of intent apart, and say how small it could get.

Real people (`--no-real` leaves them out): how alike do they hold the arm when they come
back? That bounds whatever is learned.

- again: two repeats of one reach, both ends within 3 cm; a natural posture's change
  over it cannot be less than their difference over the root of two, as it is the same
  for both;
- places: two rests within 3 cm of each other, of one task or of two. What knows the
  wrist's place alone cannot tell them apart; their mean difference is the least change
  of c over a reach between two such rests.

Both after a quadratic of the wrist center, which takes care of the 3 cm. Then methods
that know more than the quadratic, leave-one-person-out as in `null_space_bench`.

Virtual people (simulated, :mod:`null_space.virtual_people`): the same c as the
package's, with parts of what it rests on replaced by the truth.
"""

import argparse
import platform
import warnings
from pathlib import Path

import numpy as np
from natural_posture_people import BESIDE
from null_space.floors import floors
from null_space.ladder import Person, scored, shown
from null_space.methods import METHODS
from null_space.people import Arm, real_arms
from null_space.scores import of_people, summary
from null_space_bench import left_out

#: What is seen, what is taken for natural, and whether the ends are true.
LADDER: dict[str, tuple[str, str, bool]] = {
    "as shipped": ("tracked", "tracked", False),
    "nothing remembered of places": ("tracked", "tracked, smooth", False),
    "the wrist alone": ("tracked", "tracked, wrist alone", False),
    "(a) true joint angles": ("true", "true", False),
    "(a) true joint angles, nothing remembered": ("true", "true, smooth", False),
    "(c) true ends": ("tracked", "tracked", True),
    "(d) no scatter from rest to rest in what teaches": ("true", "no scatter", False),
    "(e) no rough field in what teaches": ("true", "no rough field", False),
    "(d, e) neither": ("true", "neither", False),
    "(c, d, e) neither, true ends": ("true", "neither", True),
    "(b) best quadratic of the wrist": ("true", "wrist", False),
    "best quadratic of the wrist, true ends": ("true", "wrist", True),
    "natural posture known, tracked": ("tracked", "wrist and hand", False),
    "natural posture known, true angles and ends": ("true", "wrist and hand", True),
    "all known but the scatter from rest to rest": ("true", "all of it", True),
}


def print_virtual(people: list[Person]) -> None:
    """Print the ladder of virtual people."""
    print(f"\n{len(people)} virtual people (simulated), medians.\n")
    print(
        "| c with | rms (90 %) | gain | offset | median size of it | within 0.03 "
        "| reach | reach again |"
    )
    print("|---" * 8 + "|")
    for words, (seen, natural, ends) in LADDER.items():
        rows = [scored(one, seen, natural, true_ends=ends) for one in people]
        rms, gain, offset, reach, again = (
            np.array([row[key] for row in rows])
            for key in ("rms", "gain", "offset", "reach", "again")
        )
        print(
            f"| {words} | {np.median(rms):.3f} ({np.quantile(rms, 0.9):.3f}) "
            f"| {np.median(gain):.3f} | {np.median(offset):+.3f} "
            f"| {np.median(np.abs(offset)):.3f} "
            f"| {np.mean(np.abs(offset) <= 0.03):.0%} | {np.median(reach):.3f} "
            f"| {np.median(again):.3f} |"
        )


def print_floors(arms: list[Arm]) -> None:
    """Print how alike people come back."""
    print(f"{len(arms)} real arms, in units of the range of 70 deg.\n")
    print("| difference | pairs | mean | > 0.2 |\n|---|---|---|---|")
    for kind, values in floors(arms).items():
        far = (values > 0.2).mean()
        print(f"| {kind} | {len(values)} | {values.mean():.3f} | {far:.1%} |")


def print_methods(arms: list[Arm]) -> None:
    """Print what more knowledge gains."""
    with_hand, without = left_out(arms), left_out(arms, hand=False)
    smooth, places = METHODS["intent, no places"], METHODS["intent"]
    methods = {
        "quadratic of the wrist": (smooth, without),
        "wrist and places": (places, without),
        "wrist and hand": (smooth, with_hand),
        "wrist, hand and places (shipped)": (places, with_hand),
    }
    print(
        "\n| natural posture by | tasks | change | > 0.2 | AUC 20, 10 deg "
        "| turned hand |"
    )
    print("|---|---|---|---|---|---|")
    for words, (method, people) in methods.items():
        for kind in ("same", "unseen"):
            row = summary(of_people(arms, people, method, kind))
            low, high = row["interval"]
            print(
                f"| {words} | {kind} | {row['change']:.3f} ({low:.3f} to {high:.3f}) "
                f"| {row['above_0.2']:.1%} | {row['auc_20']:.3f}, {row['auc_10']:.3f} "
                f"| {row['turned']:.2f} |"
            )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--people", type=int, default=20, help="virtual ones")
    parser.add_argument("--no-real", action="store_true", help="virtual people alone")
    parser.add_argument("--quick", action="store_true", help="one person of each")
    options = parser.parse_args()
    print(
        f"numpy {np.__version__}, Python {platform.python_version()}, seeds from 0.\n"
    )
    if not options.no_real:
        # Methods need other people, and a small run has none.
        few = 1 if options.quick else None
        arms = real_arms(options.data / "ue_adl", people=few)
        print_floors(arms)
        if not options.quick:
            print_methods(arms)
    warnings.simplefilter("ignore")
    print_virtual([shown(k) for k in range(1 if options.quick else options.people)])


if __name__ == "__main__":
    main()
