"""Whether a virtual subject is behind what a command was given."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import ikns

__all__ = ["is_simulated"]


def is_simulated(
    subject: ikns.Subject, folder: Path, recordings: Sequence[Path] = ()
) -> bool:
    """Whether the subject or one of the recordings is known to be simulated.

    A calibration may say so itself; `ikns demo` says so in the ``summary.json`` beside
    the subject's folder, and simulated recordings have a ``truth.json`` beside them.
    """
    told = [folder.absolute().parent / "summary.json"]
    told += [path.absolute().parent / "truth.json" for path in recordings]
    return bool(subject.report.get("simulated")) or any(map(_says_so, told))


def _says_so(path: Path) -> bool:
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(about, dict) and about.get("simulated") is True
