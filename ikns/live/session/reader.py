"""Read the runs of a session, including one that ended within a row."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ikns.arrays import Array
from ikns.errors import FileError, plain, unreadable
from ikns.live.session.dataset import next_run, run_files


@dataclass(frozen=True, eq=False)
class Run:
    """One run of a session.

    Parameters
    ----------
    session : Path
    participant : str
    number : int
    rate : float
        Nominal frames per second of the source.
    labels : tuple of str
        Marker names.
    frame : (T,) integer array
        Frame numbers of the source.
    device_time, receive_time : (T,) array
        s, see :func:`ikns.live.session.marker_channels`.
    markers : (T, M, 3) array
        m in the world; NaN = not seen.
    model : dict of (T,) arrays
        Columns of the model file by name, in the units of their channels.
    events : list of (onset, duration, type, value)
        Onset and duration in s.
    configuration : dict
    torn : dict of str to int
        Bytes after the last complete row of each file, left by a crash.
    """

    session: Path
    participant: str
    number: int
    rate: float
    labels: tuple[str, ...]
    frame: NDArray[np.int64]
    device_time: Array
    receive_time: Array
    markers: Array
    model: dict[str, Array]
    events: list[tuple[float, float, str, str]]
    configuration: dict[str, Any]
    torn: dict[str, int]

    @property
    def subject_folder(self) -> Path:
        """Folder of the run's subject."""
        return _kept(self.session, self.participant, self.number) / "subject"


def runs(session: str | Path) -> list[int]:
    """Numbers of the runs of a session."""
    participant, following = next_run(session)
    return [
        number
        for number in range(1, following)
        if run_files(Path(session), participant, number)["events"].is_file()
    ]


def read_run(session: str | Path, number: int | None = None) -> Run:
    """Read one run, by default the last one.

    If a crash left one motion file longer than the other, both are cut to the shorter.

    Raises
    ------
    FileError
        When there is no such run, or a file is missing or damaged.

    Examples
    --------
    >>> import tempfile
    >>> from ikns.live.session import create_session, open_run
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     session = create_session(folder)
    ...     about = {"labels": ["C7"], "joint_names": [], "rate": 100.0}
    ...     with open_run(session, configuration={}, **about) as writer:
    ...         writer.row("markers", [0, 0.0, 0.0, 0.1, 0.2, 0.3])
    ...         writer.row("model", [math.nan] * 22)
    ...     run = read_run(session)
    >>> run.rate, run.markers.tolist()
    (100.0, [[[0.1, 0.2, 0.3]]])
    """
    place = Path(session)
    participant, _ = next_run(place)
    known = runs(place)
    chosen = known[-1] if number is None and known else number
    if chosen is None or chosen not in known:
        listed = ", ".join(map(str, known)) or "none"
        wanted = "a run" if number is None else f"run {number}"
        raise FileError(f"{place}: expected {wanted}, found {listed}.")
    files = run_files(place, participant, chosen)
    torn: dict[str, int] = {}
    tables = {}
    for name in ("markers", "model"):
        names = _channel_names(files[name])
        tables[name] = (names, *_table(files[name], len(names)))
        torn[name] = tables[name][2]
    rows = min(len(table) for _, table, _ in tables.values())
    names, seen, _ = tables["markers"]
    seen = seen[:rows]
    labels = tuple(name.removesuffix("_x") for name in names[3::3])
    events, torn["events"] = _events(files["events"])
    kept = _kept(place, participant, chosen) / "configuration.json"
    about = _json(files["markers"].with_suffix(".json"))
    if not np.isfinite(seen[:, 0]).all():
        raise FileError(f"{files['markers']}: a row has no frame number.")
    return Run(
        session=place,
        participant=participant,
        number=chosen,
        rate=float(about.get("SamplingFrequency", math.nan)),
        labels=labels,
        frame=seen[:, 0].astype(np.int64),
        device_time=seen[:, 1],
        receive_time=seen[:, 2],
        markers=seen[:, 3:].reshape(rows, len(labels), 3),
        model=dict(zip(tables["model"][0], tables["model"][1][:rows].T, strict=True)),
        events=events,
        configuration=_json(kept),
        torn=torn,
    )


def _kept(session: Path, participant: str, number: int) -> Path:
    return session / "sourcedata" / f"sub-{participant}" / f"run-{number:02d}"


def _channel_names(motion: Path) -> list[str]:
    path = motion.with_name(motion.name.replace("_motion.tsv", "_channels.tsv"))
    lines = _whole_lines(path)[0]
    if not lines or lines[0].split("\t")[0] != "name":
        raise FileError(
            f"{path}: expected a table of channels that starts with 'name'."
        )
    return [line.split("\t")[0] for line in lines[1:]]


def _table(path: Path, width: int) -> tuple[Array, int]:
    lines, torn = _whole_lines(path)
    table = np.empty((len(lines), width))
    for i, line in enumerate(lines):
        cells = line.split("\t")
        try:
            if len(cells) != width:
                raise ValueError(f"{len(cells)} cells")
            table[i] = [math.nan if cell == "n/a" else float(cell) for cell in cells]
        except ValueError as error:
            raise FileError(
                f"{path}: row {i + 1}: expected {width} numbers or n/a, found {error}."
            ) from None
    return table, torn


def _events(path: Path) -> tuple[list[tuple[float, float, str, str]], int]:
    lines, torn = _whole_lines(path)
    events = []
    for i, line in enumerate(lines[1:], start=2):
        try:
            onset, duration, what, value = line.split("\t")
            length = math.nan if duration == "n/a" else float(duration)
            events.append((float(onset), length, what, value))
        except ValueError:
            raise FileError(
                f"{path}: row {i}: expected onset, duration, type and value, found "
                f"'{line}'."
            ) from None
    return events, torn


def _whole_lines(path: Path) -> tuple[list[str], int]:
    """Return complete lines, and the number of bytes after them."""
    try:
        data = path.read_bytes()
    except OSError as error:
        reason = plain(error)
        raise FileError(f"{path}: cannot be read: {reason}.") from None
    end = data.rfind(b"\n") + 1
    try:
        text = data[:end].decode("utf-8")
    except UnicodeDecodeError:
        raise FileError(f"{path}: expected UTF-8 text, found other bytes.") from None
    return re.split("\n", text)[:-1], len(data) - end


def _json(path: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text("utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise unreadable(path, error, "JSON") from None
