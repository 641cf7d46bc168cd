"""Screen and keys of ``ikns calibrate --live``; the protocol is in live."""

from __future__ import annotations

import math
import os
import select
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import ikns
from ikns.body.chains import ChainLike, joint_sides
from ikns.errors import InvalidInput, NotEnoughData

if TYPE_CHECKING:
    from ikns.live.calibration import (
        CalibrationStatus,
        Change,
        Key,
        ProtocolStep,
        Verdict,
    )

#: With --auto: takes of a step before it is skipped.
_AUTO_TAKES = 3
_KEYS: dict[str, Key] = {
    "\n": "next",
    "\r": "next",
    "n": "next",
    "r": "redo",
    "s": "skip",
    "q": "quit",
}
_PROMPTS = {
    "static": "Stand still, arms slightly away from the body",
    "free": "Sit down, keep the torso still and move the hand wherever it goes",
    "natural": "Do everyday things with objects at hand, all over the work space: "
    "reach, drink, carry, put away",
    "point": "Hold the hand{where}, and move the elbow up and down",
}
#: Added where there are more freedoms than elbows.
_TURN = ", and turn the hand about its long axis in a slower rhythm"


@dataclass(frozen=True)
class LiveOptions:
    """Options of ``--live``."""

    source: str
    recordings: Path
    points: int
    static_seconds: float
    free_seconds: float
    natural_seconds: float
    point_seconds: float
    countdown: float
    resume: bool
    auto: bool


def record_live(
    options: LiveOptions,
    *,
    generic: ikns.Skeleton | None,
    marker_set: str,
    chain: ChainLike,
    n_dof: int,
    max_hand_speed: float,
    min_static: float,
    min_still: float,
    min_rest: float,
) -> tuple[Path, list[Path], list[Path], list[dict[str, Any]]]:
    """Record the calibration of a person, step by step.

    Returns
    -------
    static : Path
        Accepted recording.
    points : list of Path
    movement : list of Path
        Free exploration and ordinary movement, where they were accepted.
    takes : list of dict
        Every take with its verdict.
    """
    from ikns.live.calibration import (
        Judge,
        LiveProtocol,
        RecordingsFolder,
        accepted_movement,
        accepted_recordings,
        check_labels,
        paper_steps,
        restore,
        run_protocol,
    )
    from ikns.live.stream import open_source

    steps = paper_steps(
        points=options.points,
        static_seconds=options.static_seconds,
        free_seconds=options.free_seconds,
        natural_seconds=options.natural_seconds,
        point_seconds=options.point_seconds,
        countdown=options.countdown,
    )
    _check_options(options, min_static=min_static, min_still=min_still)
    body = ikns.Skeleton.load() if generic is None else generic
    judge = Judge(
        body,
        marker_set=marker_set,
        chain=chain,
        n_dof=n_dof,
        max_hand_speed=max_hand_speed,
        min_static=min_static,
        min_still=min_still,
        min_rest=min_rest,
    )
    with ExitStack() as stack:
        source = stack.enter_context(open_source(options.source))
        check_labels(source, marker_set, chain, generic=body)
        settings = {"marker_set": marker_set, "chain": str(chain), "rate": source.rate}
        if not isinstance(chain, str):
            settings["chain_definition"] = chain.table()
        folder = RecordingsFolder(options.recordings, settings, resume=options.resume)
        stack.enter_context(folder.locked())
        ikns.warm_up()
        restore(judge, folder, steps)
        pending = folder.pending(steps)
        protocol = LiveProtocol(
            steps,
            labels=source.labels,
            rate=source.rate,
            auto_takes=_AUTO_TAKES if options.auto else 0,
            accepted=folder.accepted,
            pending={name: ikns.read(path) for name, path in pending.items()},
        )
        turn = n_dof > len(joint_sides(chain))
        screen = _Screen(steps, auto=options.auto, turn=turn)
        with _keys(listen=not options.auto) as keys:
            run_protocol(
                source,
                protocol,
                judge,
                folder,
                n_points=options.points,
                keys=keys,
                on_change=screen.change,
                on_status=screen.status if sys.stderr.isatty() else None,
            )
    if protocol.state == "stopped":
        done = len(judge.places)
        raise NotEnoughData(
            f"{options.recordings}: stopped with {done} of {options.points} points "
            "accepted; the recordings are kept, continue with --resume."
        )
    static, points = accepted_recordings(folder, steps)
    return static, points, accepted_movement(folder, steps), folder.takes


def _check_options(
    options: LiveOptions, *, min_static: float, min_still: float
) -> None:
    """Refuse recordings that are too short, and a desk without a keyboard."""
    for least, seconds, name in (
        (min_static, options.static_seconds, "static"),
        (min_still, options.point_seconds, "point"),
    ):
        if seconds < least:
            raise InvalidInput(
                f"--{name}-seconds {seconds:g} is too short, expected at least "
                f"{least:g} s."
            )
    if not options.auto and sys.stdin is None:
        raise InvalidInput("expected a keyboard; use --auto where there is none.")


class _Screen:
    """Lines on stderr: one for each change, and on a terminal one that is rewritten."""

    def __init__(
        self, steps: Sequence[ProtocolStep], *, auto: bool, turn: bool = False
    ) -> None:
        self._auto, self._turn = auto, turn
        self._points = [step for step in steps if step.kind == "point"]
        self._live = sys.stderr.isatty()

    def change(self, change: Change, verdict: Verdict | None, where: str) -> None:
        """Print what happened to a step."""
        step, what = change.step, change.what
        if step is None:
            return
        if what == "ready" and not self._auto:
            skip = "" if step.kind == "static" else "s skips, "
            self._say(f"{self._prompt(step, where)}; Enter starts, {skip}q quits.")
        elif what == "countdown" and self._auto:
            self._say(f"{self._prompt(step, where)}.")
        elif what == "recording":
            self._say(f"Recording {step.name}, {step.seconds:g} s.", bell=True)
        elif what == "verdict" and verdict is not None:
            self._say(f"{step.name}: {_figures(verdict)}", bell=True)
            self._say(f"  {'KEEP' if verdict.keep else 'REDO'}: {verdict.reason}")
            if not self._auto:
                accept = "Enter accepts, " if verdict.usable else ""
                skip = "" if step.kind == "static" else "s leaves it out, "
                self._say(f"  {accept}r records it again, {skip}q quits.")
        elif what == "rejected":
            self._say(f"{step.name}: that key does nothing here.")
        elif what in ("accepted", "redo", "skipped", "stopped"):
            self._say(f"{step.name}: {what}.")

    def status(self, status: CalibrationStatus) -> None:
        """Rewrite the last line."""
        parts = [f"{status.step.name} {status.state}"]
        if status.state in ("countdown", "recording"):
            parts.append(f"{max(0.0, status.seconds_left):4.1f} s")
        if status.silence > 1.0:
            parts.append(f"NO FRAME for {status.silence:.0f} s")
        parts.append(f"markers {status.seen}/{status.expected}")
        if math.isfinite(status.hand_speed):
            parts.append(f"hand {status.hand_speed:.2f} m/s")
        if math.isfinite(status.distance):
            parts.append(f"{100 * status.distance:.0f} cm to go: {status.direction}")
        sys.stderr.write(f"\r\x1b[K{'  '.join(parts)}")
        sys.stderr.flush()

    def _prompt(self, step: ProtocolStep, where: str) -> str:
        words = _PROMPTS[step.kind].format(where=f" {where}" if where else " still")
        if step.kind == "point":
            number = self._points.index(step) + 1
            also = _TURN if self._turn else ""
            return f"Point {number} of {len(self._points)}: {words}{also}"
        return words

    def _say(self, sentence: str, *, bell: bool = False) -> None:
        start = "\r\x1b[K" + "\a" * bell if self._live else ""
        sys.stderr.write(f"{start}{sentence}\n")
        sys.stderr.flush()


def _figures(verdict: Verdict) -> str:
    """Measured values of a verdict on one line."""
    values = verdict.values
    found = []
    for name, form in (
        ("markers_seen", "{} markers seen"),
        ("still_percent", "hand steady {:.0f} %"),
        ("samples", "{} samples"),
        ("components", "{} component(s)"),
        ("range_deg", "range {} deg"),
        ("leak_mm_per_c", "leak {} mm per c"),
        ("box_cm", "box {} cm"),
        ("moving_s", "moving {:.0f} s"),
        ("reaches", "{} reach(es)"),
        ("span_cm", "span {} cm"),
        ("spread_mm", "stray {:.1f} mm"),
        ("residual_mm", "residual {:.1f} mm"),
        ("missing_percent", "missing {:.1f} %"),
        ("nearest_cm", "{:.0f} cm from " + str(values.get("nearest"))),
    ):
        value = values.get(name)
        if isinstance(value, list):
            value = " x ".join(f"{v:.0f}" for v in value)
        if value is not None:
            found.append(form.format(value))
    return ", ".join(found) or "nothing to judge"


@contextmanager
def _keys(*, listen: bool) -> Iterator[Callable[[bool], list[Key]]]:
    """Keys from stdin: at once from a terminal, else one at a time when asked.

    The end of stdin counts as quit: no more keys will come.
    """
    if not listen:
        yield lambda waiting: []
        return
    descriptor = sys.stdin.fileno()
    terminal = os.isatty(descriptor)

    def pressed(waiting: bool) -> list[Key]:
        while (waiting or terminal) and select.select([descriptor], [], [], 0)[0]:
            character = os.read(descriptor, 1).decode(errors="replace")
            if not character:
                return ["quit"]
            if character.lower() in _KEYS:
                return [_KEYS[character.lower()]]
        return []

    if not terminal:
        yield pressed
        return
    import termios
    import tty

    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield pressed
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
