"""The BIDS dataset of a session: folders, sidecar files, numbers of runs."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ikns.errors import FileError, InvalidInput, plain
from ikns.live.session.channels import Channel, marker_channels, model_channels
from ikns.live.session.sidecars import (
    EVENTS_ABOUT,
    TASK,
    json_text,
    write_json,
    write_new,
    write_sidecars,
)
from ikns.live.session.writer import RunWriter
from ikns.output.inputs import no_such_folder
from ikns.output.lock import hold_lock

#: Version of the standard that the files follow.
BIDS_VERSION = "1.10.0"
#: Version of the conventions of this package within it.
FORMAT = 1
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
#: Files of the session as a whole.
_SESSION_FILES = (
    "dataset_description.json",
    "README.md",
    "participants.tsv",
    "participants.json",
)
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
    about = {
        "Name": "Intrinsic kinematic null space session",
        "BIDSVersion": BIDS_VERSION,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": "ikns"}],
        "IknsFormat": FORMAT,
    }
    columns = {"participant_id": {"Description": "Pseudonym of the person."}}
    texts = {
        # The first decides between two programs that create it at once.
        "dataset_description.json": json_text(about),
        "README.md": _README,
        "participants.tsv": f"participant_id\nsub-{participant}\n",
        "participants.json": json_text(columns),
    }
    new, made = not place.exists(), []
    try:
        place.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            write_new(place / name, text)
            made.append(place / name)
    except OSError as error:
        with suppress(OSError):
            for path in made:
                path.unlink()
            if new:
                place.rmdir()
        raise _fault(place, error) from None
    return place


@contextmanager
def session_lock(session: str | Path) -> Iterator[None]:
    """Hold a session while a run is recorded; a folder left empty is removed.

    Raises
    ------
    InvalidInput
        When another process records into it.
    FileError
        When the folder is not a session or cannot be written.
    """
    next_run(session)
    place = Path(session)
    try:
        with hold_lock(place / ".lock", "to record a session"):
            yield
    finally:
        with suppress(OSError):  # what is recorded is in it
            place.rmdir()


def discard_run(session: str | Path, number: int, *, whole: bool = False) -> None:
    """Remove a run in which nothing was recorded.

    Parameters
    ----------
    session : str or Path
    number : int
        Of the run; the files of others are left alone.
    whole : bool
        Whether to remove the session, too, if it has no other run.
    """
    place = Path(session)
    participant, _ = next_run(place)
    files = run_files(place, participant, number)
    kept = place / "sourcedata" / f"sub-{participant}" / f"run-{number:02d}"
    shutil.rmtree(kept, ignore_errors=True)
    for path in files.values():
        stem = path.name.removesuffix("_motion.tsv")
        for name in (f"{stem}_channels.tsv", f"{stem}_channels.json", path.name):
            path.with_name(name).unlink(missing_ok=True)
        path.with_suffix(".json").unlink(missing_ok=True)
    for folder in (*files["events"].parents[:2], *kept.parents[:2]):
        with suppress(OSError):  # of another run
            folder.rmdir()
    if whole and next_run(place)[1] == 1:
        for name in _SESSION_FILES:
            (place / name).unlink(missing_ok=True)
        with suppress(OSError):  # something else is in it, its lock say
            place.rmdir()


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
            no_such_folder(place, "a session", "a folder that `ikns run` recorded")
        ) from None
    if version != FORMAT:
        raise FileError(
            f"{place}: expected format version {FORMAT}, found {version!r}; use the "
            "version of ikns that wrote it."
        )
    # A crash may have left the one without the other.
    runs = (
        *place.glob("sub-*/motion/*_events.tsv"),
        *place.glob("sourcedata/sub-*/run-*"),
    )
    numbers = [
        int(found.group(1))
        for path in runs
        if (found := re.search(r"(?:^|_)run-(\d+)(?:_|$)", path.name))
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
        write_json(kept / "configuration.json", configuration)
        for name, text in (subject or {}).items():
            (kept / "subject").mkdir(exist_ok=True)
            write_new(kept / "subject" / name, text)
        for name, channels in columns.items():
            write_sidecars(files[name], name, channels, rate)
            write_new(files[name], "")
        write_json(files["events"].with_suffix(".json"), EVENTS_ABOUT)
        header = "\t".join(channel.name for channel in EVENTS)
        write_new(files["events"], f"{header}\n")
        return RunWriter(
            {name: (files[name], columns[name]) for name in columns}
            | {"events": (files["events"], EVENTS)},
            on_fault=on_fault,
        )
    except (OSError, InvalidInput) as error:
        if not isinstance(error, FileExistsError):  # of another program
            discard_run(place, run)
        if isinstance(error, InvalidInput):
            raise
        raise _fault(place, error) from None


def _fault(place: Path, error: OSError) -> FileError:
    reason = plain(error)
    return FileError(f"{error.filename or place}: cannot be written: {reason}.")
