"""The status of a live run: one line on the terminal."""

from __future__ import annotations

import math
import shutil
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ikns.cli.stop_notice import arm_hint, watch_stops

if TYPE_CHECKING:
    from ikns.live.runtime import AxisStatus, LoopStatus

#: Interval of the status line on the terminal, s.
LINE_EVERY = 0.2


@contextmanager
def status_line(arm: threading.Event) -> Iterator[Callable[[LoopStatus], None]]:
    """Rewrite one line on stderr if it is a terminal; a key arms what is stopped."""
    with watch_stops(arm.set, announce=False) as watch:
        if not sys.stderr.isatty():
            yield watch
            return
        last = -math.inf

        def write(status: LoopStatus) -> None:
            nonlocal last
            watch(status)
            if status.time - last >= LINE_EVERY:
                last = status.time
                # A wrapped line could not be rewritten.
                room = shutil.get_terminal_size().columns - 1
                sys.stderr.write(f"\r\x1b[K{_line(status)[:room]}")
                sys.stderr.flush()

        yield write
        sys.stderr.write("\n")


def each(shown: list[Callable[[LoopStatus], None]]) -> Callable[[LoopStatus], None]:
    """Return what shows a status everywhere."""

    def show(status: LoopStatus) -> None:
        for one in shown:
            one(status)

    return show


def once(call: Callable[[], None]) -> Callable[..., None]:
    """Return what does something the first time that it is called."""
    left = [call]

    def tell(*_: LoopStatus) -> None:
        while left:
            left.pop()()

    return tell


def _line(s: LoopStatus) -> str:
    """Return the status, most important first: a narrow terminal cuts the rest."""
    # The reason stands above, where it does not vanish.
    state = f"STOPPED{arm_hint()}:" if s.stopped else f"{s.state:<7}"
    drive = f"{state} {' '.join(_axis(axis, s.axes) for axis in s.axes)}"
    late = 1e3 * s.latency
    # Never wider, so that 80 columns hold the residual too.
    pace = f"{s.rate:4.0f}/s p99 {late:4.{2 if late < 9.995 else 0}f} ms"
    if why := s.rejection or "held: the hand is fast" * s.too_fast:
        return f"{drive} {why} {pace} misses {s.misses}"
    place = "inside" if s.inside else "OUTSIDE"
    return (
        f"{drive} {pace} {place:<7} residual {1e3 * s.residual:4.1f} mm "
        f"c +-{s.uncertainty:5.3f} worst {1e3 * s.worst_residual:3.0f} mm "
        f"misses {s.misses}"
    )


def _axis(axis: AxisStatus, axes: tuple[AxisStatus, ...]) -> str:
    if len(axes) == 1 and axis.dof == 1:
        return f"c {axis.c:5.2f} flexion {axis.flexion:4.2f} ({axis.measured:4.2f})"
    # Two fit into 80 columns: c, flexion, measured.
    return f"c_{axis.dof} {axis.c:5.2f} {axis.flexion:4.2f} ({axis.measured:4.2f})"
