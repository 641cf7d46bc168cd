"""What a command prints: tables or JSON on stdout, progress on stderr."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import Any, Protocol

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
    erase_loading()
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
        made.add_row(*(_cell(value, form) for value, form in cells))
    return made


def _cell(value: Any, form: str) -> str:
    """Return the text of a cell; what rounds to zero has no sign.

    >>> _cell(-0.2, ".0f"), _cell(-0.2, ".1f"), _cell(None, ".1f")
    ('0', '-0.2', '-')
    """
    if _missing(value):
        return "-"
    return format(value, f"z{form}" if form.endswith("f") else form)


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


def loading() -> None:
    """Show on a terminal that the command works while it imports what it needs.

    The cursor stays in front, so that :func:`progress` or :func:`show` goes over it.
    """
    if sys.stderr.isatty():
        sys.stderr.write("loading ...\r")
        sys.stderr.flush()


def erase_loading() -> None:
    """Erase what :func:`loading` wrote; the cursor still is in front of it."""
    if sys.stderr.isatty():
        sys.stderr.write("\x1b[K")
        sys.stderr.flush()


def seconds_left(
    now: float, began: float, last: float, done: int, left: int
) -> float | None:
    """Estimate how long the rest of a step takes, s; None before anything is done.

    Rich's own estimate is the pace between the last reports. Two that come together, as
    the two visits of one participant do, make that one second for ten minutes.

    Parameters
    ----------
    now, began, last : float
        Time, when the step began, and when it reported last, s.
    done, left : int
        Parts done since it began, and parts to do.

    Examples
    --------
    >>> seconds_left(25.0, began=0.0, last=20.0, done=2, left=8)
    75.0
    """
    if done < 1:
        return None
    # What is overdue shows that the pace was too fast.
    pace = max((last - began) / done, (now - began) / (done + 1))
    return max(pace * left - (now - last), 0.0)


class Estimate(Protocol):
    """What knows better than a count how far a step is."""

    def share(self) -> float:
        """Return what share is done, 0 to 1."""

    def seconds(self) -> float | None:
        """Return how long the rest takes, s; None if that is not known yet."""


def _time_left(bars: Any, estimates: Mapping[str, Estimate]) -> Any:
    """Return a column of rich with the time left, or since when without an end."""
    from rich.text import Text

    class TimeLeftColumn(bars.ProgressColumn):
        def render(self, task: Any) -> Any:
            fields, done = task.fields, int(task.completed)
            if task.total is None:
                so_far = timedelta(seconds=int(time.monotonic() - fields["began"]))
                return Text(f"{so_far} so far", style="progress.elapsed")
            if task.finished:
                return Text("")
            if task.description in estimates:
                left = estimates[task.description].seconds()
            else:
                left = seconds_left(
                    time.monotonic(),
                    fields["began"],
                    fields["last"],
                    done - fields["first"],
                    int(task.total or 0) - done,
                )
            shown = "-:--:--" if left is None else str(timedelta(seconds=round(left)))
            return Text(shown, style="progress.remaining")

    return TimeLeftColumn()


def _display(bars: Any, estimates: Mapping[str, Estimate]) -> Any:
    """Return rich's display of bars."""
    from rich.console import Console

    class Display(bars.Progress):
        def get_renderables(self) -> Iterable[Any]:
            for task in self.tasks:
                if task.description in estimates:
                    task.completed = estimates[task.description].share() * task.total
                task.fields["share"] = "" if task.total is None else _percent(task)
            yield from super().get_renderables()

    columns = (
        bars.TextColumn("{task.description}"),
        bars.BarColumn(),
        bars.TextColumn("{task.fields[share]}"),
        _time_left(bars, estimates),
    )
    return Display(*columns, console=Console(stderr=True), transient=True)


def _percent(task: Any) -> str:
    return f"{task.percentage:>3.0f}%"


@contextmanager
def progress(
    *, kernels: bool = True, estimates: Mapping[str, Estimate] | None = None
) -> Iterator[Callable[[str, int, int], None]]:
    """Show bars on stderr if it is a terminal; call with (step, done, total).

    One that only moves says that the command works, and for how long it has.
    Kernels that are not compiled yet are compiled here, on two cores. Steps in
    `estimates`, to which they may be added while the bars are shown, go by these
    instead of by their count.
    """
    if not sys.stderr.isatty():
        if kernels:
            _compile(None)
        yield lambda step, done, total: None
        return
    erase_loading()
    from rich import progress as bars

    with _display(bars, {} if estimates is None else estimates) as display:
        tasks: dict[str, bars.TaskID] = {}
        # Moves also where no step says how far it is.
        display.add_task("working", total=None, began=time.monotonic(), share="")

        def report(step: str, done: int, total: int) -> None:
            now = time.monotonic()
            if step not in tasks:
                tasks[step] = display.add_task(
                    step, began=now, first=done, last=now, share=""
                )
            display.update(tasks[step], completed=done, total=total, last=now)

        if kernels:
            _compile(report)
        yield report


def _compile(report: Callable[[str, int, int], None] | None) -> None:
    from ikns.live.warm_up import compiled_before, warm_up

    if not compiled_before():
        warm_up(report)
