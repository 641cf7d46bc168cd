"""The table and the figure of virtual people, and whether goals are reached."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import repeat
from pathlib import Path

import numpy as np

from null_space.virtual_scores import SECONDS, gathered, of_person

#: What was asked of intent on virtual people: score, sentence, limit, and whether it is
#: one from above.
GOALS = (
    ("rms", "rms at unseen places, median", 0.035, True),
    ("rms_p90", "rms at unseen places, 90 %", 0.06, True),
    ("gain_in", "people with a gain of 0.97 to 1.03", 0.9, False),
    ("offset_in", "people with an offset of at most 0.03", 0.9, False),
    ("forearm", "turned forearm", 0.05, True),
    ("wrist", "turned wrist", 0.05, True),
    ("forearm_median", "two forearm markers hidden", 0.05, True),
    ("hand_median", "RFIN hidden, change of c", 0.02, True),
    ("hand_lost", "RFIN hidden, share of these frames lost", 0.01, True),
    ("shoulder_median", "RSHO hidden, change of c", 0.02, True),
    ("shoulder_lost", "RSHO hidden, share of these frames lost", 0.01, True),
)
COLUMNS = {
    "rms": "{rms:.3f} ({rms_p90:.3f})",
    "gain": "{gain:.3f} ({gain_in:.0%})",
    "offset": "{offset:.3f} ({offset_in:.0%})",
    "reach": "{reach:.3f}",
    "forearm, wrist turned": "{forearm:.2f}, {wrist:.2f}",
    "forearm hidden": "{forearm_median:.3f} ({forearm_max:.2f}), {forearm_lost:.0%}",
    "RFIN hidden": "{hand_median:.3f}, {hand_lost:.0%}",
    "RSHO hidden": "{shoulder_median:.3f}, {shoulder_lost:.0%}",
}


def virtual_people(
    n: int, names: list[str], *, jobs: int
) -> dict[str, dict[str, float]]:
    """Scores over n people by entrant; empty without any."""
    if not n or not names:
        return {}
    score = partial(of_person, names=names)
    if jobs == 1:
        return gathered([score(seed) for seed in range(n)])
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context) as pool:
        return gathered(list(pool.map(of_person, range(n), repeat(names))))


def print_virtual(table: dict[str, dict[str, float]]) -> None:
    """Print the table, the curve of learning, and what a frame takes."""
    print("\nVirtual people of another making (simulated); medians over people.\n")
    print("| method | " + " | ".join(COLUMNS) + " |")
    print("|---" * (len(COLUMNS) + 1) + "|")
    for name, row in table.items():
        cells = [form.format(**row) for form in COLUMNS.values()]
        print(f"| {name} | " + " | ".join(cells) + " |")
    if "intent" in table:
        row = table["intent"]
        print("\nintent, by seconds of ordinary movement: " + "; ".join(
            f"{s} s rms {row[f'rms_{s}']:.3f}, reach {row[f'reach_{s}']:.3f}"
            for s in sorted(SECONDS)))  # fmt: skip
    timed = {name: row["us"] for name, row in table.items() if "us" in row}
    if timed:
        each = ", ".join(f"{name} {us:.0f} us" for name, us in timed.items())
        print(f"\nA live frame (the one thing that differs between runs): {each}")


def virtual_verdicts(table: dict[str, dict[str, float]]) -> list[str]:
    """One sentence a goal of intent."""
    if "intent" not in table:
        return []
    lines = []
    for key, words, goal, at_most in GOALS:
        value = table["intent"][key]
        reached = value <= goal if at_most else value >= goal
        word = "reached" if reached else "NOT REACHED"
        if np.isnan(value):
            word = "held, there is no c to judge"
        lines.append(f"intent, virtual: {words} {value:.3f}, asked {goal}: {word}")
    return lines


def figure(
    real: dict[tuple[str, str], dict], virtual: dict[str, dict[str, float]], path: Path
) -> None:
    """Draw the change of c on real reaches, and its error on virtual people."""
    from matplotlib.figure import Figure

    made = Figure(figsize=(9, 4), layout="constrained")
    left, right = made.subplots(1, 2)
    names = [name for name, kind in real if kind == "same"]
    for kind, shift in (("same", -0.2), ("unseen", 0.2)):
        rows = [(i, real[n, kind]) for i, n in enumerate(names) if (n, kind) in real]
        at = np.array([i for i, _ in rows]) + shift
        left.barh(at, [row["change"] for _, row in rows], 0.4, label=f"{kind} tasks")
    left.set_yticks(range(len(names)), names)
    left.set_xlabel("change of c a real reach")
    if names:
        left.legend()
    middle = [row["rms"] for row in virtual.values()]
    high = [row["rms_p90"] - row["rms"] for row in virtual.values()]
    right.barh(range(len(virtual)), middle, xerr=[np.zeros(len(high)), high])
    right.set_yticks(range(len(virtual)), list(virtual))
    right.set_xlabel("rms of c at unseen places, simulated people (line: 90 %)")
    for axes in (left, right):
        axes.invert_yaxis()
    made.savefig(path, dpi=150)
