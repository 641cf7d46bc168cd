"""Other names for the markers of a recording."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from ikns.errors import FileError, InvalidInput, unreadable
from ikns.recording.recording import Recording


def renamed(recording: Recording, names: Mapping[str, str]) -> Recording:
    """Return the recording with markers renamed, all at the same time.

    Parameters
    ----------
    recording : Recording
    names : mapping
        New label by old one, in any case. A subject's name before the label stays
        (``Ann:RELB`` becomes ``Ann:RLEP``). Labels that the recording does not have are
        passed over: see :func:`unused_names`.

    Raises
    ------
    InvalidInput
        When two markers would have one name.

    Examples
    --------
    >>> import numpy as np
    >>> swapped = Recording([0.0], np.ones((1, 2, 3)), ["RWRB", "RWRA"])
    >>> renamed(swapped, {"RWRA": "RWRB", "RWRB": "RWRA"}).labels
    ('RWRA', 'RWRB')
    """
    labels = new_labels(recording.labels, names, source=recording.source)
    return Recording(
        recording.time,
        recording.markers,
        labels,
        recording.source,
        recording.notes,
    )


def new_labels(
    given: Sequence[str], names: Mapping[str, str], *, source: str
) -> list[str]:
    """Return labels after a renaming, as for :func:`renamed`."""
    new = {old.strip().casefold(): name.strip() for old, name in names.items()}
    labels = []
    for label in given:
        subject, colon, own = label.rpartition(":")
        whole, bare = label.strip().casefold(), own.strip().casefold()
        if whole in new and colon:
            labels.append(new[whole])
        else:
            labels.append(f"{subject}{colon}{new[bare]}" if bare in new else label)
    taken: dict[str, str] = {}
    for label, was in zip(labels, given, strict=True):
        if (other := taken.setdefault(label.casefold(), was)) != was:
            raise InvalidInput(
                f"{source}: expected one marker to become {label}, found "
                f"{other} and {was}; give the other one another name too."
            )
    return labels


def unused_names(labels: Iterable[str], names: Mapping[str, str]) -> list[str]:
    """Old labels that none of these are, with or without the name of a subject."""
    known = {label.strip().casefold() for label in labels}
    known |= {label.rpartition(":")[2] for label in known}
    return [old for old in names if old.strip().casefold() not in known]


def name_pairs(
    texts: Iterable[str], *, where: str, form: str = "OLD=NEW"
) -> dict[str, str]:
    """Read ``OLD=NEW`` from each text; errors name the source `where`, and the `form`.

    >>> name_pairs(["RELBL=RELB", " Elbow med = RMEP "], where="--rename")
    {'RELBL': 'RELB', 'Elbow med': 'RMEP'}
    """
    pairs: dict[str, str] = {}
    for text in texts:
        old, equals, new = (part.strip() for part in text.partition("="))
        if not (old and equals and new) or "=" in new:
            shown = text.strip()[:40].encode("utf-8", "backslashreplace").decode()
            raise InvalidInput(f"{where}: expected {form}, found '{shown}'.")
        if old in pairs:
            raise InvalidInput(f"{where}: expected one new name for {old}, found two.")
        pairs[old] = new
    return pairs


def read_name_pairs(path: Path, *, form: str = "OLD=NEW") -> dict[str, str]:
    """Read a text file with a line ``OLD=NEW`` for each marker; # starts a comment.

    Errors call such a line by its `form`.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise unreadable(path, error, "text") from None
    lines = [line.partition("#")[0] for line in lines]
    if not any(line.strip() for line in lines):
        raise FileError(f"{path}: expected a line {form} for each marker, found none.")
    try:
        given = (line for line in lines if line.strip())
        return name_pairs(given, where=str(path), form=form)
    except InvalidInput as error:
        raise FileError(str(error)) from None
