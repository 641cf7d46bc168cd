"""Does every held place get a PCA point of its own? One row a layout.

Simulated hands: each place is held for 5 s with the drift and tremor of
`ikns.simulation`, minimum-jerk reaches lead from one to the next, and samples slower
than 0.05 m/s count, at 100 Hz. A draw is kept when no two places have most of their
samples in one cluster.

- box: the ten places of the paper's layout, each moved by a normal scatter per axis;
- free: ten places anywhere in half a meter, at least 10 cm apart;
- subsets: 4 to 8 of one person's ten clean places, and as many clusters;
- live guide: where `ikns calibrate --live` sends the hand after a minute of free
  exploration; places that it lays closer than 5 cm are one place to its own judge, and
  are left out.

"box start": Lloyd's iteration from the box alone, as in the paper. "now": as fitted.
"known": the same told which samples are one place. "same": draws that the box start
kept, and whose centers are the same to the last digit.
"""

import argparse
import json
import platform
from collections.abc import Iterator

import numpy as np
from scipy.spatial.distance import cdist

from ikns.live.calibration.targets import TargetPoints
from ikns.live.calibration.verdict import ONE_PLACE
from ikns.nullspace.clustering import BoundingBoxKMeans, box_surface_points
from ikns.nullspace.clustering.lloyd import lloyd
from ikns.simulation.movement import Unsteadiness, hand_drift, reach_seconds
from ikns.simulation.places import BOX_HIGH, BOX_LOW
from ikns.simulation.wander import minimum_jerk

Array = np.ndarray
RATE, SECONDS, GATE = 100, 5.0, 0.05
#: Shoulder to knuckles of the generic adult, m.
REACH = 0.65


def clean_box() -> Array:
    """Ten places of the paper's layout, in the simulated box, (10, 3) m."""
    low, high = REACH * BOX_LOW, REACH * BOX_HIGH
    share = np.array([*np.ndindex(2, 2, 2), (0.5, 1, 0.5), (0.5, 0, 0.5)], float)
    return low + share * (high - low)


def free_places(rng: np.random.Generator) -> Array:
    """Ten places in a cube of half a meter, at least 10 cm apart."""
    places = [rng.uniform(0, 0.5, 3)]
    while len(places) < 10:
        one = rng.uniform(0, 0.5, 3)
        if cdist([one], places).min() >= 0.10:
            places.append(one)
    return np.array(places)


def guided(rng: np.random.Generator) -> Array:
    """Where the live guide sends the hand, places of less than 5 cm apart taken once.

    The exploration leads on straight lines from one place of the simulated box to the
    next, for a minute.
    """
    low, high = REACH * BOX_LOW, REACH * BOX_HIGH
    stops, spent, parts = rng.uniform(low, high, (200, 3)), 0.0, []
    for a, b in zip(stops[:-1], stops[1:], strict=True):
        n = max(2, round(RATE * reach_seconds(float(np.linalg.norm(b - a)))))
        parts.append(a + minimum_jerk(n)[:, None] * (b - a))
        spent += n / RATE
        if spent > 60:
            break
    places: list[Array] = []
    for one in TargetPoints(np.concatenate(parts), 10).positions:
        if not places or cdist([one], places).min() >= ONE_PLACE:
            places.append(one)
    return np.array(places)


def recording(places: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Still samples (N, 3) m of visits to all places, and the place of each, (N,)."""
    hold = round(RATE * SECONDS)
    x, which = [], []
    for k, place in enumerate(places):
        x.append(np.repeat(place[None], hold, axis=0))
        which.append(np.full(hold, k))
        if k + 1 < len(places):
            way = places[k + 1] - place
            n = max(2, round(RATE * reach_seconds(float(np.linalg.norm(way)))))
            x.append(place + minimum_jerk(n)[:, None] * way)
            which.append(np.full(n, -1))
    hand, label = np.concatenate(x), np.concatenate(which)
    drift = hand_drift(len(hand), rate=RATE, seed=rng, unsteadiness=Unsteadiness())
    hand = hand + drift[:, :3]
    speed = np.linalg.norm(np.gradient(hand, 1 / RATE, axis=0), axis=1)
    return hand[speed < GATE], label[speed < GATE]


def kept(labels: Array, which: Array, n: int) -> bool:
    """Whether every place has a cluster of its own."""
    counts = [np.bincount(labels[which == k] + 1, minlength=n + 1) for k in range(n)]
    home = [int(count.argmax()) for count in counts]  # 0: most are beyond the radius
    return len(set(home)) == n and 0 not in home


def draws(layout: str, n: int) -> Iterator[tuple[Array, np.random.Generator]]:
    """Places of each draw, and its random numbers."""
    clean = clean_box()
    for seed in range(n):
        rng = np.random.default_rng(seed)
        if layout.startswith("box"):
            scatter = float(layout.split()[1]) / 100
            places = clean + rng.normal(scale=scatter, size=clean.shape)
        elif layout == "free":
            places = free_places(rng)
        elif layout == "subsets":
            places = clean[rng.permutation(10)[: rng.integers(4, 9)]]
        else:
            places = guided(rng)
        yield places[rng.permutation(len(places))], rng


#: Layouts, and how many draws of each.
LAYOUTS = {"box 4 cm": 60, "box 6 cm": 60, "free": 60, "subsets": 40, "live guide": 40}


def of_layout(layout: str, n: int) -> dict[str, int]:
    """Count the draws in which all places were kept."""
    row = dict.fromkeys(("draws", "box start", "now", "known", "same"), 0)
    for places, rng in draws(layout, n):
        x, which = recording(places, rng)
        size = len(places)
        found = BoundingBoxKMeans(size).fit(x)
        told = BoundingBoxKMeans(size).fit(x, groups=which)
        start = box_surface_points(found.box_, size)
        centers, labels, _ = lloyd(x, start, max_iter=300)
        ok = kept(labels, which, size)
        row["draws"] += 1
        row["box start"] += ok
        row["now"] += kept(found.labels_, which, size)
        row["known"] += kept(told.labels_, which, size)
        row["same"] += bool(ok and np.array_equal(centers, found.cluster_centers_))
    return row


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="2 draws of each layout")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    table = {
        layout: of_layout(layout, 2 if options.quick else n)
        for layout, n in LAYOUTS.items()
    }
    if options.json:
        print(json.dumps({"simulated": True, "layouts": table}, indent=1))
        return
    print(
        "Simulated hands; all places kept, number of draws. "
        f"Python {platform.python_version()}, numpy {np.__version__}, seeds from 0.\n"
    )
    print("| layout | draws | box start | now | known | same as box start |")
    print("|---|---|---|---|---|---|")
    for layout, row in table.items():
        cells = [row[key] for key in ("draws", "box start", "now", "known")]
        same = f"{row['same']} of {row['box start']}"
        print(f"| {layout} | {' | '.join(map(str, cells))} | {same} |")
    lost = [
        k for k, row in table.items() if min(row["now"], row["known"]) < row["draws"]
    ]
    print(f"\nAll places kept: {'in every draw' if not lost else f'NOT in {lost}'}.")


if __name__ == "__main__":
    main()
