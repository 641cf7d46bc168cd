"""The tables, one a question. Every entry: median person (worst person)."""

from collections.abc import Sequence

from interpolation.field import PAPER_LAYOUT
from interpolation.schemes import PAPER, SCHEMES
from interpolation.spread import cell, column, difference, middle

__all__ = ["GLOSSARY", "layouts_table", "say", "schemes_table", "sweep_table"]

People = Sequence[dict]

GLOSSARY = """\
Entries: median person (worst person); of each person the median place, deg or % of the
range. Steps and jumps: median person's median (worst of all).
varied: places in the box, habits of posture differ from visit to visit.
alike: the same habits everywhere, so what is left is interpolation; in and out of the
    hull of the ten points, out by up to a fifth of the box.
left out: each of the ten points from the other nine; a lab can measure this.
a visit right there: what the person shows at that very place on another visit.
angle - paper's, c - paper's: mean over places, varied habits, paired, over people.
hands: steady drifts by 4 mm and 1.2 deg (standard deviation per axis), unsteady by
    three times as much, turning by 4 mm and 10 deg."""


def say(what: str, value: float | None) -> str:
    """Write a setting with its unit."""
    if value is None:
        return "the rule"
    return {
        "gate": f"{value:g} m/s",
        "variance": f"{100 * value:g} %",
        "radius": f"{1000 * value:g} mm",
    }[what]


def _lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Markdown, with columns of even width."""
    table = [list(head), *[list(row) for row in rows]]
    wide = [max(len(row[k]) for row in table) for k in range(len(head))]

    def line(row: Sequence[str]) -> str:
        cells = [row[0].ljust(wide[0])]
        cells += [text.rjust(w) for text, w in zip(row[1:], wide[1:], strict=True)]
        return "| " + " | ".join(cells) + " |"

    rule = "|" + "|".join(
        "-" * (w + 1) + (":" if k else "-") for k, w in enumerate(wide)
    )
    return [line(table[0]), rule + "|", *map(line, table[1:])]


def schemes_table(people: People) -> list[str]:
    """Which interpolation, on the paper's ten points."""
    kinds = ("", "inside_", "outside_", "left_out_")
    first, second = [], []
    for name in SCHEMES:
        rows = [one["schemes"][name] for one in people]
        first.append(
            [name]
            + [cell(rows, f"{kind}{what}") for what in ("angle", "c") for kind in kinds]
        )
        paper = [one["schemes"][PAPER] for one in people]
        apart = []
        for what, digits in (("angle_mean", 2), ("c_mean", 2)):
            low, mean, high = difference(column(rows, what), column(paper, what))
            apart.append(f"{mean:+.{digits}f} [{low:+.{digits}f}, {high:+.{digits}f}]")
        worst = [f"{column(rows, f'{what}_worst').max():.1f}" for what in _STEPS]
        usual = [f"{middle(rows, what):.2f}" for what in _STEPS]
        both = [f"{u} ({w})" for u, w in zip(usual, worst, strict=True)]
        second.append([name, *apart, *both])
    floor = [one["floor"] for one in people]
    rest = ["-"] * 3
    first.append(
        ["a visit right there", cell(floor, "angle"), *rest, cell(floor, "c"), *rest]
    )
    heads = [f"{what} {kind}" for what in ("angle", "c") for kind in _KINDS]
    return [
        *_lines(["scheme, 10 points", *heads], first),
        "",
        *_lines(
            [
                "scheme, 10 points",
                "angle - paper's, deg [95 %]",
                "c - paper's, % [95 %]",
                "jump of c at the hull, %",
                "largest step of c in 10 ms, %",
                "in 1 mm, %",
            ],
            second,
        ),
    ]


_STEPS = ("jump", "frame", "mm")
_KINDS = ("varied", "alike, in", "alike, out", "left out")


def layouts_table(people: People) -> list[str]:
    """How many points, and where."""
    sizes = list(people[0]["layouts"][PAPER_LAYOUT])
    blocks = []
    for unit, what in (("deg", "angle"), ("%", "c"), ("%", "inside")):
        title = {
            "angle": "angle, deg",
            "c": "c, %",
            "inside": "places in the hull, %",
        }[what]
        rows = []
        for layout in people[0]["layouts"]:
            there = [one["layouts"][layout] for one in people]
            if what == "inside":
                rows.append(
                    [layout]
                    + [
                        f"{middle([t[n] for t in there], what):.0f}"
                        if n in there[0]
                        else "-"
                        for n in sizes
                    ]
                )
                continue
            rows.append(
                [layout]
                + [
                    cell([t[n] for t in there], what) if n in there[0] else "-"
                    for n in sizes
                ]
            )
        if what != "inside":
            for scheme in people[0]["numbers"]:
                there = [one["numbers"][scheme] for one in people]
                if scheme != PAPER:
                    rows.append(
                        [f"  {scheme}"]
                        + [cell([t[n] for t in there], what) for n in sizes]
                    )
            floor = cell([one["floor"] for one in people], what)
            rows.append(["a visit right there", *[floor] * len(sizes)])
        else:
            there = [one["layouts"][PAPER_LAYOUT] for one in people]
            rows.append(
                ["recording, min"]
                + [f"{middle([t[n] for t in there], 'minutes'):.1f}" for n in sizes]
            )
        head = [f"{title} ({unit})" if unit not in title else title]
        blocks += [*_lines(head + [f"{n} points" for n in sizes], rows), ""]
    return blocks[:-1]


def sweep_table(what: str, sweeps: dict[str, dict[float | None, People]]) -> list[str]:
    """Gate, variance or radius, for every kind of hand."""
    rows = []
    for condition, settings in sweeps.items():
        for setting, people in settings.items():
            rows.append(
                [
                    f"{condition}, {say(what, setting)}",
                    cell(people, "kept", least=True, digits=0),
                    cell(people, "stray"),
                    cell(people, "found", least=True, digits=0),
                    cell(people, "components"),
                    cell(people, "own"),
                    cell(people, "angle"),
                    cell(people, "c"),
                ]
            )
    return _lines(
        [
            f"hand, {what}",
            "used at points, %",
            "from reaches, %",
            "points found",
            "components",
            "angle at points, deg",
            "angle between, deg",
            "c between, %",
        ],
        rows,
    )
