"""Which interpolation, how many points and where: the answers of one simulated person.

Joint angles are the true ones, with the unsteadiness of the hand and without the noise
of markers.
"""

import itertools
from collections.abc import Sequence

import numpy as np

from interpolation import layouts
from interpolation.schemes import PAPER, SCHEMES, Known
from interpolation.scores import (
    errors,
    hull_jump,
    in_hull,
    largest_steps,
    left_out,
    revisited,
)
from interpolation.truth import Person, Visit, learned, learned_alone, person

__all__ = ["MORE", "PAPER_LAYOUT", "one_person"]

Array = np.ndarray
Numbers = dict[str, float]

PAPER_LAYOUT = "box surface (paper)"
#: Schemes that are tried on any number of points.
MORE = (
    PAPER,
    "nearest point",
    "natural neighbor, projected",
    "smooth (C1), projected",
    "thin-plate spline",
    "Gaussian process",
    "affine least squares",
)
#: How near to the places of a plan people put their hand, m per axis, as in
#: `ikns.simulation.places`.
_NEAR = 0.012
#: Test places with equal habits lie in a box larger by this share on each side.
_BEYOND = 0.2


def one_person(
    seed: int,
    *,
    sizes: Sequence[int],
    kinds: Sequence[str],
    n_tests: int,
    n_reaches: int,
) -> dict[str, dict]:
    """Return the errors of every scheme, layout and number of points.

    Returns
    -------
    dict
        ``schemes``: by scheme on the paper's ten points; ``layouts``: by layout and
        number of points; ``numbers``: by scheme and number, on the paper's layout;
        ``floor``: of another visit right there.
    """
    who, rng = person(seed), np.random.default_rng([seed, 0])
    tests = rng.uniform(who.low, who.high, (n_tests, 3))
    plans = {
        (kind, n): layouts.LAYOUTS[kind](who.low, who.high, n, rng)
        for kind in kinds
        for n in _drawn(kind, sizes)
    }
    near = {key: x + rng.normal(0.0, _NEAR, x.shape) for key, x in plans.items()}
    goals = [tests, tests, *near.values()]
    # All at once: it is one person, with one comfortable swivel.
    visits = who.visits(who.places(np.vstack(goals), rng), rng)
    ends = np.cumsum([0, *map(len, goals)])
    truth, again, *pools = (visits[a:b] for a, b in itertools.pairwise(ends))
    pool = dict(zip(plans, pools, strict=True))
    maps = {
        (kind, n): _first(pool, kind, n, who)
        for kind in kinds
        for n in (_drawn(kind, sizes) if kind == "grid" else sizes)
    }
    one_each = [learned_alone(visit, who.reference([visit])) for visit in again]
    ten = pool[PAPER_LAYOUT, max(sizes)][:10]
    return {
        "schemes": _schemes(
            who, near[PAPER_LAYOUT, max(sizes)][:10], ten, truth, n_reaches, rng
        ),
        "layouts": {
            kind: {
                n: _summary(*errors(SCHEMES[PAPER](known), truth))
                | {
                    "minutes": layouts.minutes(known.centers),
                    "inside": 100 * float(in_hull(known.centers, tests).mean()),
                }
                for (of, n), known in maps.items()
                if of == kind
            }
            for kind in kinds
        },
        "numbers": {
            scheme: {
                n: _summary(*errors(SCHEMES[scheme](maps[PAPER_LAYOUT, n]), truth))
                for n in sizes
            }
            for scheme in MORE
        },
        "floor": _summary(*revisited(truth, one_each)),
    }


def _drawn(kind: str, sizes: Sequence[int]) -> list[int]:
    """Return the numbers of points to draw: the largest holds the smaller layouts."""
    if kind == "grid":
        return [n for n in sizes if n in layouts.GRIDS]
    return [max(sizes)]


def _first(
    pool: dict[tuple[str, int], list[Visit]], kind: str, n: int, who: Person
) -> Known:
    visits = pool.get((kind, n)) or pool[kind, max(m for k, m in pool if k == kind)]
    return learned(visits[:n], who.reference(visits[:n]))


def _schemes(
    who: Person,
    plan: Array,
    ten: list[Visit],
    truth: list[Visit],
    n_reaches: int,
    rng: np.random.Generator,
) -> dict[str, Numbers]:
    """Return the numbers of every scheme on the paper's ten points."""
    known = learned(ten, who.reference(ten))
    margin = _BEYOND * (who.high - who.low)
    around = rng.uniform(who.low - margin, who.high + margin, (3 * len(truth) // 2, 3))
    places = who.places(np.vstack([plan, around]), rng, varied=False)
    if not np.allclose([place.position for place in places[:10]], plan):
        raise SystemExit(f"{who.subject.seed}: a vertex of the box is out of reach.")
    alike = who.visits(places, rng)
    same = learned(alike[:10], who.reference(alike[:10]))
    others = alike[10:]
    inside = in_hull(same.centers, np.array([visit.center for visit in others]))
    reaches = who.reaches(n_reaches, rng)
    seed = int(rng.integers(2**32))
    found = {}
    for name, scheme in SCHEMES.items():
        at, at_same = scheme(known), scheme(same)
        angle, c = errors(at_same, others)
        left_angle, left_c = left_out(scheme, known, ten)
        jump = hull_jump(at, known, np.random.default_rng(seed))
        frame, mm = largest_steps(at, reaches)
        found[name] = (
            _summary(*errors(at, truth))
            | _summary(angle[inside], c[inside], "inside_")
            | _summary(angle[~inside], c[~inside], "outside_")
            | _summary(left_angle, left_c, "left_out_")
            | {
                "jump": float(np.median(jump)),
                "jump_worst": float(jump.max()),
                "frame": float(np.median(frame)),
                "frame_worst": float(frame.max()),
                "mm": float(np.median(mm)),
                "mm_worst": float(mm.max()),
            }
        )
    return found


def _summary(angle: Array, c: Array, prefix: str = "") -> Numbers:
    """Median, 95th percentile and mean over places."""
    return {
        f"{prefix}{what}{suffix}": float(of(values))
        for what, values in (("angle", angle), ("c", c))
        for suffix, of in (
            ("", np.median),
            ("95", lambda v: np.percentile(v, 95)),
            ("_mean", np.mean),
        )
    }
