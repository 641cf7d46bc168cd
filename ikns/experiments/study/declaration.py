"""The study file: experiments, participants, and margins of equivalence."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from ikns.errors import FileError, InvalidInput, naming, unreadable
from ikns.experiments.picking.objects import OBJECT_IDS
from ikns.experiments.study.design import Parameters, PickingDesign, TrackingDesign
from ikns.experiments.study.tables import check_keys, choice, fill
from ikns.experiments.tracking.profiles import draw_profile
from ikns.simulation.operator import CONDITIONS

#: Name of the file in a study folder, and the version of its keys.
FILE, FORMAT = "study.toml", 1
#: Conditions that virtual participants can do.
_SIMULATED = {"tracking": CONDITIONS, "picking": ("ikns", "ring")}
_TABLES = ("study", "cohort", "tracking", "picking", "parameters", "variations")
#: Largest cohort.
_MAX_PARTICIPANTS = 1_000_000


@dataclass(frozen=True)
class Study:
    """A study as its file declares it.

    Parameters
    ----------
    name : str
    seed : int
        Of profiles, orders and virtual participants.
    simulated : bool
        Whether participants are virtual.
    participants : int
    tracking : TrackingDesign or None
    picking : PickingDesign or None
    parameters : Parameters
        Of virtual participants; visits of people do not depend on them.
    variations : dict of str to dict
        The parameters that each variation changes, by name.
    """

    name: str
    seed: int
    simulated: bool
    participants: int
    tracking: TrackingDesign | None = None
    picking: PickingDesign | None = None
    parameters: Parameters = Parameters()
    variations: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @property
    def designs(self) -> dict[str, TrackingDesign | PickingDesign]:
        """The declared experiments, by name."""
        both = {"tracking": self.tracking, "picking": self.picking}
        return {name: design for name, design in both.items() if design is not None}

    def parameters_of(self, variation: str = "") -> Parameters:
        """Return the parameters of a variation; without one those of the study."""
        return replace(self.parameters, **self.variations.get(variation, {}))

    def declared(self) -> dict[str, Any]:
        """Return the whole declaration as text, numbers, lists and tables."""
        table = asdict(self)
        for name in self.designs:
            table[name] = {
                key: list(value) if isinstance(value, tuple) else value
                for key, value in table[name].items()
            }
        return table | {"variations": {k: dict(v) for k, v in self.variations.items()}}


@dataclass(frozen=True)
class _Head:
    name: str
    seed: int = 0
    format: int = FORMAT
    simulated: bool = True


@dataclass(frozen=True)
class _Cohort:
    participants: int


def read_study(study: str | Path) -> Study:
    """Read a study file.

    Parameters
    ----------
    study : str or Path
        The study's folder, or the file.

    Raises
    ------
    FileError
        When it is missing or not TOML.
    InvalidInput
        When a key is unknown, or the design is impossible.
    """
    path = Path(study)
    if not path.exists() and path.suffix != ".toml":
        raise FileError(
            f"{path}: there is no such folder; `ikns study init` makes one."
        )
    path = path / FILE if path.is_dir() else path
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise FileError(
            f"{path}: no such file; `ikns study init` writes one."
        ) from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise unreadable(path, error, "TOML") from None
    with naming(str(path)):
        return study_from_table(table)


def study_from_table(table: Mapping[str, Any]) -> Study:
    """Make a study from the tables of its file.

    Raises
    ------
    InvalidInput
        When a key is unknown, or the design is impossible.

    Examples
    --------
    >>> study_from_table({"study": {"nam": "x"}, "cohort": {"participants": 10}})
    Traceback (most recent call last):
    ikns.errors.InvalidInput: expected 'name' in [study], found 'nam'.
    """
    check_keys(table, _TABLES, "")
    for name in ("study", "cohort"):
        if name not in table:
            raise InvalidInput(f"expected a table [{name}], found none.")
    head = fill(_Head, table["study"], "study")
    if head.format != FORMAT:
        raise InvalidInput(
            f"expected a study file of format {FORMAT}, found {head.format}."
        )
    if not head.name.strip():
        raise InvalidInput("expected a name in [study], found none.")
    if not 0 <= head.seed < 2**32:
        raise InvalidInput(
            f"expected a seed from 0 to below 2**32 in [study], found {head.seed}."
        )
    participants = fill(_Cohort, table["cohort"], "cohort").participants
    if not 1 <= participants <= _MAX_PARTICIPANTS:
        raise InvalidInput(
            f"expected 1 to {_MAX_PARTICIPANTS} participants in [cohort], found "
            f"{participants}."
        )
    tracking = picking = None
    if "tracking" in table:
        tracking = fill(TrackingDesign, table["tracking"], "tracking")
    if "picking" in table:
        picking = fill(PickingDesign, _all_objects(table["picking"]), "picking")
    if tracking is None and picking is None:
        raise InvalidInput("expected a table [tracking] or [picking], found neither.")
    parameters = fill(Parameters, table.get("parameters", {}), "parameters")
    variations = _variations(table.get("variations", {}), table.get("parameters", {}))
    found = Study(
        name=head.name,
        seed=head.seed,
        simulated=head.simulated,
        participants=participants,
        tracking=tracking,
        picking=picking,
        parameters=parameters,
        variations=variations,
    )
    _check_simulated(found)
    if tracking is not None:  # a short profile may not exist for its character
        for step in tracking.steps(0, seed=found.seed):
            if step.kind != "rest":
                draw_profile(step.profile, step.seed, seconds=step.seconds)
    return found


def _all_objects(table: Any) -> Any:
    if isinstance(table, Mapping) and table.get("objects") == "all":
        return {**table, "objects": list(OBJECT_IDS)}
    return table


def _variations(tables: Any, base: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    if not isinstance(tables, Mapping):
        raise InvalidInput(f"expected tables [variations.NAME], found {tables!r}.")
    found: dict[str, dict[str, Any]] = {}
    plain = fill(Parameters, base, "parameters")
    for name, changes in tables.items():
        where = f"variations.{name}"
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name) or name[:4] == "sub-":
            raise InvalidInput(
                "expected a variation's name of letters, digits, - and _ that does not "
                f"begin with sub-, found '{name}'."
            )
        if not isinstance(changes, Mapping):
            raise InvalidInput(f"expected a table [{where}], found {changes!r}.")
        with naming(f"[{where}]"):
            changed = fill(Parameters, {**base, **changes}, where)
        if changed == plain:
            raise InvalidInput(f"expected a change of a parameter in [{where}].")
        found[name] = {key: getattr(changed, key) for key in changes}
    return found


def _check_simulated(study: Study) -> None:
    if not study.simulated:
        return
    for name, design in study.designs.items():
        for condition in design.conditions:
            choice(name, "conditions for virtual people", condition, _SIMULATED[name])
