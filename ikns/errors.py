"""The errors a user can meet: one sentence with what, where and what would be right."""

from collections.abc import Iterator
from contextlib import contextmanager


class IknsError(Exception):
    """Root of every error that this package raises on purpose.

    Examples
    --------
    >>> import ikns
    >>> try:
    ...     ikns.read("walk.mp4")
    ... except ikns.IknsError as error:
    ...     print(error)
    walk.mp4: expected a marker file that ends in .c3d, .trc, .csv, found .mp4.
    """


class FileError(IknsError, ValueError):
    """A file is missing, empty, damaged, or not what its name promises."""


class DataLoss(FileError):
    """Something that was recorded is not on disk; a program ends with exit code 1."""


class MarkerMismatch(IknsError, ValueError):
    """A recording lacks markers that the skeleton wears."""


class NotEnoughData(IknsError, ValueError):
    """The samples are too few or too alike for what was asked."""


class InvalidInput(IknsError, ValueError):
    """An argument is outside what the function accepts."""


class StreamError(IknsError, OSError):
    """A live source does not answer, sends something else, or broke off."""


@contextmanager
def naming(source: str) -> Iterator[None]:
    """Put the name of a file before the sentence of an error that lacks it.

    >>> with naming("walk.c3d"):
    ...     raise NotEnoughData("no frame is still.")
    Traceback (most recent call last):
    ikns.errors.NotEnoughData: walk.c3d: no frame is still.
    """
    try:
        yield
    except IknsError as error:
        if source in str(error):
            raise
        raise type(error)(f"{source}: {error}") from None
