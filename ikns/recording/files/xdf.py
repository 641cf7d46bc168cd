"""XDF, the file in which LabRecorder keeps LSL streams.

The library pyxdf reads it: it brings the clocks of several computers together and takes
the jitter out of the time stamps.
"""

from __future__ import annotations

import importlib
import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ikns.errors import FileError, InvalidInput
from ikns.recording.files.conversion import existing_file, shown, to_recording
from ikns.recording.files.lsl_channels import MarkerChannels, marker_channels
from ikns.recording.recording import Recording

#: Types of LSL streams that hold markers, compared without regard to case.
_TYPES = ("mocap", "markerset", "position")


def read_xdf(path: Path, stream: str | None = None) -> Recording:
    """Read the marker stream of an XDF file; its first sample is at 0 s.

    Parameters
    ----------
    path : Path
    stream : str, optional
        Name of the stream, where there are several with markers.

    Raises
    ------
    FileError
        When pyxdf is not installed, the file is damaged, or not exactly one stream
        fits; the sentence names those that there are.
    """
    existing_file(path)
    try:
        pyxdf = importlib.import_module("pyxdf")
    except ImportError:
        raise FileError(
            f"{path}: reading XDF files needs pyxdf; install it with "
            f"pip install 'ikns[xdf]'."
        ) from None
    with _complaints() as said:
        try:
            with path.open("rb") as file:
                found = pyxdf.load_xdf(file)[0]
        # The library raises whatever a damaged byte leads to.
        except Exception as error:
            raise FileError(
                f"{path}: it cannot be read as an XDF file "
                f"({shown(f'{type(error).__name__}: {error}')})."
            ) from None
        notes = [f"pyxdf said: {shown(said[0])}."] if said else []
    chosen, channels = _marker_stream(path, found, stream)
    samples = np.asarray(chosen["time_series"])
    if samples.ndim != 2 or samples.dtype.kind not in "fiu":
        samples = np.empty((0, 1 + int(channels.columns.max())))
    time = np.asarray(chosen["time_stamps"], dtype=np.float64)
    if len(time) != len(samples) or samples.shape[1] <= channels.columns.max():
        raise FileError(
            f"{path}: expected a time and {channels.columns.max() + 1} values for "
            f"every sample, found {len(time)} times and values {samples.shape}."
        )
    return to_recording(
        path,
        time - time[:1],
        channels.markers(samples.astype(np.float64)),
        channels.labels,
        unit="stated in the stream",
        notes=notes,
    )


def _marker_stream(
    path: Path, streams: list[dict[str, Any]], wanted: str | None
) -> tuple[dict[str, Any], MarkerChannels]:
    """Return the only stream with markers, or the one of that name."""
    fitting, faults = [], []
    for each in streams:
        info = each["info"]
        name, kind = _text(info, "name"), _text(info, "type")
        if wanted is not None and name != wanted:
            continue
        try:
            channels = marker_channels(_channels(info))
        except InvalidInput as fault:
            if wanted is not None or kind.casefold() in _TYPES:
                faults.append(f"stream {shown(name)}: {fault}")
        else:
            fitting.append((name, each, channels))
    if len(fitting) == 1:
        return fitting[0][1], fitting[0][2]
    if fitting:
        names = ", ".join(shown(name) for name, *_ in fitting)
        raise FileError(
            f"{path}: expected one stream with markers, found {len(fitting)}: {names}; "
            f"choose one with --stream."
        )
    if faults:
        raise FileError(f"{path}: {faults[0]}")
    known = ", ".join(
        f"{shown(_text(each['info'], 'name'))} of type "
        f"{shown(_text(each['info'], 'type'))}"
        for each in streams
    )
    what = "with markers" if wanted is None else f"named {shown(wanted)}"
    raise FileError(f"{path}: expected a stream {what}, found {known or 'none'}.")


def _channels(info: Mapping[str, Any]) -> list[dict[str, str]]:
    """Return the described channels; pyxdf makes a list of every XML element."""
    found: Any = info
    for key in ("desc", "channels"):
        found = (found.get(key) or [None])[0] or {}
        if not isinstance(found, Mapping):
            return []
    fields = ("label", "type", "marker", "object", "unit")
    return [
        {field: _text(channel, field) for field in fields}
        for channel in found.get("channel") or []
        if isinstance(channel, Mapping)
    ]


def _text(entry: Mapping[str, Any], key: str) -> str:
    value = (entry.get(key) or [""])[0]
    return value if isinstance(value, str) else ""


@contextmanager
def _complaints() -> Iterator[list[str]]:
    """Collect what pyxdf logs as warnings instead of printing it."""
    said: list[str] = []

    class _Collecting(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            said.append(record.getMessage())

    logger = logging.getLogger("pyxdf")
    handler = _Collecting(logging.WARNING)
    before = logger.propagate
    logger.addHandler(handler)
    logger.propagate = False
    try:
        yield said
    finally:
        logger.removeHandler(handler)
        logger.propagate = before
