"""Whose recordings these are, by the subject that stands before a label."""

from __future__ import annotations

from ikns.body.marker_set import MarkerSet
from ikns.calibration.judge.finding import Finding
from ikns.recording.recording import Recording


def other_subject(
    static: Recording, recording: Recording, worn: MarkerSet
) -> list[Finding]:
    """Say that two recordings name different subjects before their labels."""
    names = [_prefixes(one, worn) for one in (static, recording)]
    if not all(names) or names[0] & names[1]:
        return []
    of, found = (" and ".join(sorted(name)) for name in names)
    return [
        Finding(
            "another person",
            "refuse",
            recording.source,
            f"the markers are those of {found}, but the static trial {static.source} "
            f"is of {of}",
            "use the static trial of this person",
        )
    ]


def _prefixes(recording: Recording, worn: MarkerSet) -> set[str]:
    columns = worn.columns(recording.labels)
    used = [recording.labels[i] for i in columns[columns >= 0]]
    return {label.rsplit(":", 1)[0].casefold() for label in used if ":" in label}
