"""Whether a subject or a recording is known to be simulated."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from ikns.calibration.subject import Subject

__all__ = ["is_simulated"]


def is_simulated(
    subject: Subject, folder: Path, recordings: Sequence[Path] = ()
) -> bool:
    """Whether the subject or one of the recordings is known to be simulated.

    The calibration's report may say so, the ``summary.json`` of ``ikns demo`` next to
    the folder that the subject was read from, or the ``truth.json`` next to a simulated
    recording.
    """
    places = [folder.absolute().parent / "summary.json"]
    places += [path.absolute().parent / "truth.json" for path in recordings]
    return bool(subject.report.get("simulated")) or any(map(_says_simulated, places))


def _says_simulated(path: Path) -> bool:
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(about, dict) and about.get("simulated") is True
