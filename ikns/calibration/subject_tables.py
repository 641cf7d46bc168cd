"""The files of a subject folder one by one: how each is written and read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ikns.arrays import Array
from ikns.body.chain_files import chain_of_table
from ikns.body.chains import ChainLike, as_chain
from ikns.errors import FileError, IknsError, InvalidInput, plain, unreadable
from ikns.nullspace.readout import Readout

#: Version of the folder's layout and of the JSON files in it.
FORMAT = 1
#: Version of a map of intent that remembers places: what does not know of them would
#: read another c off it.
WITH_PLACES = 2
#: Version of one whose natural posture knows the hand's direction too.
WITH_HAND = 3
#: Version of one that follows this direction along the path of the wrist alone, and
#: takes off what hidden markers shift.
WITH_LEASH = 4

#: Columns of the still samples: hand position, m in the thorax frame, and number of the
#: PCA point, from 1; 0 for none.
COLUMNS = "x_m,y_m,z_m,point"
#: What a map of a chain that does not come with the package says of it.
_OF_CHAIN = ("joints", "ends", "base", "extrinsic")


def write_json(path: Path, table: dict[str, Any]) -> None:
    """Write a table as JSON."""
    text = json.dumps(table, indent=1, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def read_samples(path: Path, *, n_points: int) -> Array | None:
    """Read the still samples; None where a folder has none."""
    if not path.exists():
        return None
    try:
        header, *rows = path.read_text(encoding="utf-8").splitlines()
        if header != COLUMNS:
            raise InvalidInput(f"the columns {COLUMNS} were expected, not {header}.")
        samples = np.array([row.split(",") for row in rows], dtype=np.float64)
        samples = samples.reshape(-1, 4) if not rows else samples
        if samples.ndim != 2 or samples.shape[1] != 4 or not np.isfinite(samples).all():
            raise InvalidInput("four finite numbers were expected in each row.")
        point = samples[:, 3]
        if np.any((point % 1 != 0) | (point < 0) | (point > n_points)):
            raise InvalidInput(f"points 0 to {n_points} were expected.")
    except (OSError, ValueError) as error:
        fault = f"{error}" if isinstance(error, IknsError) else f"({plain(error)})."
        raise FileError(
            f"{path}: cannot be read as still samples: {fault} Only pictures need "
            "them: the file can be deleted."
        ) from None
    return samples


def chain_of_map(table: dict[str, Any]) -> ChainLike:
    """Return the name of a chain that comes with the package, or the chain."""
    name = table["chain"]
    if "ends" not in table:
        return str(as_chain(name))
    return chain_of_table(name, {key: table[key] for key in _OF_CHAIN})


def read_readout(path: Path, method: str, chain: ChainLike) -> Readout:
    """Read the map of a method beside the paper's."""
    newer = (WITH_PLACES, WITH_HAND, WITH_LEASH) if method == "intent" else ()
    table = read_json(path, (FORMAT, *newer))
    try:
        if (table["method"], table["chain"]) != (method, str(chain)):
            raise InvalidInput(
                f"expected {method} of {chain}, found {table['method']} of "
                f"{table['chain']}."
            )
        return Readout.from_table(table, chain)
    except (LookupError, TypeError, ValueError) as error:
        fault = f"{error}" if isinstance(error, IknsError) else f"({error!r})."
        raise FileError(
            f"{path}: cannot be read as a map of {method}: {fault} Only --method "
            f"{method} needs it: the file can be deleted."
        ) from None


def read_json(path: Path, known: tuple[int, ...] = (FORMAT,)) -> dict[str, Any]:
    """Read a table of one of the `known` format versions."""
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise unreadable(path, error, "JSON") from None
    version = table.get("format") if isinstance(table, dict) else None
    if version not in known:
        versions = " or ".join(map(str, known))
        raise FileError(
            f"{path}: expected format version {versions}, found {version!r}; calibrate "
            "again or use the version of ikns that wrote it."
        )
    return dict(table)


def write_readout(path: Path, readout: Readout) -> None:
    """Write the map of a method beside the paper's."""
    table = readout.table()
    natural = table.get("natural_posture", {})
    version = WITH_PLACES if natural.get("heights_rad") else FORMAT
    if len(natural.get("coefficients_rad", ())) > 10:
        version = WITH_HAND
    if table.get("leash_m"):
        version = WITH_LEASH
    write_json(path, {"format": version} | table)
