"""Checks beyond those of the BIDS validator, and repair after a crash."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ikns.errors import FileError
from ikns.live.session.dataset import next_run, run_files
from ikns.live.session.reader import Run, read_run, runs


def check_session(session: str | Path) -> list[str]:
    """Check a session for faults: rows, times, ranges, personal data.

    Parameters
    ----------
    session : str or Path

    Returns
    -------
    list of str
        One sentence per fault; empty if there is none.

    Raises
    ------
    FileError
        When the folder is not a session.
    """
    place = Path(session)
    next_run(place)
    found = _personal_data(place)
    for number in runs(place):
        try:
            run = read_run(place, number)
        except FileError as error:
            found.append(str(error))
        else:
            found += [f"run {number}: {finding}" for finding in _faults(run)]
    if not runs(place):
        found.append("the session has no run.")
    return found


def mend_session(session: str | Path) -> list[str]:
    """Cut off incomplete rows, and rows missing in the other file, after a crash.

    Returns
    -------
    list of str
        What was cut off, one sentence per file.
    """
    place, done = Path(session), []
    participant, _ = next_run(place)
    for number in runs(place):
        files = run_files(place, participant, number)
        whole = {name: path.read_bytes() for name, path in files.items()}
        whole = {name: data[: data.rfind(b"\n") + 1] for name, data in whole.items()}
        rows = min(whole[name].count(b"\n") for name in ("markers", "model"))
        for name, path in files.items():
            data = whole[name]
            if name != "events":
                data = b"".join(data.splitlines(keepends=True)[:rows])
            cut = path.stat().st_size - len(data)
            if cut:
                with path.open("r+b") as file:
                    file.truncate(len(data))
                done.append(f"{path.name}: {cut} bytes cut.")
    return done


def _personal_data(place: Path) -> list[str]:
    lines = (place / "participants.tsv").read_text("utf-8").splitlines()
    extra = [column for column in lines[0].split("\t") if column != "participant_id"]
    if extra:
        return [f"participants.tsv contains more than a pseudonym: {', '.join(extra)}."]
    return []


def _faults(run: Run) -> list[str]:
    found = [
        f"the file of {name} ends in the middle of a row ({size} bytes); mend it."
        for name, size in run.torn.items()
        if size
    ]
    participant = run.participant
    files = run_files(run.session, participant, run.number)
    rows = {
        name: files[name].read_bytes().count(b"\n") for name in ("markers", "model")
    }
    if rows["markers"] != rows["model"]:
        found.append(
            f"{rows['markers']} rows of markers, but {rows['model']} of the model."
        )
    for name in ("device_time", "receive_time"):
        time = getattr(run, name)
        if not np.isfinite(time).all():
            found.append(f"{name} is missing in {np.sum(~np.isfinite(time))} rows.")
    if not (np.diff(run.receive_time) >= 0).all():
        found.append("receive_time goes backward.")
    for name, sent in run.model.items():
        beyond = np.sum((sent < 0) | (sent > 1)) if name.endswith("_sent") else 0
        if beyond:
            found.append(f"{name} is outside 0 to 1 in {beyond} rows.")
    early = [onset for onset, *_ in run.events if not onset >= 0]
    if early:
        found.append(f"{len(early)} events have no onset.")
    if not run.subject_folder.is_dir():
        found.append("the subject that the run was made with is missing.")
    return found
