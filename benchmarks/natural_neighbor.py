"""How exact and how fast is natural-neighbor interpolation? One table.

Errors are the largest difference of a weight from exact integer arithmetic (the cutting
of polyhedra in tests/voronoi_oracle.py): inside, over places all over the hull, and
under the hull, over places at relative depths from 1e-2 down to 1e-10. Interpolants
that have no natural-neighbor weights have no error, large sets no exact arithmetic.

Times are of one thread, with 10 values a site, contenders in shuffled order in every
round: building from the sites (CPU time, median), one call with one new query
(wall-clock time of each call less that of reading the clock: median and the longest of
a thousand, which others on the machine may have interrupted), and a query of a batch
(CPU time, median). x is how many times as long scipy's LinearNDInterpolator takes.
"""

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
import scipy
from scipy.interpolate import (
    LinearNDInterpolator,
    NearestNDInterpolator,
    RBFInterpolator,
)
from threadpoolctl import threadpool_limits

from ikns.nullspace.interpolation import NaturalNeighborInterpolator

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from voronoi_oracle import laplace_weights, sibson_weights

try:
    import natinterp3d
except ImportError:
    natinterp3d = None

Array = np.ndarray
Make = Callable[[Array, Array], Callable[[Array], Array]]
US = 1e6
_ROWS = ("scipy RBF", "natinterp3d")  # take no query but in a row of queries
_SLOW = ("scipy RBF",)


def layouts(rng: np.random.Generator, quick: bool) -> dict[str, Array]:
    """Sites by name, m."""
    cube = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    box = np.vstack([cube * [0.5, 0.4, 0.3], [[0.25, 0.2, 0.0], [0.25, 0.2, 0.3]]])
    grid = np.array(list(np.ndindex(3, 3, 3))) / 2.0
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))

    def jitter(points: Array, size: float) -> Array:
        return points + rng.normal(scale=size, size=points.shape)

    found = {
        "box of 10": box,
        "  turned": box @ turn,
        "  jitter 1e-12 m": jitter(box, 1e-12),
        "  jitter 1e-6 m": jitter(box, 1e-6),
        "  jitter 3 cm": jitter(box, 0.03),
        "grid 3x3x3": grid,
        "  jitter 1e-11 m": jitter(grid, 1e-11),
        "10 in 0.1 mm": rng.random((10, 3)) * [1, 1, 1e-4],
        "10 at random": rng.random((10, 3)),
        "100 at random": rng.random((100, 3)),
    }
    if not quick:
        found["1000 at random"] = rng.random((1000, 3))
        found["10000 at random"] = rng.random((10_000, 3))
    return found


def places(
    points: Array, facets: Array, n: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return queries inside and queries under the hull, (n, 3) m each."""
    spread = 0.3 if len(points) < 100 else 0.01  # else all would be in the middle
    inside = rng.dirichlet(np.full(len(points), spread), n) @ points
    corners = points[facets[rng.integers(len(facets), size=n)]]
    on = np.einsum("qk,qkd->qd", rng.dirichlet(np.ones(3), n), corners)
    depth = 10.0 ** rng.uniform(-10, -2, (n, 1))
    return inside, on + depth * (points.mean(axis=0) - on)


def contenders(everyone: bool, n: int) -> dict[str, Make]:
    """By name, how an interpolant is made of sites and values."""

    def ours(method: str) -> Make:
        return lambda points, values: NaturalNeighborInterpolator(
            points, values, method=method
        )

    found: dict[str, Make] = {
        "ikns": ours("sibson"),
        "ikns laplace": ours("laplace"),
        "scipy LinearND": LinearNDInterpolator,
    }
    if everyone:
        # Up to a few hundred sites each spline sees all of them.
        neighbors = None if n <= 300 else 30
        found["ikns sibson_c1"] = ours("sibson_c1")
        found["scipy NearestND"] = NearestNDInterpolator
        found["scipy RBF"] = lambda points, values: RBFInterpolator(
            points, values, neighbors=neighbors
        )
    if natinterp3d is not None:

        def theirs(points: Array, values: Array) -> Callable[[Array], Array]:
            net = natinterp3d.Interpolator(points, parallel=False)
            return lambda x: net.interpolate(x, values)

        found["natinterp3d"] = theirs
    return found


def weights(who: str, points: Array, x: Array) -> Array | None:
    """Weights of those that say they are exact."""
    if who == "natinterp3d":
        found = natinterp3d.Interpolator(points, parallel=False).get_weights(x)
        return np.asarray(found.toarray())
    if who in ("ikns", "ikns laplace"):
        method = "sibson" if who == "ikns" else "laplace"
        return NaturalNeighborInterpolator(points, method=method).weights(x)
    return None


def truths(points: Array, queries: tuple[Array, Array]) -> dict[str, list[Array]]:
    """Exact weights of each kind, inside and under the hull."""
    return {
        kind: [
            np.array([[float(w) for w in oracle(points, q)] for q in x])
            for x in queries
        ]
        for kind, oracle in (("sibson", sibson_weights), ("laplace", laplace_weights))
    }


def errors(
    who: str, points: Array, queries: tuple[Array, Array], exact: dict[str, list[Array]]
) -> list[str]:
    """Largest error of a weight, inside and under the hull."""
    said = []
    kind = "laplace" if who == "ikns laplace" else "sibson"
    for x, truth in zip(queries, exact[kind], strict=True):
        found = weights(who, points, x) if len(x) else None
        said.append("-" if found is None else f"{np.abs(found - truth).max():.1e}")
    return said


def seconds_a_call(call: Callable[[Array], Array], x: Array, alone: bool) -> Array:
    """Wall-clock time of a call with each query alone or as a (1, 3) array, (Q,) s."""
    clock, taken = time.perf_counter_ns, np.empty(len(x))
    for k, query in enumerate(x if alone else x[:, None]):
        start = clock()
        call(query)
        taken[k] = clock() - start
    return 1e-9 * taken


def measured(
    field: dict[str, Make],
    points: Array,
    x: Array,
    rounds: int,
    rng: np.random.Generator,
) -> dict[str, dict[str, float]]:
    """By name: seconds to build, of a call, of the longest of 1000, in a batch."""
    values = rng.random((len(points), 10))
    nets = {who: make(points, values) for who, make in field.items()}
    for who, net in nets.items():
        net(x[0] if who not in _ROWS else x[:1])
        net(x[:100])
    taken: dict[str, dict[str, list]] = {
        who: {"build": [], "call": [], "batch": []} for who in field
    }
    nothing = np.median(seconds_a_call(lambda query: query, x, True))
    for _ in range(rounds):
        for who in rng.permutation(list(field)):
            if len(taken[who]["build"]) < 3:
                start = time.process_time()
                field[who](points, values)
                taken[who]["build"].append(time.process_time() - start)
            some = x[rng.permutation(len(x))[: 50 if who in _SLOW else 1000]]
            spent = seconds_a_call(nets[who], some, who not in _ROWS)
            taken[who]["call"].append(spent - nothing)
            many = x[: len(x) // 10] if who in _SLOW else x
            start = time.process_time()
            nets[who](many)
            taken[who]["batch"].append((time.process_time() - start) / len(many))
    return {
        who: {
            "build": float(np.median(each["build"])),
            "call": float(np.median(np.concatenate(each["call"]))),
            "longest": float(np.quantile(np.concatenate(each["call"]), 0.999)),
            "batch": float(np.median(each["batch"])),
        }
        for who, each in taken.items()
    }


def machine() -> str:
    """Name of the processor."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.split(":")[1].strip() for line in lines if "model name" in line]
    return names[0] if names else platform.machine()


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
    rounds = 2 if options.quick else 15
    versions = f"numpy {np.__version__}, scipy {scipy.__version__}"
    versions += f", numba {numba.__version__}"
    if natinterp3d is not None:
        versions += f", natinterp3d {natinterp3d.__version__}"
    print(
        f"{os.cpu_count()} x {machine()}, one used, "
        f"Python {platform.python_version()}, {versions}, seed {options.seed}, "
        f"{n} queries an error, {rounds} rounds"
    )
    print(
        f"{'layout':<18}{'':<16}{'error inside':>13}{'under hull':>12}{'build ms':>10}"
        f"{'call us':>9}{'p99.9':>9}{'x':>7}{'batch us':>10}{'x':>8}"
    )
    for name, points in layouts(rng, options.quick).items():
        field = contenders("random" in name or name == "box of 10", len(points))
        facets = NaturalNeighborInterpolator(points).hull_facets
        few = min(n, 20_000 // len(points)) if len(points) <= 100 else 0
        few = min(few, 3) if options.quick and len(points) > 50 else few
        tried = places(points, facets, few, rng)
        exact = truths(points, tried)
        batch = places(points, facets, 1000 if options.quick else 5000, rng)[0]
        times = measured(field, points, batch, rounds, rng)
        base = times["scipy LinearND"]
        label = name
        for who in field:
            t = times[who]
            a, b = errors(who, points, tried, exact)
            print(
                f"{label:<18}{who:<16}{a:>13}{b:>12}{1e3 * t['build']:>10.3g}"
                f"{US * t['call']:>9.3g}{US * t['longest']:>9.3g}"
                f"{base['call'] / t['call']:>7.2g}{US * t['batch']:>10.3g}"
                f"{base['batch'] / t['batch']:>8.2g}",
                flush=True,
            )
            label = ""
        if natinterp3d is None:
            print(f"{'':<18}{'natinterp3d':<16}{'not installed':>13}", flush=True)


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
