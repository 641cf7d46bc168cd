"""Hand entries to Rerun: into a file, or to a viewer on this machine."""

from __future__ import annotations

import importlib
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ikns.errors import InvalidInput
from ikns.output.file import refuse_overwriting
from ikns.view.timeline.entries import Entry, Lines, Points

_REMEDY = "pip install 'ikns[rerun]' (170 MB to load, 500 MB on disk)"
#: How long the viewer has to open its window, s.
_OPENING = 20.0
#: Without a screen it listens all the same, and ends shortly after, s.
_SETTLING = 1.0
_MARKER_RADIUS, _ARM_RADIUS, _RESIDUAL_RADIUS = 0.007, 0.01, 0.002  # m
_ARM, _RESIDUAL = (159, 169, 184), (204, 51, 17)
TIMELINE = "time"


class RerunLog:
    """A recording of Rerun; everything is on one timeline, seconds from 0.

    Parameters
    ----------
    file : Path or None
        File to write, with the ending .rrd; None opens a viewer.
    title : str
        As the viewer shows it.
    force : bool, optional
        Whether the file may be replaced.

    Raises
    ------
    InvalidInput
        When Rerun is not installed, the file cannot be written, or no viewer opens.
    """

    def __init__(
        self, file: Path | None, *, title: str, force: bool | None = None
    ) -> None:
        if file is not None:
            check_rrd(file, force=force)
        self._rerun = load_rerun()
        viewer = _viewer() if file is None else ""
        self._recording = self._rerun.RecordingStream("ikns")
        if viewer:
            self._recording.connect_grpc(viewer)
        else:
            self._recording.save(str(file))
        self._recording.send_recording_name(title)
        self._names: tuple[str, ...] = ()
        self._style()

    def frame(self, at: float, entries: Mapping[str, Entry]) -> None:
        """Log what a frame shows at a time, s."""
        rr, recording = self._rerun, self._recording
        recording.set_time(TIMELINE, duration=at)
        for path, entry in entries.items():
            if isinstance(entry, Points):
                named = {}  # names stay until there are others
                if entry.names != self._names:
                    named["labels"] = list(entry.names)
                    self._names = entry.names
                thing = rr.Points3D.from_fields(positions=entry.places, **named)
            elif isinstance(entry, Lines):
                strips: Any = entry.strips
                if isinstance(strips, tuple):
                    strips = list(strips)
                thing = rr.LineStrips3D.from_fields(strips=strips)
            else:
                thing = rr.Scalars(entry)
            recording.log(path, thing)

    def _style(self) -> None:
        """Log sizes and colors once: with each frame they took six times as long."""
        rr, log = self._rerun, self._recording.log
        points = rr.Points3D.from_fields(radii=_MARKER_RADIUS, show_labels=False)
        log("world/markers", points, static=True)
        for path, radius, color in (
            ("world/arms", _ARM_RADIUS, _ARM),
            ("world/residuals", _RESIDUAL_RADIUS, _RESIDUAL),
        ):
            lines = rr.LineStrips3D.from_fields(radii=radius, colors=[color])
            log(path, lines, static=True)

    def event(self, at: float, words: str) -> None:
        """Log an event at a time, s."""
        self._recording.set_time(TIMELINE, duration=at)
        self._recording.log("events", self._rerun.TextLog(words))

    def close(self) -> None:
        """Write what is left."""
        self._recording.flush()
        self._recording.disconnect()


def check_rrd(
    file: Path,
    *,
    force: bool | None = None,
    inputs: Iterable[Path | None] = (),
) -> None:
    """Check the name of a file to write.

    Parameters
    ----------
    file : Path
    force : bool, optional
        Whether it may be replaced; None where no one can say so.
    inputs : iterable of Path or None
        What is read, and never replaced.

    Raises
    ------
    InvalidInput
        When it lacks the ending, exists, or its folder does not.
    """
    if file.suffix.lower() != ".rrd":
        raise InvalidInput(
            f"{file}: expected a file with the ending .rrd, found '{file.suffix}'."
        )
    if force is None and os.path.lexists(file):
        raise InvalidInput(f"{file}: exists already; name another file.")
    refuse_overwriting(file, force=bool(force), inputs=inputs)


def load_rerun() -> Any:
    """Import the library, or say what to install."""
    try:
        return importlib.import_module("rerun")
    except (ImportError, OSError) as error:
        why = "" if isinstance(error, ModuleNotFoundError) else f" ({error})"
        raise InvalidInput(f"--rerun and --rrd need rerun{why}; {_REMEDY}.") from None


def _viewer() -> str:
    """Open a viewer that listens to this machine only; return its address.

    Rerun's own ``spawn`` listens to every network.
    """
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    # It stays when this program ends.
    process = subprocess.Popen(
        [sys.executable, "-m", "rerun", "--bind", "127.0.0.1", "--port", str(port)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    give_up = time.monotonic() + _OPENING
    while time.monotonic() < give_up and process.poll() is None:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
        except OSError:
            time.sleep(0.05)
        else:
            time.sleep(_SETTLING)
            if process.poll() is None:
                return f"rerun+http://127.0.0.1:{port}/proxy"
    process.kill()
    raise InvalidInput(
        "--rerun: expected Rerun's viewer to open, but it did not, perhaps for lack of "
        "a screen; write a file with --rrd FILE.rrd and open it elsewhere."
    )
