"""What can go wrong between this program and a finger."""

from __future__ import annotations

from ikns.errors import IknsError


class FingerError(IknsError, ConnectionError):
    """A finger is missing, is not the one that was asked for, or did not obey."""


class NoResponse(FingerError):
    """The servo did not respond within its time, or its response was damaged."""


class Rejected(FingerError):
    """The servo rejected an instruction.

    Parameters
    ----------
    message : str
    number : int
        Error number of Protocol 2.0, error bits of Protocol 1.0.
    """

    def __init__(self, message: str, number: int) -> None:
        super().__init__(message)
        self.number = number


class PortLost(FingerError):
    """The serial port is closed or gone."""
