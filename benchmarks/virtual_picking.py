"""Do virtual participants keep hold of things through the whole chain? Two tables.

Everything here is simulated. Participants are drawn (bodies from ANSUR II, abilities
from `ikns/simulation/operator/parameters.toml`, habits from
`ikns/simulation/grasp/habits.toml`) and calibrated as in the paper. They pick and place
the objects of its table in the order of `pick_schedule`, with practice from ten picks
of training that are counted and not simulated. Contact physics by MuJoCo decides what
is held, slips or falls; its constants: `ikns/simulation/grasp/contact.toml`.

- ikns: what the person wants -> limb -> elbow swivel while the hand travels -> markers
  (noise, skin, gaps) -> IK -> map -> controller -> finger, 50 ms later.
- ring: a button, pressed a reaction after the person wants it, 2 per second, 50 ms.

The second table is about crosstalk, the change of c that carrying makes. `drift`: with
the elbow held where it just closed the finger, by the map alone. `margin`: the least
that the finger was told, on the way, beyond where the object stops it.

- finger: the person goes by the finger; once it presses, nothing tells where c is.
- signal: c on a screen, held 0.3 (+- 0.1 between people) beyond the contact.
- held while fast: as finger, and the controller keeps what it asks for while the hand
  is faster than 0.2 m/s.
- planted: as finger, and c falls by so much more on the way from object to goal.
"""

import argparse
import json
import os
import platform
import re
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np

from ikns.experiments.picking import OBJECT_IDS, load_objects, pick_schedule
from ikns.experiments.picking.virtual import VIRTUAL_CONDITIONS, virtual_pick_step
from ikns.live.control.settings import ControlSettings
from ikns.simulation.operator import draw_participant

#: Time of the successes, mean and standard deviation, s; successes of 100, as printed.
PAPER = {"ikns": (8.94, 3.26, 88), "ring": (6.34, 0.71, 100)}
PLANTED = (0.2, 0.4, 0.6)
WAYS = {
    "finger": {},
    "signal": {"feedback": "signal"},
    "held while fast": {"settings": ControlSettings(hold_speed=0.2)},
    **{f"planted {fall:g}": {"crosstalk": fall} for fall in PLANTED},
}


def of_participant(number: int, *, seed: int, rate: float, objects: list[str]) -> dict:
    """All picks of one participant, by way, and what they took."""
    began = time.process_time()
    person = draw_participant(number, seed=seed, rate=rate)
    setup = time.process_time() - began
    rows: dict[str, list[dict]] = {way: [] for way in (*WAYS, "ring")}
    spent: dict[str, list[float]] = {way: [] for way in rows}
    done = dict.fromkeys(VIRTUAL_CONDITIONS, 0)
    for step in pick_schedule(number, objects=objects, seed=seed):
        if step.kind == "rest":
            continue
        before = done[step.condition]
        done[step.condition] += 1
        if step.kind == "training":
            continue
        ways = WAYS if step.condition == "ikns" else {"ring": {}}
        for way, more in ways.items():
            began = time.process_time()
            row = virtual_pick_step(person, step, practised=before, rate=rate, **more)
            spent[way].append(time.process_time() - began)
            rows[way].append(row)
    return {"rows": rows, "cpu_s": spent, "setup_s": setup, "redrawn": person.redrawn}


def gather(people: list[dict], way: str, code: str | None = None) -> dict:
    """Sum up all picks of a way (and an object)."""
    rows = [
        row
        for person in people
        for row in person["rows"][way]
        if code in (None, row["object"])
    ]
    good = [row["time"] for row in rows if row["outcome"] == "success"]

    def middle(name: str) -> float:
        values = [row[name] for row in rows if not np.isnan(row[name])]
        return float(np.mean(values)) if values else float("nan")

    margins = [row["c_margin"] for row in rows if not np.isnan(row["c_margin"])]
    return {
        "picks": len(rows),
        "successes": len(good),
        "time": float(np.mean(good)) if good else None,
        "time_sd": float(np.std(good, ddof=1)) if len(good) > 1 else None,
        "why": [re.sub(r" \d+ cm", "", row["why"]) for row in rows if row["why"]],
        "grip_N": middle("peak_grip_N"),
        "slip_mm": 1e3 * middle("slip_m"),
        "held": middle("hold_share"),
        "contact_c": middle("contact_c"),
        "drift": float(np.nanmean([abs(row["c_drift"]) for row in rows])),
        "drift_most": float(np.nanmax([abs(row["c_drift"]) for row in rows])),
        "margin": float(np.mean(margins)) if margins else None,
        "margin_least": float(np.min(margins)) if margins else None,
    }


def told(cell: dict) -> str:
    """Successes and their time."""
    if cell["time"] is None:
        return f"{cell['successes']} of {cell['picks']}, -"
    spread = "" if cell["time_sd"] is None else f" +- {cell['time_sd']:.2f}"
    return f"{cell['successes']} of {cell['picks']}, {cell['time']:.2f}{spread} s"


def show(people: list[dict], objects: list[str]) -> dict:
    """Print both tables; return their numbers."""
    table: dict = {"objects": {}, "ways": {}}
    known = load_objects()
    print(
        "| object (simulated) | g | gripped mm | ikns: success, time | ring "
        "| stops the finger at c | slip mm, ikns |"
    )
    print("|---" * 7 + "|")
    for code in objects:
        thing = known[code]
        one, ring = (gather(people, way, code) for way in ("finger", "ring"))
        table["objects"][code] = {"ikns": one, "ring": ring}
        width = min(thing.size_m[:2]) if thing.shape == "box" else thing.size_m[0]
        print(
            f"| {code} {thing.name} | {1e3 * thing.mass_kg:.0f} | {1e3 * width:.0f} "
            f"| {told(one)} | {told(ring)} | {one['contact_c']:.2f} "
            f"| {one['slip_mm']:.1f} |"
        )
    both = {"ikns": gather(people, "finger"), "ring": gather(people, "ring")}
    print(f"| all | | | {told(both['ikns'])} | {told(both['ring'])} | | |")
    paper = {
        name: f"{good} of 100, {mean:.2f} +- {sd:.2f} s"
        for name, (mean, sd, good) in PAPER.items()
    }
    print(f"| the paper's people | | | {paper['ikns']} | {paper['ring']} | | |")
    print(
        "\n| ikns, the person goes by (simulated) | success, time | drift of c, mean "
        "(most) | margin of c, mean (least) | held | grip N |"
    )
    print("|---" * 6 + "|")
    for way in WAYS:
        cell = table["ways"][way] = gather(people, way)
        print(
            f"| {way} | {told(cell)} | {cell['drift']:.3f} ({cell['drift_most']:.3f}) "
            f"| {cell['margin'] or np.nan:.2f} ({cell['margin_least'] or np.nan:.2f}) "
            f"| {cell['held']:.1%} | {cell['grip_N']:.1f} |"
        )
    return table


def conclude(table: dict, people: list[dict]) -> str:
    """Say in words what the numbers say, and what they cannot."""
    ikns = table["ways"]["finger"]
    pick = {
        way: float(np.mean([s for p in people for s in p["cpu_s"][way]]))
        for way in ("finger", "ring")
    }
    faults = Counter(why for cell in table["ways"].values() for why in cell["why"])
    reasons = [f"{why} ({n} times)" for why, n in faults.most_common()]
    return "\n".join(
        [
            f"Carried over the table with the elbow held, c strays by "
            f"{ikns['drift']:.3f} on average and {ikns['drift_most']:.3f} at most. A "
            f"person who closes until the finger presses has {ikns['margin']:.2f} of c "
            f"to spare on average and {ikns['margin_least']:.2f} at least. With "
            + " ".join(
                f"{fall:g} of crosstalk planted {cell['successes']} of "
                f"{cell['picks']} are placed,"
                for fall in PLANTED
                for cell in [table["ways"][f"planted {fall:g}"]]
            )[:-1]
            + ".",
            "What went wrong, all ways together: "
            + ("; ".join(reasons) if reasons else "nothing")
            + ".",
            "Friction, the finger's springs and effort, where people put the hand, how "
            "they decide, how long they look, and how far they aim beyond the contact "
            "are free and mostly assumed; none was fitted to the paper's times or "
            "successes, and none should be read from them. The hand of these people "
            "comes to the right place, they never hesitate, look away or forget, and "
            "the elbow is all they have to mind: so this says what contact and "
            "crosstalk do by themselves, not how well people do.",
            f"A pick takes {pick['finger']:.2f} s of one core through the whole chain "
            f"and {pick['ring']:.2f} s with the ring, a participant with calibration "
            f"{np.mean([p['setup_s'] for p in people]):.1f} s.",
        ]
    )


def main() -> None:
    """Print the tables and what they say."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--participants", type=int, default=10)
    parser.add_argument("--rate", type=float, default=100.0, help="frames per second")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--quick", action="store_true", help="one person, A and I")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    n, rate, objects = options.participants, options.rate, list(OBJECT_IDS)
    if options.quick:
        n, rate, objects = 1, 50.0, ["A", "I"]
    import mujoco

    about = {
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "mujoco": mujoco.__version__,
        "participants": n,
        "rate_hz": rate,
        "seed": options.seed,
    }
    work = partial(of_participant, seed=options.seed, rate=rate, objects=objects)
    people = []
    with ProcessPoolExecutor(options.jobs) as pool:
        doing = pool.map(work, range(n)) if options.jobs > 1 else map(work, range(n))
        for k, person in enumerate(doing):
            people.append(person)
            print(f"participant {k + 1} of {n}", file=sys.stderr)
    if options.json:
        print(json.dumps({"about": about, "paper": PAPER, "people": people}))
        return
    print("All participants are simulated; the paper's were people.")
    print(", ".join(f"{key} {value}" for key, value in about.items()) + "\n")
    table = show(people, objects)
    print("\n" + conclude(table, people))


if __name__ == "__main__":
    main()
