"""Plain-language conclusions, worded by the numbers of the run.

"Better" and "worse" mean that the 95 % interval of the mean paired difference over
people excludes zero; with a dozen comparisons a table, one by chance is to be expected.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import spearmanr

from interpolation.field import PAPER_LAYOUT
from interpolation.schemes import PAPER, SCHEMES
from interpolation.spread import column, difference, middle
from interpolation.tables import say

__all__ = [
    "about_layouts",
    "about_numbers",
    "about_schemes",
    "about_sweep",
    "verdict",
]

People = Sequence[dict]
Sweeps = dict[str, dict[float | None, People]]

#: A change of c below this within 0.2 um across the hull is steep, but no jump, %.
_NONE = 0.1
#: Errors that differ by less than this share are as good as equal.
_SAME = 0.10
#: A step of c this many times the calmest scheme's is large.
_LARGE = 3.0
_UNIT = {"angle": "deg", "c": "%"}
_WORD = {"angle": "the direction", "c": "c"}


def about_schemes(people: People) -> list[str]:
    """Tell which interpolation a lab should choose."""
    rows = _schemes(people)
    floor = [one["floor"] for one in people]
    said = []
    for what, word in (("angle", "direction"), ("c", "c")):
        unit, mean = _UNIT[what], _means(rows, f"{what}_mean")
        best = min(mean, key=mean.__getitem__)
        here = column(floor, f"{what}_mean").mean()
        apart = _apart(rows[best], rows[PAPER], f"{what}_mean")
        better, worse = _sorted_out(rows, f"{what}_mean")
        said.append(
            f"{word}: on ten points the paper's natural neighbor is off by "
            f"{mean[PAPER]:.1f} {unit} on average, the best ({best}) by "
            f"{mean[best]:.1f} {unit} (difference {apart}), another visit right there "
            f"by {here:.1f} {unit}. Better than the paper's: {_list(better)}; worse: "
            f"{_list(worse)}."
        )
        mean = {
            kind: _means(rows, f"{kind}_{what}_mean") for kind in ("inside", "outside")
        }
        best_of = {kind: min(m, key=m.__getitem__) for kind, m in mean.items()}
        said.append(
            f"{word}, interpolation alone (habits alike): "
            + "; ".join(
                f"{kind} the hull the paper's {m[PAPER]:.1f} {unit}, best "
                f"{best_of[kind]} {m[best_of[kind]]:.1f} {unit}"
                for kind, m in mean.items()
            )
            + "."
        )
    jumps, frames = _worst(rows, "jump_worst"), _worst(rows, "frame_worst")
    calm = min(frames.values())
    continuous = [name for name in SCHEMES if jumps[name] < _NONE]
    steep = [
        f"{name} ({frames[name]:.1f} %)"
        for name in continuous
        if frames[name] > _LARGE * calm
    ]
    said.append(
        f"steadiness: the paper's c jumps at the hull by up to {jumps[PAPER]:.1f} % "
        f"and steps by up to {frames[PAPER]:.1f} % in 10 ms on a reach; the calmest "
        f"scheme by {calm:.1f} %. No jump at the hull, but steps of more than "
        f"{_LARGE:g} times the calmest's: {_list(steep)}."
    )
    agree = {
        what: float(
            spearmanr(
                list(_means(rows, f"left_out_{what}_mean").values()),
                list(_means(rows, f"{what}_mean").values()),
            ).statistic
        )
        for what in ("angle", "c")
    }
    ratio = middle(rows[PAPER], "left_out_angle") / middle(rows[PAPER], "angle")
    ranks = {
        what: "like" if r > 0.8 else "somewhat like" if r > 0.5 else "not like"
        for what, r in agree.items()
    }
    said.append(
        f"leave-one-out, which a lab can do by itself, ranks the schemes by angle "
        f"{ranks['angle']} the truth does (rank correlation {agree['angle']:.2f}) and "
        f"by c {ranks['c']} it ({agree['c']:.2f}). The angle it shows for the paper's "
        f"is {ratio:.1f} times the one in the box: most points are vertices, and "
        "without them it extrapolates."
    )
    return [*said, f"choose: {_choice(rows)}"]


def _schemes(people: People) -> dict[str, People]:
    return {name: [one["schemes"][name] for one in people] for name in SCHEMES}


def _means(rows: dict[str, People], what: str) -> dict[str, float]:
    return {name: float(column(r, what).mean()) for name, r in rows.items()}


def _worst(rows: dict[str, People], what: str) -> dict[str, float]:
    return {name: float(column(r, what).max()) for name, r in rows.items()}


def _apart(ours: People, theirs: People, what: str) -> str:
    low, mean, high = difference(column(ours, what), column(theirs, what))
    return f"{mean:+.2f} [{low:+.2f}, {high:+.2f}]"


def _sorted_out(rows: dict[str, People], what: str) -> tuple[list[str], list[str]]:
    """Schemes whose interval against the paper's lies below zero, and above."""
    better, worse = [], []
    for name in rows:
        low, _, high = difference(column(rows[name], what), column(rows[PAPER], what))
        if high < 0:
            better.append(name)
        if low > 0:
            worse.append(name)
    return better, worse


def _choice(rows: dict[str, People]) -> str:
    """Least error of the direction among those that jump nowhere and step little."""
    jumps, frames = _worst(rows, "jump_worst"), _worst(rows, "frame_worst")
    calm = _LARGE * min(frames.values())
    fit = [name for name in SCHEMES if jumps[name] < _NONE and frames[name] <= calm]
    angle, c = _means(rows, "angle_mean"), _means(rows, "c_mean")
    best = min(fit, key=angle.__getitem__)
    gain = f"{_apart(rows[best], rows[PAPER], 'angle_mean')} deg"
    more = f"{_apart(rows[best], rows[PAPER], 'c_mean')} %"
    spread = [c[name] for name in fit]
    said = (
        f"of those that jump nowhere and step little ({_list(fit)}), {best} has "
        f"the best direction ({gain} and, of c, {more} against the paper's). "
    )
    alike = max(spread) <= (1 + _SAME) * min(spread)
    said += (
        "For the error of c the choice among these makes less than a tenth."
        if alike
        else f"Their errors of c go from {min(spread):.1f} to {max(spread):.1f} %."
    )
    if jumps[PAPER] > _LARGE * min(frames.values()):
        said += (
            " Outside the hull, do not take the nearest point's values where c drives "
            "a robot."
        )
    return said


def about_layouts(people: People) -> list[str]:
    """Tell where to put the points."""
    sizes = list(people[0]["layouts"][PAPER_LAYOUT])
    said = []
    for n in [m for m in (10, 12, 27) if m in sizes]:
        parts = []
        for what, unit in _UNIT.items():
            better, worse = [], []
            for layout, there in people[0]["layouts"].items():
                if layout == PAPER_LAYOUT or n not in there:
                    continue
                ours = [one["layouts"][layout][n] for one in people]
                theirs = [one["layouts"][PAPER_LAYOUT][n] for one in people]
                low, mean, high = difference(
                    column(ours, f"{what}_mean"), column(theirs, f"{what}_mean")
                )
                text = f"{layout} {mean:+.1f} [{low:+.1f}, {high:+.1f}]"
                if high < 0:
                    better.append(text)
                if low > 0:
                    worse.append(text)
            parts.append(
                f"{what} ({unit}): better {_list(better)}; worse {_list(worse)}"
            )
        said.append(
            f"layout, {n} points, natural neighbor, against the paper's layout: "
            + ". ".join(parts)
            + "."
        )
    return said


def about_numbers(people: People) -> list[str]:
    """Tell how many points are worth recording."""
    said = []
    for layout in people[0]["layouts"]:
        if layout not in (PAPER_LAYOUT, "vertices, then inside"):
            continue
        parts = []
        for what, unit in _UNIT.items():
            mean = _by_number(people, layout, what)
            enough, most = _enough(mean), max(mean)
            cost = middle([p["layouts"][layout][enough] for p in people], "minutes")
            floor = column([p["floor"] for p in people], f"{what}_mean").mean()
            parts.append(
                f"for {_WORD[what]} {enough} points ({cost:.1f} min, "
                f"{mean[enough]:.1f} {unit}; {mean[most]:.1f} with {most}, "
                f"{floor:.1f} on a visit right there)"
            )
        said.append(
            f"number, {layout}: within a tenth of what {most} points reach come "
            + " and ".join(parts)
            + "."
        )
    rows = {
        n: [p["layouts"][PAPER_LAYOUT][n] for p in people]
        for n in people[0]["layouts"][PAPER_LAYOUT]
    }
    if 10 in rows:
        parts = []
        for n in (m for m in rows if m > 10):
            cost = middle(rows[n], "minutes") - middle(rows[10], "minutes")
            deg, c = (_apart(rows[n], rows[10], f"{w}_mean") for w in ("angle", "c"))
            parts.append(f"{n}: {deg} deg, {c} % for {cost:+.1f} min")
        said.append("number: against the paper's ten, " + "; ".join(parts) + ".")
    return said


def _by_number(people: People, layout: str, what: str) -> dict[int, float]:
    return {
        n: float(
            column([p["layouts"][layout][n] for p in people], f"{what}_mean").mean()
        )
        for n in people[0]["layouts"][layout]
    }


def _enough(mean: dict[int, float]) -> int:
    """Least number from which on no error is above that of the most by a tenth."""
    sizes = list(mean)
    last = (1 + _SAME) * mean[sizes[-1]]
    good = [all(mean[m] <= last for m in sizes[k:]) for k in range(len(sizes))]
    return sizes[good.index(True)]


def about_sweep(what: str, paper: float | None, sweeps: Sweeps) -> list[str]:
    """Tell whether the paper's setting is good, and which others are."""
    said = []
    for condition, settings in sweeps.items():
        good, best = _good(settings)
        is_good = "is" if paper in good else "is not"
        gain = "none has a smaller angle"
        if (column(settings[best], "angle") != column(settings[paper], "angle")).any():
            apart = _apart(settings[best], settings[paper], "angle")
            gain = f"angle with {say(what, best)} against it: {apart} deg"
        text = (
            f"{what}, {condition} hand: within a tenth of the best, with no point "
            f"lost, {_verb(good)} {_list([say(what, v) for v in good])}; "
            f"{say(what, paper)} {is_good} among them ({gain})"
        )
        losing = [say(what, v) for v, rows in settings.items() if not _whole(rows)]
        if losing:
            text += f". Points are lost with {_list(losing)}"
        if what == "variance":
            one = [
                say(what, v)
                for v, rows in settings.items()
                if column(rows, "components").max() == 1
            ]
            text += f". One component is enough for everybody with {_list(one)}"
        said.append(text + ".")
    return said


def _whole(rows: People) -> bool:
    """Whether everybody has all ten points."""
    return bool(column(rows, "found").min() >= 10)


def _good(
    settings: dict[float | None, People],
) -> tuple[list[float | None], float | None]:
    """Return settings within a tenth of the best in angle and c, and the best."""
    fit = [v for v, rows in settings.items() if _whole(rows)]
    fit = fit or [
        v for v, r in settings.items() if np.isfinite(column(r, "angle")).any()
    ]
    mean = {
        v: [float(np.nanmean(column(settings[v], k))) for k in ("own", "angle", "c")]
        for v in fit
    }
    least = np.min(list(mean.values()), axis=0)
    good = [v for v in fit if (np.array(mean[v]) <= (1 + _SAME) * least).all()]
    return good, min(fit, key=lambda v: mean[v][1])


def verdict(
    people: People, sweeps: dict[str, Sweeps], paper: dict[str, float | None]
) -> list[str]:
    """Tell whether the paper's choice is good."""
    said = []
    sizes = people[0]["layouts"][PAPER_LAYOUT]
    if 10 in sizes:
        for what in _UNIT:
            enough = _enough(_by_number(people, PAPER_LAYOUT, what))
            word = "enough" if enough <= 10 else f"too few, {enough} would do"
            said.append(f"10 points: for {_WORD[what]} {word}")
    rows = _schemes(people)
    for what in _UNIT:
        mean = _means(rows, f"{what}_mean")
        share = mean[PAPER] / min(mean.values()) - 1
        word = (
            "as good as any" if share <= _SAME else f"{100 * share:.0f} % off the best"
        )
        said.append(f"natural neighbor: for {_WORD[what]} {word}")
    jump = _worst(rows, "jump_worst")[PAPER]
    said.append(
        f"the nearest point's values outside: c jumps by up to {jump:.0f} %"
        if jump > _NONE
        else "the nearest point's values outside: no jump seen"
    )
    for what, by_hand in sweeps.items():
        bad = [
            hand
            for hand, settings in by_hand.items()
            if paper[what] not in _good(settings)[0]
        ]
        name = f"{what} {say(what, paper[what])}"
        if what == "radius":
            name = "radius, for which the paper gives none: the package's rule"
        said.append(
            f"{name}: "
            + ("good for every hand" if not bad else f"not good for: {', '.join(bad)}")
        )
    return [f"{line}." for line in said]


def _verb(names: Sequence[object]) -> str:
    return "is" if len(names) == 1 else "are"


def _list(names: Sequence[str]) -> str:
    return "; ".join(names) if names else "none"
