"""Versions of what the bits of a simulation depend on."""

from __future__ import annotations

import platform
import socket
from importlib.metadata import PackageNotFoundError, version

from ikns.errors import InvalidInput

_ALWAYS = ("ikns", "numpy", "scipy", "numba", "pin")


def library_versions(*, picking: bool = True) -> dict[str, str]:
    """Return the versions of Python and of the libraries; those that are missing too.

    Parameters
    ----------
    picking : bool
        With the library by which picking is simulated.
    """
    names = [*_ALWAYS, "mujoco"] if picking else _ALWAYS
    return {"python": platform.python_version()} | {n: _version(n) for n in names}


def check_versions(wanted: dict[str, str]) -> None:
    """Check that this process has the versions of the one that runs the study.

    Raises
    ------
    InvalidInput
        When one is another: results would not be the same, bit for bit.
    """
    found = library_versions()
    for name, right in wanted.items():
        if found.get(name) != right:
            raise InvalidInput(
                f"the worker on {socket.gethostname()} has {name} {found.get(name)}, "
                f"expected {right} as here; results would not have the same bits."
            )


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"
