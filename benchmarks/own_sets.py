"""Does a set that `ikns markers new --guess` makes follow people? One table.

Seven people of UE_ADL, a set from each one's static trial; the first repeat of four
tasks on either side. `fixed` has the clusters on the forearms fixed to the bone and
all weights 1; `made` lets them turn with the skin, and gives the clusters on the hands
ten times the weight, as `markers new` does; `shipped` is `ue_adl`.

- Residual: the median residual that `ikns ik` prints, mm.
- Hand: angle between the tracked hand and a rigid fit of its own four markers, both
  counted from the static trial, in the median frame, deg.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from forearm_skin import PEOPLE, hand_off
from real_people import BESIDE

from ikns.body.marker_set import MarkerSet
from ikns.body.sites import guess_sites
from ikns.body.skeleton import Skeleton
from ikns.calibration.own_markers import own_marker_set
from ikns.calibration.scaling import scale
from ikns.motion.marker_ik import MarkerIK
from ikns.recording.files import read
from ikns.recording.recording import Recording

SETS = ("fixed", "made", "shipped")
#: The shortest static trial lasts 0.2 s.
SHORTEST = 0.15


def bodies(static: Recording) -> Iterator[Skeleton]:
    """Yield the body of a person with each set."""
    made = own_marker_set(
        Skeleton.load(),
        static,
        guess_sites(static.labels),
        name="made",
        min_duration=SHORTEST,
    ).marker_set
    fixed = [replace(m, free_turn=False, weight=1.0) for m in made.markers]
    for worn in (
        replace(made, markers=tuple(fixed)),
        made,
        MarkerSet.load("ue_adl"),
    ):
        yield scale(Skeleton.load(), static, marker_set=worn, min_duration=SHORTEST)[0]


def person(folder: Path, tasks: str) -> list[dict[str, object]]:
    """Figures of a person, a row a set and trial."""
    static = read(folder / f"{folder.name}_static.csv")
    rows: list[dict[str, object]] = []
    for name, body in zip(SETS, bodies(static), strict=True):
        for task in tasks:
            for side in ("right", "left"):
                path = folder / f"{folder.name}{task}{side[0].upper()}1.csv"
                recording = read(path)
                motion = MarkerIK(body).track(recording)
                seen = body.marker_set.pick(recording.labels, recording.markers)
                off = hand_off(body, static, motion, seen, side)
                rows.append(
                    {
                        "person": folder.name,
                        "set": name,
                        "trial": path.stem,
                        "residual_mm": 1000 * float(np.nanmedian(motion.residual)),
                        "hand_off_deg": float(np.median(off)),
                    }
                )
    return rows


def main() -> None:
    """Print the table by person: each figure from the best to the worst trial."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--quick", action="store_true", help="one person, two trials")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rows = []
    for name in PEOPLE[:1] if options.quick else PEOPLE:
        tasks = "F" if options.quick else "FADC"
        rows += person(options.data / "ue_adl" / name, tasks)
    if options.json:
        print(json.dumps(rows))
        return
    heads = [f"{kind}, {name}" for kind in ("residual mm", "hand deg") for name in SETS]
    print(f"| person | {' | '.join(heads)} |\n|---|{'---|' * len(heads)}")
    for name in dict.fromkeys(row["person"] for row in rows):
        cells = []
        for figure in ("residual_mm", "hand_off_deg"):
            for worn in SETS:
                own = [
                    row[figure]
                    for row in rows
                    if (row["person"], row["set"]) == (name, worn)
                ]
                cells.append(f"{min(own):.1f} to {max(own):.1f}")
        print(f"| {name} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
