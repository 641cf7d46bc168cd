"""Writes a simulated protocol: C3D files, with the truth next to them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ikns.body.chains import SIDES
from ikns.errors import FileError
from ikns.recording.files import write_c3d
from ikns.simulation.protocol import Protocol
from ikns.simulation.trial import Trial

_FORMAT = 1


def write_protocol(
    folder: str | Path, protocol: Protocol, *, force: bool = False
) -> list[Path]:
    """Write ``static.c3d``, ``free.c3d`` and ``points.c3d`` with their truth.

    Each recording has a file ``<name>_truth.csv``: time (s), joint angles (deg), swivel
    of each exploring elbow (deg) and position of its hand in the thorax frame (mm), and
    the point (-1 during reaches). ``truth.json`` has the person, segment lengths (m),
    positions of the markers in their links (m), points (m) and all settings;
    ``truth.urdf`` is the body.

    Parameters
    ----------
    folder : str or Path
        Created if missing.
    protocol : Protocol
        From :func:`ikns.simulate_protocol`.
    force : bool
        Whether to replace existing files.

    Returns
    -------
    list of Path
        The three recordings: static, free, points.

    Raises
    ------
    FileError
        When a file exists and `force` is false, or the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from ikns import read, simulate_protocol, virtual_subject, write_protocol
    >>> run = simulate_protocol(virtual_subject(1), seed=1, n_points=1, quick=True)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     static, free, points = write_protocol(folder, run)
    ...     len(read(static).labels), static.name, points.name
    (24, 'static.c3d', 'points.c3d')
    """
    folder = Path(folder)
    recordings = [folder / f"{trial.name}.c3d" for trial in protocol.trials]
    tables = [folder / f"{trial.name}_truth.csv" for trial in protocol.trials]
    body, summary = folder / "truth.urdf", folder / "truth.json"
    for path in (*recordings, *tables, body, summary):
        if path.exists() and not force:
            raise FileError(f"{path}: the file exists already and was not replaced.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for trial, recording, table in zip(
            protocol.trials, recordings, tables, strict=True
        ):
            write_c3d(recording, trial.recording, force=force)
            _write_table(table, trial, protocol.side)
        protocol.subject.skeleton.write(body)
        text = json.dumps(_summary(protocol), indent=2) + "\n"
        summary.write_text(text, encoding="utf-8")
    except OSError as error:
        raise FileError(f"{folder}: cannot be written: {error}.") from None
    return recordings


def _write_table(path: Path, trial: Trial, side: str) -> None:
    truth = trial.truth
    sides = SIDES if side == "both" else (side,)
    hands = truth.hand_in_thorax[:, [SIDES.index(name) for name in sides]]
    header = ["time_s", *(f"{joint}_deg" for joint in truth.joint_names)]
    header += [f"{name}_swivel_deg" for name in sides]
    header += [f"{name}_hand_{axis}_mm" for name in sides for axis in "xyz"] + ["point"]
    columns = np.column_stack(
        [
            truth.time,
            np.degrees(truth.angles),
            np.degrees(trial.swivel),
            1000 * hands.reshape(len(hands), -1),
            trial.point,
        ]
    )
    formats = ["%.4f"] + ["%.6f"] * (columns.shape[1] - 2) + ["%d"]
    np.savetxt(
        path, columns, fmt=formats, delimiter=",", header=",".join(header), comments=""
    )


def _summary(protocol: Protocol) -> dict[str, object]:
    subject, adult = protocol.subject, protocol.subject.adult
    markers = subject.skeleton.marker_set.markers
    return {
        "format": _FORMAT,
        "simulated": True,
        "person": {
            "seed": subject.seed,
            "sex": adult.sex,
            "stature_m": adult.stature_m,
            "mass_kg": adult.mass_kg,
        },
        "marker_set": subject.marker_set,
        "side": protocol.side,
        "segment_lengths_m": subject.skeleton.segment_lengths,
        "marker_positions_m": {m.label: list(m.position) for m in markers},
        "points_in_thorax_m": protocol.places.tolist(),
        "settings": protocol.settings,
    }
