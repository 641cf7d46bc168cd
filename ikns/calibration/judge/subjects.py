"""Whether two recordings are of one person and session, by what their files say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ikns.body.marker_set import MarkerSet
from ikns.calibration.judge.finding import Finding
from ikns.recording.recording import Recording

#: Frame rates that differ by less are the same.
_SAME_RATE = 0.01


def other_session(
    static: Recording, recording: Recording, worn: MarkerSet
) -> list[Finding]:
    """Say that subjects or frame rates of two recordings differ."""
    return other_subject(static, recording, worn) + other_rate(static, recording)


def other_rate(static: Recording, recording: Recording) -> list[Finding]:
    """Say that two recordings have different frame rates.

    Markers alone do not show a wrong one: people reach at a quarter to four times the
    usual speed. But cameras keep their rate during a session.
    """
    if min(len(static.time), len(recording.time)) < 2:
        return []
    if abs(recording.rate / static.rate - 1) <= _SAME_RATE:
        return []
    return [
        Finding(
            "rate",
            "warn",
            recording.source,
            f"{recording.rate:.4g} frames per second, but the static trial "
            f"{Path(static.source).name} has {static.rate:.4g}",
            "if the cameras had one rate, correct it in the file: all speeds depend "
            "on it",
        )
    ]


def other_subject(
    static: Recording, recording: Recording, worn: MarkerSet
) -> list[Finding]:
    """Say that two recordings name different subjects before their labels."""
    of, found = subject_names(static, worn), subject_names(recording, worn)
    if not _differ(of, found):
        return []
    return [
        Finding(
            "another person",
            "refuse",
            recording.source,
            f"the markers are those of {' and '.join(found)}, but the static trial "
            f"{Path(static.source).name} is of {' and '.join(of)}",
            "use the static trial of this person",
        )
    ]


def other_than_calibrated(
    report: Mapping[str, Any], recording: Recording, worn: MarkerSet
) -> list[Finding]:
    """Say that a recording names another subject than the one who was calibrated.

    A warning: between sessions a subject may be renamed. `report` is that of the
    calibration.
    """
    static = report.get("static")
    names = static.get("subjects") if isinstance(static, Mapping) else None
    # Folders of before these were kept do not have them.
    of = [str(name) for name in names] if isinstance(names, list) else []
    found = subject_names(recording, worn)
    if not _differ(of, found):
        return []
    return [
        Finding(
            "another person",
            "warn",
            recording.source,
            f"the markers are those of {' and '.join(found)}, but the subject was "
            f"calibrated as {' and '.join(of)}",
            "use the subject folder of this person",
        )
    ]


def subject_names(recording: Recording, worn: MarkerSet) -> list[str]:
    """Return the subjects before the labels of a set's markers, as they are spelled."""
    columns = worn.columns(recording.labels)
    used = [recording.labels[i] for i in columns[columns >= 0]]
    names = [label.rsplit(":", 1)[0] for label in used if ":" in label]
    return sorted({name.casefold(): name for name in sorted(names)}.values())


def _differ(of: Sequence[str], found: Sequence[str]) -> bool:
    """Whether names are known on both sides, and none is the same but for case."""
    one, other = ({name.casefold() for name in names} for names in (of, found))
    return bool(one and other and not one & other)
