"""Chains by name and from files: ``urdf/chains.toml``, and others of the same form."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from ikns.body.chain import FORMAT, Chain, ChainLike
from ikns.body.model_file import urdf_folder
from ikns.errors import FileError, IknsError, InvalidInput, unreadable

_KNOWN = {"joints", "ends", "base", "task", "extrinsic"}


def load_chain(name_or_path: str | Path) -> Chain:
    """Read a chain by its name (``right_arm``), or from a TOML file.

    A file of several chains takes its name after a colon, ``mine.toml:elbow``.

    Raises
    ------
    InvalidInput
        When no chain has this name.
    FileError
        When the file cannot be read as chains.

    Examples
    --------
    >>> load_chain("both_arms").ends
    ('right_knuckle', 'left_knuckle')
    """
    file, wanted = chain_file(name_or_path)
    if file is None:
        if name_or_path not in (known := shipped_chains()):
            raise InvalidInput(
                f"there is no chain '{name_or_path}'; known are {', '.join(known)}, or "
                "the path of a .toml file."
            )
        return known[str(name_or_path)]
    chains = read_chains(file)
    if not wanted and len(chains) == 1:
        return next(iter(chains.values()))
    if wanted not in chains:
        raise InvalidInput(
            f"{file}: expected {file}:NAME with one of its chains, "
            f"{', '.join(chains)}, found '{name_or_path}'."
        )
    return chains[wanted]


def chain_file(name_or_path: str | Path) -> tuple[Path | None, str]:
    """Split what :func:`load_chain` takes into a file, if it is one, and a name.

    >>> chain_file("mine.toml:elbow")[1], chain_file("right_arm")
    ('elbow', (None, 'right_arm'))
    """
    path, ending, name = str(name_or_path).rpartition(".toml")
    if not ending or (name and not name.startswith(":")):
        return None, str(name_or_path)
    return Path(path + ending), name[1:]


@cache
def shipped_chains() -> Mapping[str, Chain]:
    """Return the chains that come with the package, by name."""
    return _read(urdf_folder() / "chains.toml")


def read_chains(path: str | Path) -> dict[str, Chain]:
    """Read the chains of a TOML file, by name; see ``urdf/chains.toml`` for its form.

    Raises
    ------
    FileError
        When the file cannot be read, or a chain is incomplete or takes the name of one
        that comes with the package.
    """
    found = _read(Path(path))
    for name, chain in found.items():
        if shipped_chains().get(name, chain) != chain:
            raise FileError(
                f"{path}: the chain '{name}' that comes with ikns is another one; "
                "give yours a name of its own."
            )
    return found


def _read(path: Path) -> dict[str, Chain]:
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise unreadable(path, error, "chains") from None
    except ValueError as error:
        reason = str(error).rstrip(".")
        if isinstance(error, UnicodeDecodeError):
            reason = f"expected text in UTF-8, found other bytes at {error.start}"
        raise FileError(
            f"{path}: cannot be read as chains: {reason[:1].lower()}{reason[1:]}."
        ) from None
    listed = table.get("chains")
    if table.get("format") != FORMAT or not isinstance(listed, dict) or not listed:
        raise FileError(
            f"{path}: expected 'format = {FORMAT}' and at least one table "
            "[chains.NAME], as in ikns' own urdf/chains.toml."
        )
    found: dict[str, Chain] = {}
    for name, own in listed.items():
        try:
            found[name] = chain_of_table(name, own, known=found)
        except IknsError as error:
            raise FileError(f"{path}: {error}") from None
    return found


def chain_of_table(
    name: str, table: object, *, known: Mapping[str, Chain] | None = None
) -> Chain:
    """Make a chain from its table in a file; `known` are those before it."""
    if not isinstance(table, dict) or "joints" not in table:
        raise InvalidInput(f"chain '{name}': expected a table with joints and ends.")
    if unknown := sorted(set(table) - _KNOWN):
        raise InvalidInput(
            f"chain '{name}': expected joints, ends, base or task, found "
            f"{', '.join(unknown)}."
        )
    if "task" not in table:
        rest = {key: value for key, value in table.items() if key != "joints"}
        if "ends" not in rest:
            raise InvalidInput(
                f"chain '{name}': expected the ends that perform its task, or the "
                "task that leaves its joints alone, found neither."
            )
        return Chain(name, table["joints"], **rest)
    if others := sorted({"ends", "base", "extrinsic"} & set(table)):
        raise InvalidInput(
            f"chain '{name}': the task gives the ends; leave out {', '.join(others)}."
        )
    task = table["task"]
    given = (known or {}).get(task) if isinstance(task, str) else None
    return extrinsic_chain(name, table["joints"], task if given is None else given)


def extrinsic_chain(name: str, joints: tuple[str, ...], task: ChainLike) -> Chain:
    """Return the chain of joints that a task leaves alone.

    Parameters
    ----------
    name : str
    joints : tuple of str
        None of the task's own.
    task : Chain or str
        Where its ends are still, the joints are read.

    Examples
    --------
    >>> resting = load_chain("left_arm").joints
    >>> extrinsic_chain("resting_arm", resting, "right_arm").ends
    ('right_knuckle',)
    """
    own = as_chain(task)
    made = Chain(name, joints, own.ends, own.base, extrinsic=True)
    if shared := [joint for joint in made.joints if joint in own.joints]:
        raise InvalidInput(
            f"chain '{name}': expected joints that {own} leaves alone, found "
            f"{', '.join(shared)}."
        )
    return made


def as_chain(chain: ChainLike) -> Chain:
    """Return a chain, or the one of this name that comes with the package."""
    if isinstance(chain, Chain):
        return chain
    known = shipped_chains()
    if not isinstance(chain, str) or chain not in known:
        raise InvalidInput(f"unknown chain '{chain}', expected one of {sorted(known)}.")
    return known[chain]
