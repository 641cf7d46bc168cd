"""What can go wrong between here and a finger."""

from __future__ import annotations

from ikns.errors import IknsError

__all__ = ["FingerError"]


class FingerError(IknsError, ConnectionError):
    """A finger is not there, is not what was asked for, or did not obey."""
