"""Which visit ``ikns track`` and ``ikns pick`` conduct, and with which design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ikns.errors import InvalidInput


@dataclass(frozen=True)
class VisitIdentity:
    """Folder, participant and study of a visit.

    Parameters
    ----------
    folder : Path
    experiment : "tracking" or "picking"
    participant : str
    number : int
        Of the participant, from 0; it sets the order of conditions and trials.
    stored : dict
        ``visit.json`` of a visit that is resumed; empty for a new one.
    study : Study or None
    """

    folder: Path
    experiment: Literal["tracking", "picking"]
    participant: str
    number: int
    stored: dict[str, Any]
    study: Any = None


def split_names(text: str) -> list[str]:
    """Split a list of names at its commas.

    >>> split_names("ikns, gamepad")
    ['ikns', 'gamepad']
    """
    return [name.strip() for name in text.split(",") if name.strip()]


def resolve_option(
    given: Any, stored: Mapping[str, Any], name: str, default: Any
) -> Any:
    """Return what was given, else what the visit was started with, else the default."""
    return stored.get(name, default) if given is None else given


def find_visit(
    visit: Path | None,
    study: Path | None,
    *,
    experiment: Literal["tracking", "picking"],
    participant: str | None,
    number: int | None,
) -> VisitIdentity:
    """Find the folder of a visit and what it was started with.

    Raises
    ------
    InvalidInput
        When both or neither of visit and study are given, or the participant or
        their number is missing or invalid.
    """
    if (visit is None) == (study is None):
        raise InvalidInput(
            "expected the folder of a visit or --study, found "
            f"{'neither' if visit is None else 'both'}."
        )
    declared = None
    if study is not None:
        from ikns.experiments.study import check_declaration, read_study

        declared = read_study(study)
        check_declaration(study, declared)
        if participant is None:
            raise InvalidInput("--study needs the --participant whose visit it is.")
        visit = study / "visits" / f"sub-{participant}_{experiment}"
    assert visit is not None
    stored: dict[str, Any] = {}
    if (visit / "visit.json").exists():
        from ikns.experiments.visits import read_visit

        stored = read_visit(visit, experiment=experiment).about
    who = str(resolve_option(participant, stored, "participant", "01"))
    if not (who.isascii() and who.isalnum()):
        raise InvalidInput(
            f"expected a participant of letters and digits, found '{who}'."
        )
    place = resolve_option(number, stored, "participant_number", None)
    if place is None:
        if not who.isdigit() or int(who) < 1:
            raise InvalidInput(f"participant '{who}' needs --number, counted from 0.")
        place = int(who) - 1
    return VisitIdentity(visit, experiment, who, int(place), stored, declared)


def resolve_design(
    identity: VisitIdentity,
    given: Mapping[str, Any],
    defaults: Mapping[str, Any],
    *,
    inputs: Sequence[str],
) -> dict[str, Any]:
    """Return the design of a visit.

    A study declares all of it. Without one, each part is what was given, else what the
    visit was started with, else the default.

    Parameters
    ----------
    identity : VisitIdentity
    given, defaults : mapping
        By name of the option; None is not given. `align` (tracking) is stored next
        to the design, everything else in it.
    inputs : sequence of str
        Conditions that the experiment knows.

    Raises
    ------
    InvalidInput
        When the study does not have this experiment, an option is given with a study,
        or a condition is unknown.
    """
    if identity.study is None:
        stored = dict(identity.stored.get("design", {}))
        stored |= {k: identity.stored[k] for k in ("align",) if k in identity.stored}
        design = {
            name: resolve_option(given[name], stored, name, default)
            for name, default in defaults.items()
        }
    else:
        design = _declared_design(identity, given)
    unknown = [name for name in design["conditions"] if name not in inputs]
    if unknown:
        raise InvalidInput(
            f"expected --conditions among {', '.join(inputs)}, separated by commas, "
            f"found '{unknown[0]}'."
        )
    return design


def _declared_design(
    identity: VisitIdentity, given: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the design that the study declares; no option may change it."""
    declared = getattr(identity.study, identity.experiment)
    if declared is None:
        raise InvalidInput(
            f"expected a table [{identity.experiment}] in the study file, found none."
        )
    options = [name for name, value in given.items() if value is not None]
    if options:
        raise InvalidInput(
            f"the study declares everything; expected no --{options[0]} with --study."
        )
    design = dict(declared.arguments(seed=identity.study.seed))
    return design | ({"align": declared.align} if "align" in given else {})
