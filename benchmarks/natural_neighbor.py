"""How exact and how fast is natural-neighbor interpolation? One table.

Errors are the largest difference of a weight from exact integer arithmetic (the cutting
of polyhedra in tests/voronoi_oracle.py): inside, over places all over the hull, and
under the hull, over places at relative depths from 1e-2 down to 1e-10. Times are median
CPU times of one thread, contenders in shuffled order: building from the sites, one call
with one query, a query in a batch of 5000 (200 for 1000 sites), with 10 values a site.
scipy's LinearNDInterpolator has other weights (barycentric), so it has no error;
natinterp3d is used where it is installed.
"""

import argparse
import platform
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import scipy
from scipy.interpolate import LinearNDInterpolator

from ikns.interpolation import NaturalNeighborInterpolator

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from voronoi_oracle import sibson_weights

try:
    import natinterp3d
except ImportError:
    natinterp3d = None


def layouts(rng: np.random.Generator, quick: bool) -> dict[str, np.ndarray]:
    """Sites by name, m."""
    cube = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    box = np.vstack([cube * [0.5, 0.4, 0.3], [[0.25, 0.2, 0.0], [0.25, 0.2, 0.3]]])
    grid = np.array(list(np.ndindex(3, 3, 3))) / 2.0
    large = np.array(list(np.ndindex(5, 5, 5))) / 4.0
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))

    def jitter(points: np.ndarray, size: float) -> np.ndarray:
        return points + rng.normal(scale=size, size=points.shape)

    found = {
        "box of 10": box,
        "  turned": box @ turn,
        "  jitter 1e-12 m": jitter(box, 1e-12),
        "  jitter 1e-6 m": jitter(box, 1e-6),
        "  jitter 3 cm": jitter(box, 0.03),
        "cube of 8": cube,
        "grid 3x3x3": grid,
        "  jitter 1e-11 m": jitter(grid, 1e-11),
        "10 at random": rng.random((10, 3)),
        "10 in 0.1 mm": rng.random((10, 3)) * [1, 1, 1e-4],
    }
    if not quick:
        found["grid 5x5x5"] = large
        found["  jitter 1e-12 m "] = jitter(large, 1e-12)
        found["100 at random"] = rng.random((100, 3))
        found["1000 at random"] = rng.random((1000, 3))
    return found


def places(
    points: np.ndarray, facets: np.ndarray, n: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return queries inside and queries under the hull, (n, 3) m each."""
    inside = rng.dirichlet(np.full(len(points), 0.3), n) @ points
    corners = points[facets[rng.integers(len(facets), size=n)]]
    on = np.einsum("qk,qkd->qd", rng.dirichlet(np.ones(3), n), corners)
    depth = 10.0 ** rng.uniform(-10, -2, (n, 1))
    return inside, on + depth * (points.mean(axis=0) - on)


def seconds(action: Callable[[], object], repeats: int) -> float:
    """Median CPU time of an action, s."""
    taken = []
    for _ in range(repeats):
        start = time.process_time()
        action()
        taken.append(time.process_time() - start)
    return float(np.median(taken))


def contenders(
    points: np.ndarray, values: np.ndarray
) -> dict[str, dict[str, Callable]]:
    """For each contender: how to build it, to interpolate and to ask for weights."""

    def ours() -> NaturalNeighborInterpolator:
        return NaturalNeighborInterpolator(points, values)

    found = {
        "ikns": {"build": ours, "call": ours(), "weights": ours().weights},
        "scipy LinearND": {
            "build": lambda: LinearNDInterpolator(points, values),
            "call": LinearNDInterpolator(points, values),
        },
    }
    if natinterp3d is not None:

        def theirs() -> object:
            return natinterp3d.Interpolator(points, parallel=False)

        net = theirs()
        found["natinterp3d"] = {
            "build": theirs,
            "call": lambda x: net.interpolate(x, values),
            "weights": lambda x: net.get_weights(x).toarray(),
        }
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--quick", action="store_true", help="small layouts, few queries"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--queries", type=int, help="for each error and layout")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    n = options.queries or (20 if options.quick else 1000)
    versions = f"numpy {np.__version__}, scipy {scipy.__version__}"
    if natinterp3d is not None:
        versions += f", natinterp3d {natinterp3d.__version__}"
    print(
        f"{platform.processor() or platform.machine()}, "
        f"Python {platform.python_version()}, {versions}, seed {options.seed}, "
        f"{n} queries an error"
    )
    print(
        f"{'layout':<18}{'':<16}{'error inside':>13}{'under hull':>12}"
        f"{'build ms':>10}{'call us':>9}{'batch us/query':>16}"
    )
    for name, points in layouts(rng, options.quick).items():
        values = rng.random((len(points), 10))
        facets = NaturalNeighborInterpolator(points).hull_facets
        few = min(n, max(5, 20_000 // len(points)))  # the oracle takes 0.1 s for 125
        tried = places(points, facets, few, rng)
        exact = [
            np.array([[float(w) for w in sibson_weights(points, x)] for x in queries])
            for queries in tried
        ]
        batch = places(points, facets, 5000 if len(points) < 500 else 200, rng)[0]
        rows = {}
        field = contenders(points, values)
        for who in rng.permutation(list(field)):
            build, call = field[who]["build"], field[who]["call"]
            errors = ["-", "-"]
            if "weights" in field[who]:
                weights = field[who]["weights"]
                errors = [
                    f"{np.abs(weights(queries) - truth).max():.1e}"
                    for queries, truth in zip(tried, exact, strict=True)
                ]
            rows[who] = (
                *errors,
                f"{1e3 * seconds(build, 3):.3g}",
                f"{1e6 * seconds(partial(call, batch[:1]), 50):.3g}",
                f"{1e6 * seconds(partial(call, batch), 3) / len(batch):.2g}",
            )
        if natinterp3d is None:
            rows["natinterp3d"] = ("not installed", "", "", "", "")
        for who in ("ikns", "scipy LinearND", "natinterp3d"):
            a, b, c, d, e = rows[who]
            label = name if who == "ikns" else ""
            print(f"{label:<18}{who:<16}{a:>13}{b:>12}{c:>10}{d:>9}{e:>16}", flush=True)


if __name__ == "__main__":
    main()
