"""What fingers with a thread of their own share: connecting there, and leaving."""

from __future__ import annotations

import threading
from collections.abc import Callable


class ConnectionAttempt:
    """An attempt to connect, made by the finger's thread for a caller that waits.

    Attributes
    ----------
    done : threading.Event
        Set when it has succeeded or failed.
    error : BaseException or None
        Why it failed; for the caller to raise.
    """

    def __init__(self) -> None:
        self.done = threading.Event()
        self.error: BaseException | None = None


def relax_after(relax: Callable[[], None], raised: object) -> None:
    """Relax at the end of a ``with``; add a failure as a note to what was raised.

    Parameters
    ----------
    relax : callable
    raised : BaseException or None
        The exception by which the ``with`` is left, if any.

    Raises
    ------
    FingerError
        What `relax` raises, where nothing else was raised.

    Examples
    --------
    >>> def fail():
    ...     raise OSError("unplugged")
    >>> left_by = ValueError("no map")
    >>> relax_after(fail, left_by)
    >>> left_by.__notes__
    ['unplugged']
    """
    try:
        relax()
    except Exception as failure:
        if not isinstance(raised, BaseException):
            raise
        raised.add_note(str(failure))
