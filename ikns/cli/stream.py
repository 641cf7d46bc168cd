"""``ikns stream``: replay a recording as a live LSL stream, for tests."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from ikns.cli.options import AsJson, RecordingFile
from ikns.cli.output import show, table
from ikns.cli.reading import Read, reads_markers

if TYPE_CHECKING:
    from ikns.live.stream import LslOutlet


@reads_markers
def stream(
    read: Read,
    recording: RecordingFile,
    name: Annotated[
        str | None, typer.Option(help="Name of the stream. Default: that of the file.")
    ] = None,
    speed: Annotated[
        float, typer.Option(help="Playback speed; 1 is as recorded.")
    ] = 1.0,
    loop: Annotated[bool, typer.Option("--loop", help="Repeat until Ctrl-C.")] = False,
    fault: Annotated[
        str,
        typer.Option(
            help="Faults with their probability per frame, such as drop=0.01,swap=0.1; "
            "also repeat, and with seconds late and freeze: late=0.001:0.3."
        ),
    ] = "",
    seed: Annotated[int, typer.Option(help="Seed of the faults.")] = 0,
    wait: Annotated[
        float,
        typer.Option(
            help="Seconds to wait for the first listener.", min=0.0, max=86400.0
        ),
    ] = 3600.0,
    everywhere: Annotated[
        bool,
        typer.Option(
            "--everywhere", help="Also serve other machines. Markers are personal data."
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Serve a recording as a live LSL MoCap stream, on this machine only."""
    from ikns.errors import InvalidInput, StreamError
    from ikns.live.stream import Faults, LslOutlet, broadcast

    faults = Faults.parse(fault)
    if seed < 0:
        raise InvalidInput(f"--seed must be 0 or more, found {seed}.")
    frames = read(recording)
    if len(frames.time) < 2:
        raise InvalidInput(
            f"{recording}: expected at least two frames to determine a rate, found "
            f"{len(frames.time)}."
        )
    title = recording.stem if name is None else name
    rate = frames.rate * speed
    with LslOutlet(frames.labels, rate, name=title, everywhere=everywhere) as outlet:
        _print_progress(
            f"lsl:{title} has {len(frames.labels)} markers at {rate:g} frames/s."
        )
        if outlet.open_ports:
            _print_progress("other machines can reach its ports, too.")
        if not _has_listener(outlet, wait):
            raise StreamError(f"lsl:{title}: no one listened within {wait:g} s.")
        sent = broadcast(
            frames, outlet, speed=speed, loop=loop, faults=faults, seed=seed
        )
    late = {f"p{p:g}": 1e3 * sent.lateness.percentile(p) for p in (50, 99)}
    late["largest"] = 1e3 * sent.lateness.largest
    show(
        {
            "recording": recording,
            "stream": title,
            "rate": rate,
            "frames": sent.frames,
            "seconds": sent.seconds,
            "faults": dict(sent.faults),
            "sent_late_ms": late,
        },
        table(
            f"lsl:{title}",
            {"quantity": "s", "value": "g"},
            [
                ["frames sent", sent.frames],
                ["seconds", round(sent.seconds, 1)],
                *([f"fault: {kind}", n] for kind, n in sorted(sent.faults.items())),
                *([f"sent late, ms, {p}", round(ms, 3)] for p, ms in late.items()),
            ],
        ),
        as_json=as_json,
    )


def _has_listener(outlet: LslOutlet, wait: float) -> bool:
    """Wait for a listener, in steps so that Ctrl-C works."""
    import time

    deadline = time.monotonic() + wait
    while time.monotonic() < deadline:
        if outlet.wait_for_listener(min(0.2, wait)):
            return True
    return False


def _print_progress(sentence: str) -> None:
    """Print progress on a terminal's stderr; stdout is for the result."""
    if sys.stderr.isatty():
        sys.stderr.write(f"{sentence}\n")
