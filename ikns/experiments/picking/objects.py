"""The objects that are picked and placed: those of the paper's table."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib.resources import files
from typing import Literal

from ikns.errors import InvalidInput

#: Codes of the paper's table.
OBJECT_IDS = tuple("ABCDEFGHILM")


@dataclass(frozen=True)
class PickObject:
    """An object as a solid of one material.

    Parameters
    ----------
    id : str
        Code in the paper's table.
    name : str
    ycb : str
        Name in the YCB catalog.
    mass_kg : float
    shape : {"box", "cylinder", "sphere"}
    size_m : tuple of float
        Box: three edges. Cylinder: diameter and height. Sphere: diameter.
    source : {"paper", "ycb"}
        Where mass and size are from.
    """

    id: str
    name: str
    ycb: str
    mass_kg: float
    shape: Literal["box", "cylinder", "sphere"]
    size_m: tuple[float, ...]
    source: Literal["paper", "ycb"]


def load_objects(source: Literal["paper", "ycb"] = "paper") -> dict[str, PickObject]:
    """Return all objects, by code, in the order of the table.

    Parameters
    ----------
    source : "paper" or "ycb"
        With "ycb", the numbers of the YCB catalog where they are known to differ;
        ``PickObject.source`` says which an object has.

    Examples
    --------
    >>> load_objects()["A"].mass_kg, load_objects("ycb")["A"].mass_kg
    (0.084, 0.094)
    >>> load_objects()["C"].shape, load_objects()["C"].size_m
    ('cylinder', (0.075, 0.25))
    """
    if source not in ("paper", "ycb"):
        raise InvalidInput(f"expected source 'paper' or 'ycb', found {source!r}.")
    text = files("ikns.experiments.picking").joinpath("objects.toml").read_text("utf-8")
    found = {}
    for code, row in tomllib.loads(text).items():
        used: Literal["paper", "ycb"] = source if source in row else "paper"
        numbers = row[used]
        found[code] = PickObject(
            id=code,
            name=row["name"],
            ycb=row["ycb_name"],
            mass_kg=numbers["mass_g"] / 1000,
            shape=row["shape"],
            size_m=tuple(edge / 1000 for edge in numbers["size_mm"]),
            source=used,
        )
    return found
