"""Writers of TRC files, and of the CSV of Vicon Nexus that this package reads back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ikns.errors import InvalidInput
from ikns.output.file import write_text
from ikns.recording.files.c3d_write import frame_numbers
from ikns.recording.recording import Recording

#: Millimeters per meter.
_MM = 1e3


def write_trc(path: Path, recording: Recording, *, force: bool = False) -> None:
    """Write a TRC file with positions in mm; a marker that was not seen is empty.

    Raises
    ------
    InvalidInput
        When the file exists and `force` is not set, or TRC cannot hold the recording.
    """
    first, rate = _checked(recording)
    n, m = recording.markers.shape[:2]
    names = "\t\t\t".join(recording.labels)
    axes = "\t".join(f"{axis}{i}" for i in range(1, m + 1) for axis in "XYZ")
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\t"
        "OrigDataStartFrame\tOrigNumFrames",
        f"{rate:.10g}\t{rate:.10g}\t{n}\t{m}\tmm\t{rate:.10g}\t{first}\t{n}",
        f"Frame#\tTime\t{names}\t\t",
        f"\t\t{axes}",
        "",
    ]
    for i, row in enumerate(_cells(recording)):
        # OpenSim takes no notice of what follows the last tab, an empty cell say.
        lines.append("\t".join([str(first + i), f"{recording.time[i]:.6f}", *row, ""]))
    write_text(path, "\n".join(lines) + "\n", force=force)


def write_nexus_csv(path: Path, recording: Recording, *, force: bool = False) -> None:
    """Write the trajectories as Vicon Nexus exports them, in mm.

    Raises
    ------
    InvalidInput
        As for :func:`write_trc`.
    """
    first, rate = _checked(recording)
    m = len(recording.labels)
    lines = [
        "Trajectories",
        f"{rate:.10g}",
        ",," + ",,,".join(recording.labels) + ",,",
        "Frame,Sub Frame" + ",X,Y,Z" * m,
        "," + ",mm" * 3 * m,
    ]
    for i, row in enumerate(_cells(recording)):
        lines.append(",".join([str(first + i), "0", *row]))
    write_text(path, "\n".join(lines) + "\n", force=force)


def _checked(recording: Recording) -> tuple[int, float]:
    """Return the first frame's number and the rate; refuse what text cannot hold."""
    for label in recording.labels:
        if not label.strip() or any(c in label for c in "\t\n\r,"):
            raise InvalidInput(
                f"{recording.source}: expected marker labels without tabs, commas and "
                f"line ends, found {label!r}."
            )
    return frame_numbers(recording)


def _cells(recording: Recording) -> list[list[str]]:
    """Return the text of each frame's positions, nanometers exact."""
    flat = _MM * recording.markers.reshape(len(recording.time), -1)
    gaps = np.isnan(recording.markers).any(axis=2).repeat(3, axis=1)
    return [
        ["" if gap else f"{value:.6f}" for value, gap in zip(row, none, strict=True)]
        for row, none in zip(flat, gaps, strict=True)
    ]
