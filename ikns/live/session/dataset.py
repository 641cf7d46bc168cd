"""The BIDS dataset of a session: folders, sidecar files, numbers of runs."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ikns.errors import FileError, InvalidInput
from ikns.live.session.channels import STATES, Channel, marker_channels, model_channels
from ikns.live.session.writer import RunWriter

__all__ = [
    "BIDS_VERSION",
    "EVENTS",
    "FORMAT",
    "TASK",
    "create_session",
    "next_run",
    "open_run",
    "run_files",
]

#: Version of the standard that the files follow.
BIDS_VERSION = "1.10.0"
#: Version of the conventions of this package within it.
FORMAT = 1
TASK = "ikns"
#: Columns of the events file.
EVENTS = (
    Channel("onset", "", "s"),
    Channel("duration", "", "s"),
    Channel("trial_type", "", "n/a", form="%s"),
    Channel("value", "", "n/a", form="%s"),
)

_README = """# A session of ikns

Motion of a person's arm and the resulting control signal, recorded by `ikns run`.
`tracksys-markers` has the recorded markers, `tracksys-model` the joint angles, the
control signal c and the flexion commanded, sent and measured; rows of the two files
correspond. `sourcedata` has the configuration and the subject of each run. `ikns
replay` computes c and the commands again from the markers.
"""
_LABEL = re.compile(r"[0-9A-Za-z]+")


def create_session(folder: str | Path, *, participant: str = "01") -> Path:
    """Create an empty dataset.

    Parameters
    ----------
    folder : str or Path
        Must not exist or be empty.
    participant : str
        Pseudonym of letters and digits; no name, no date of birth.

    Returns
    -------
    Path

    Raises
    ------
    InvalidInput
        When the folder is not empty, or the pseudonym has other characters.
    FileError
        When it cannot be written.
    """
    place = Path(folder)
    if not _LABEL.fullmatch(participant):
        raise InvalidInput(
            f"expected a participant of letters and digits, found '{participant}'."
        )
    if place.exists() and (not place.is_dir() or any(place.iterdir())):
        raise InvalidInput(
            f"{place}: exists already; use --resume to add a run to a session, or "
            "another folder."
        )
    try:
        place.mkdir(parents=True, exist_ok=True)
        _json(
            place / "dataset_description.json",
            {
                "Name": "Intrinsic kinematic null space session",
                "BIDSVersion": BIDS_VERSION,
                "DatasetType": "raw",
                "GeneratedBy": [{"Name": "ikns"}],
                "IknsFormat": FORMAT,
            },
        )
        _text(place / "README.md", _README)
        _text(place / "participants.tsv", f"participant_id\nsub-{participant}\n")
        _json(
            place / "participants.json",
            {"participant_id": {"Description": "Pseudonym of the person."}},
        )
    except OSError as error:
        raise _fault(place, error) from None
    return place


def next_run(session: str | Path) -> tuple[str, int]:
    """Return the participant and the number of the next run.

    Raises
    ------
    FileError
        When the folder is not a session, or of an unknown version.
    """
    place = Path(session)
    try:
        about = json.loads((place / "dataset_description.json").read_text("utf-8"))
        listed = (place / "participants.tsv").read_text("utf-8").split()
        version, participant = about["IknsFormat"], listed[1].removeprefix("sub-")
    except (OSError, ValueError, LookupError, TypeError):
        raise FileError(
            f"{place}: expected a folder that `ikns run` recorded, found none."
        ) from None
    if version != FORMAT:
        raise FileError(
            f"{place}: expected format version {FORMAT}, found {version!r}; use the "
            "version of ikns that wrote it."
        )
    numbers = [
        int(found.group(1))
        for path in place.glob("sub-*/motion/*_events.tsv")
        if (found := re.search(r"_run-(\d+)_", path.name))
    ]
    return participant, max(numbers, default=0) + 1


def run_files(session: Path, participant: str, run: int) -> dict[str, Path]:
    """Paths of a run's files: events, markers, model."""
    motion = session / f"sub-{participant}" / "motion"
    stem = f"sub-{participant}_task-{TASK}"
    return {"events": motion / f"{stem}_run-{run:02d}_events.tsv"} | {
        name: motion / f"{stem}_tracksys-{name}_run-{run:02d}_motion.tsv"
        for name in ("markers", "model")
    }


def open_run(
    session: str | Path,
    *,
    labels: Sequence[str],
    joint_names: Sequence[str],
    rate: float,
    n_dof: int = 1,
    configuration: Mapping[str, Any],
    subject: Mapping[str, str] | None = None,
    on_fault: Callable[[str], None] | None = None,
) -> RunWriter:
    """Start the next run of a session.

    Parameters
    ----------
    session : str or Path
        As from :func:`create_session`.
    labels : sequence of str
        Markers, in the order of their columns.
    joint_names : sequence of str
        Joints, in the order of their columns.
    rate : float
        Nominal frames per second of the source.
    n_dof : int
        Number of control signals.
    configuration : mapping
        Everything needed to compute the run again, as JSON.
    subject : mapping of file name to text, optional
        Files of the subject folder.
    on_fault : callable, optional
        See :class:`RunWriter`.

    Returns
    -------
    RunWriter
        With the files ``markers``, ``model`` and ``events``.

    Raises
    ------
    InvalidInput
        When the rate is not positive or two columns share a name.
    FileError
        When the folder is not a session or cannot be written.
    """
    if not 0 < rate < float("inf"):
        raise InvalidInput(f"expected a positive rate in Hz, found {rate:g}.")
    place = Path(session)
    participant, run = next_run(place)
    files = run_files(place, participant, run)
    columns = {
        "markers": marker_channels(labels),
        "model": model_channels(joint_names, n_dof),
    }
    try:
        files["events"].parent.mkdir(parents=True, exist_ok=True)
        kept = place / "sourcedata" / f"sub-{participant}" / f"run-{run:02d}"
        kept.mkdir(parents=True)
        _json(kept / "configuration.json", configuration)
        for name, text in (subject or {}).items():
            (kept / "subject").mkdir(exist_ok=True)
            _text(kept / "subject" / name, text)
        for name, channels in columns.items():
            _sidecars(files[name], name, channels, rate)
            _text(files[name], "")
        _json(files["events"].with_suffix(".json"), _EVENTS_ABOUT)
        header = "\t".join(channel.name for channel in EVENTS)
        _text(files["events"], f"{header}\n")
        return RunWriter(
            {name: (files[name], columns[name]) for name in columns}
            | {"events": (files["events"], EVENTS)},
            on_fault=on_fault,
        )
    except OSError as error:
        raise _fault(place, error) from None


_EVENTS_ABOUT = {
    "trial_type": {"Description": "What happened."},
    "value": {"Description": "Its reason or size."},
}


def _sidecars(path: Path, name: str, channels: Sequence[Channel], rate: float) -> None:
    kinds = [channel.type for channel in channels]
    names = [channel.name for channel in channels]
    if len(set(names)) < len(names):
        twice = next(n for n in names if names.count(n) > 1)
        raise InvalidInput(f"two columns of the session are called '{twice}'.")
    points = {c.tracked_point for c in channels if c.type == "POS"}
    counts = {
        f"{'Misc' if kind == 'MISC' else kind}ChannelCount": kinds.count(kind)
        for kind in sorted(set(kinds))
    }
    _json(
        path.with_suffix(".json"),
        {
            "TaskName": TASK,
            "TaskDescription": "A wearable robot driven by the arm's null space.",
            "SamplingFrequency": rate,
            "TrackingSystemName": name,
            "MotionChannelCount": len(channels),
            "TrackedPointsCount": len(points),
            "MissingValues": "n/a",
            **counts,
        },
    )
    fields = ("name", "component", "type", "tracked_point", "units", "reference_frame")
    rows = [
        (c.name, c.component, c.type, c.tracked_point, c.units, c.frame)
        for c in channels
    ]
    stem = path.name.removesuffix("_motion.tsv")
    table = "".join("\t".join(row) + "\n" for row in [fields, *rows])
    _text(path.with_name(f"{stem}_channels.tsv"), table)
    # World: as the cameras were calibrated. Thorax: axes of the ISB.
    levels = {
        "world": {"SpatialAxes": "n/a", "RotationRule": "right-hand"},
        "thorax": {"SpatialAxes": "ASR", "RotationRule": "right-hand"},
    }
    used = {c.frame for c in channels} & set(levels)
    about: dict[str, Any] = {
        "reference_frame": {
            "Levels": {
                frame: {"RotationOrder": "n/a", **levels[frame]}
                for frame in sorted(used)
            }
        }
    }
    if "state" in names:
        about["state"] = {"Levels": {str(k): s for k, s in enumerate(STATES)}}
    _json(path.with_name(f"{stem}_channels.json"), about)


def _json(path: Path, value: Mapping[str, Any]) -> None:
    _text(path, json.dumps(value, indent=1, allow_nan=False) + "\n")


def _text(path: Path, text: str) -> None:
    """Write a new file and sync it to the disk."""
    with path.open("x", encoding="utf-8", newline="") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())


def _fault(place: Path, error: OSError) -> FileError:
    reason = (error.strerror or str(error)).lower()
    return FileError(f"{error.filename or place}: cannot be written: {reason}.")
