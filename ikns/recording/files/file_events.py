"""Events of a C3D or Qualisys TSV file: moments that somebody named."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ikns.errors import FileError
from ikns.recording.files.c3d_layout import read_layout
from ikns.recording.files.conversion import shown
from ikns.recording.files.table import text_lines


class FileEvent(NamedTuple):
    """A named moment of a recording."""

    name: str
    context: str  # such as Right, Left or General; empty when there is none
    time: float  # s, of the same zero as the frames


def read_c3d_events(path: Path) -> list[FileEvent]:
    """Return the events of a C3D file, by time.

    They are in the parameters of the group EVENT; TIMES holds minutes and seconds.
    """
    layout = read_layout(path)
    names, contexts = layout.texts("EVENT:LABELS"), layout.texts("EVENT:CONTEXTS")
    times = layout.parameters.get("EVENT:TIMES")
    pairs = times if isinstance(times, np.ndarray) else np.empty(0)
    if len(pairs) % 2 or len(pairs) // 2 < len(names):
        raise FileError(
            f"{path}: expected minutes and seconds for {len(names)} events, found "
            f"{len(pairs)} numbers, so the file is damaged."
        )
    contexts += [""] * (len(names) - len(contexts))
    seconds = 60 * pairs[0::2] + pairs[1::2]
    events = zip(names, contexts, map(float, seconds), strict=False)
    return sorted((FileEvent(*each) for each in events), key=lambda event: event.time)


def read_tsv_events(path: Path) -> list[FileEvent]:
    """Return the events of a Qualisys TSV file, by time.

    They are lines of the header: EVENT, name, frame and time.
    """
    events = []
    for line in text_lines(path):
        word, *cells = line.split("\t")
        if word.strip() == "EVENT" and len(cells) >= 3:
            try:
                events.append(FileEvent(cells[0].strip(), "", float(cells[2])))
            except ValueError:
                raise FileError(
                    f"{path}: expected the time of event {shown(cells[0])}, found "
                    f"{shown(cells[2])}."
                ) from None
    return sorted(events, key=lambda event: event.time)


def event_time(path: Path, name: str) -> float:
    """Return when the event of a name happened, s.

    Parameters
    ----------
    path : Path
        A C3D file, or a TSV file of Qualisys.
    name : str
        ``Foot Strike``, or with its context ``Right Foot Strike``, in any case.

    Raises
    ------
    FileError
        When there is none, or several: the sentence has their times.
    """
    reader = {".c3d": read_c3d_events, ".tsv": read_tsv_events}.get(path.suffix.lower())
    if reader is None:
        raise FileError(
            f"{path}: expected a number of seconds, found {shown(name)}; only C3D and "
            f"TSV files have events."
        )
    events = reader(path)
    wanted = " ".join(name.split()).casefold()
    found = [
        event
        for event in events
        if wanted
        in (event.name.casefold(), f"{event.context} {event.name}".strip().casefold())
    ]
    if len(found) == 1:
        return found[0].time
    listed = ", ".join(
        f"{event.context} {event.name} at {event.time:.3f} s".strip()
        for event in (found or events)[:8]
    )
    raise FileError(
        f"{path}: expected one event {shown(name)}, found {listed or 'none'}; "
        f"give the seconds instead."
    )
