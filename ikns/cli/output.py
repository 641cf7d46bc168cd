"""What a command prints: tables or JSON on stdout, progress on stderr."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

#: Columns of a table that is written to a file or a pipe, which have no width.
_WIDTH = 100


def json_text(value: Any) -> str:
    """Return strict JSON; numbers that are not finite become null."""
    return json.dumps(_plain(value), indent=2, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # NumPy's arrays and numbers
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def show(result: Mapping[str, Any], *parts: Any, as_json: bool) -> None:
    """Print a command's result.

    Parameters
    ----------
    result : mapping
        Everything, for ``--json``.
    *parts : str or rich table
        The short version for people.
    as_json : bool
        Which of the two.
    """
    if as_json:
        sys.stdout.write(json_text(result))
        return
    from rich.console import Console

    width = None if sys.stdout.isatty() else _WIDTH
    console = Console(highlight=False, markup=False, soft_wrap=True, width=width)
    for part in parts:
        console.print(part)


def table(title: str, columns: Mapping[str, str], rows: Iterable[Sequence[Any]]) -> Any:
    """Return a rich table.

    Parameters
    ----------
    title : str
    columns : mapping
        Format of the cells by header, such as ``.1f``; a column with ``s`` holds text
        and is set left. A header may have several lines.
    rows : iterable of sequence
        What is missing (None, NaN) becomes a dash.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    made = Table(title=title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False)
    for header, form in columns.items():
        made.add_column(header, justify="left" if form == "s" else "right")
    for row in rows:
        cells = zip(row, columns.values(), strict=True)
        made.add_row(*("-" if _missing(x) else format(x, form) for x, form in cells))
    return made


def _missing(value: Any) -> bool:
    return value is None or (isinstance(value, float) and math.isnan(value))


def notes(sentences: Iterable[str]) -> list[str]:
    """Mark sentences as notes."""
    return [f"Note: {sentence}" for sentence in sentences]


def held_sentences(joints: Sequence[str]) -> list[str]:
    """Say which joints stay where they are; one name for both sides.

    >>> held_sentences(["right_wrist_flexion", "left_wrist_flexion", "right_elbow"])
    ['Held, as no marker shows them: wrist_flexion, right_elbow.']
    """
    said: dict[str, None] = {}
    for joint in joints:
        side, _, name = joint.partition("_")
        other = {"right": "left", "left": "right"}.get(side)
        said[name if f"{other}_{name}" in joints else joint] = None
    return [f"Held, as no marker shows them: {', '.join(said)}."] if said else []


@contextmanager
def progress() -> Iterator[Callable[[str, int, int], None]]:
    """Show bars on stderr if it is a terminal; call with (step, done, total)."""
    if not sys.stderr.isatty():
        yield lambda step, done, total: None
        return
    from rich import progress as bars
    from rich.console import Console

    columns = (
        bars.TextColumn("{task.description}"),
        bars.BarColumn(),
        bars.TaskProgressColumn(),
        bars.TimeRemainingColumn(),
    )
    with bars.Progress(
        *columns, console=Console(stderr=True), transient=True
    ) as display:
        tasks: dict[str, bars.TaskID] = {}

        def report(step: str, done: int, total: int) -> None:
            if step not in tasks:
                tasks[step] = display.add_task(step)
            display.update(tasks[step], completed=done, total=total)

        from ikns.live.warm_up import compiled_before, warm_up

        if not compiled_before():
            warm_up(report)
        yield report
