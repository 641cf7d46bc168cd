"""Whether the labels of a recording are those of the marker set."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches

from ikns.body.marker_set import MarkerSet, label_keys
from ikns.body.set_choice import better_set, match_set, other_set, set_worn
from ikns.calibration.judge.finding import Finding, Severity, say_markers
from ikns.calibration.judge.sides import other_side
from ikns.motion.unseen import unseen_labels, unseen_words
from ikns.recording.recording import Recording

#: With less than this share of a set it is another one.
_ANOTHER = 0.5
#: More labels than this that a set does not have are those of other segments.
_FEW = 4


def judge_labels(
    where: str, labels: Sequence[str], worn: MarkerSet, *, calibrated: bool
) -> list[Finding]:
    """Say that another shipped set fits the labels of a recording better.

    `calibrated` says that the set is that of a person's body, not one to be chosen.
    """
    other = other_set(worn, labels, calibrated=calibrated)
    if other is None:
        return []
    severity: Severity = (
        "refuse" if match_set(worn, labels).share < _ANOTHER else "warn"
    )
    return [Finding("marker set", severity, where, *other)]


def judge_unseen(recording: Recording, worn: MarkerSet) -> list[Finding]:
    """Say which markers of a set are in no frame, and what may be their labels.

    An arm of which nothing is in any frame was left out on purpose. Nothing where
    another set fits better.
    """
    if better_set(worn, recording.labels) is not None:
        return []
    lost = set(unseen_labels(worn, recording))
    for side in ("left_", "right_"):
        arm = {m.label for m in worn.markers if m.link.startswith(side)}
        lost -= arm if arm <= lost else set()
    if not lost:
        return []
    named = [label for label in worn.labels if label in lost]
    others = _unknown(recording.labels, worn)
    found, right = unseen_words(named), "look whether it was worn and labeled"
    alike = _alike(named, [x for x in others if not _of_other_side(x, worn)])
    meant = [
        f"--rename {other.rsplit(':', 1)[-1]}={name}"
        for name, other in alike.items()
        if other
    ]
    if meant:
        known = ", ".join(filter(None, alike.values()))
        found += f", but {known}, which {worn.name} does not have"
        right = f"if they are the same, add {' '.join(meant)}"
    elif 0 < len(others) <= _FEW:
        found += f"; {worn.name} does not have {say_markers(others)}"
        right = "if one of these is meant, rename it with --rename OLD=NEW"
    return [Finding("unseen", "note", recording.source, found, right, tuple(named))]


def _unknown(labels: Sequence[str], worn: MarkerSet) -> list[str]:
    """Labels of a recording that no marker of a set has."""
    # A person's set is without the markers that were taken off after the static trial.
    whole = set_worn(None, worn)
    known = {
        name.casefold()
        for m in (*worn.markers, *whole.markers)
        for name in (m.label, *m.aliases)
    }
    return [label for label in labels if not label_keys([label]) & known]


def _of_other_side(label: str, worn: MarkerSet) -> bool:
    """Whether a label is that of a marker of the set, but for R or L."""
    own = label.rsplit(":", 1)[-1]
    pair = (own, *worn.labels)
    return bool(other_side(pair)[0])


def _alike(names: Sequence[str], labels: Sequence[str]) -> dict[str, str]:
    """Return for each marker a label that is spelled nearly so; empty for none.

    A label answers for one marker only.
    """
    left = {label.rsplit(":", 1)[-1].casefold(): label for label in labels}
    found = {}
    for name in names:
        near = get_close_matches(name.casefold(), left, n=1, cutoff=0.75)
        found[name] = left.pop(near[0]) if near else ""
    return found
