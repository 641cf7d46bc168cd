"""The published tables, with clear errors for unknown rows."""

from __future__ import annotations

import tomllib
from copy import deepcopy
from functools import cache
from typing import Any

from ikns.errors import InvalidInput

#: The sexes in the tables.
SEXES = ("female", "male")

#: The tables that :func:`table` reads.
TABLES = ("ansur2", "de_leva", "shoulder", "winter")

_SEX_WORDS = {"female": "female", "f": "female", "male": "male", "m": "male"}


def normalize_sex(sex: str) -> str:
    """Return "female" or "male" for a word or letter in any case.

    Raises
    ------
    InvalidInput
        When the tables have no such sex.

    Examples
    --------
    >>> normalize_sex("F")
    'female'
    """
    word = _SEX_WORDS.get(sex.strip().lower()) if isinstance(sex, str) else None
    if word is None:
        raise InvalidInput(
            f"sex is {sex!r}, expected 'female' or 'male' (or 'F', 'M'); "
            "the tables cover no other."
        )
    return word


def table(name: str) -> dict[str, Any]:
    """Read one published table.

    Parameters
    ----------
    name : str
        One of :data:`TABLES`.

    Returns
    -------
    dict
        The TOML file: ``source``, ``mark`` and the rows under ``row``. Units are in the
        keys (``_mm``, ``_kg``; the rest are fractions). A new copy.

    Raises
    ------
    InvalidInput
        When there is no such table.

    Examples
    --------
    >>> table("de_leva")["row"]["upper_arm"]["male"]["com"]
    0.5772
    """
    return deepcopy(_read(name))


def row(table_name: str, row_name: str, *, sex: str) -> dict[str, Any]:
    """Look up one row of a table for one sex.

    Parameters
    ----------
    table_name : str
        One of :data:`TABLES`.
    row_name : str
        Name of the row, such as ``"upper_arm"``.
    sex : str
        "female" or "male".

    Returns
    -------
    dict
        The numbers of that sex (or of both, where the source does not distinguish)
        with ``proximal``, ``distal``, ``source`` and ``mark``.

    Raises
    ------
    InvalidInput
        When there is no such table, row or sex.

    Examples
    --------
    >>> arm = row("winter", "upper_arm", sex="female")
    >>> arm["com"], arm["proximal"], arm["distal"]
    (0.436, 'glenohumeral axis', 'elbow axis')
    """
    sex = normalize_sex(sex)
    whole = _read(table_name)
    rows: dict[str, Any] = whole["row"]
    if row_name not in rows:
        raise InvalidInput(
            f"table {table_name!r} has no row {row_name!r}, expected one of "
            f"{', '.join(sorted(rows))}."
        )
    entry = rows[row_name]
    words = {
        key: entry.get(key, whole.get(key))
        for key in ("proximal", "distal", "source", "mark", "note")
        if key in entry or key in whole
    }
    return words | deepcopy(entry.get(sex, entry.get("both", {})))


def subjects(table_name: str, *, sex: str) -> dict[str, Any]:
    """Subjects of a table: ``n`` and, where stated, mean stature and mass.

    >>> subjects("de_leva", sex="male")["stature_mm"]
    1741.0
    """
    people = _read(table_name).get("subjects", {})
    return deepcopy(people.get(normalize_sex(sex), {}))


@cache
def _read(name: str) -> dict[str, Any]:
    if name not in TABLES:
        raise InvalidInput(
            f"there is no anthropometric table {name!r}, expected one of "
            f"{', '.join(TABLES)}."
        )
    from importlib.resources import files  # a third of this package's import time

    text = files("ikns.body.anthropometry").joinpath(f"{name}.toml").read_text("utf-8")
    return tomllib.loads(text)
