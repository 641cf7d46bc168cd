"""Errors: one sentence with what is wrong, where, and what would be right."""

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
    ...     print(error)  # doctest: +ELLIPSIS
    walk.mp4: expected a marker file that ends in .c3d, .trc, ..., found .mp4.
    """


class FileError(IknsError, ValueError):
    """A file is missing, empty, damaged, or not of the expected format."""


class DataLoss(FileError):
    """Something that was recorded is not on disk; a program ends with exit code 1."""


class MarkerMismatch(IknsError, ValueError):
    """A recording and a marker set do not match."""


class NotEnoughData(IknsError, ValueError):
    """The samples are too few or too alike for what was asked."""


class InvalidInput(IknsError, ValueError):
    """An argument is outside what the function accepts."""


class StreamError(IknsError, OSError):
    """A live source does not answer, sends unexpected data, or disconnected."""


class RecordingWarning(UserWarning):
    """A reader repaired or left out something in a file.

    Attributes
    ----------
    source, note : str
        The file, and what was done, in one sentence.
    """

    def __init__(self, source: object, note: str) -> None:
        super().__init__(f"{source}: {note}")
        self.source, self.note = str(source), note


def plain(error: Exception) -> str:
    """Say why a file could not be read or written, without Python's own words.

    >>> plain(FileNotFoundError(2, "No such file or directory", "a.toml"))
    'no such file or directory'
    >>> plain(UnicodeDecodeError("utf-8", b"?", 0, 1, "invalid start byte"))
    'it is not text in UTF-8'
    """
    if isinstance(error, OSError):
        return (error.strerror or str(error)).lower()
    if isinstance(error, UnicodeDecodeError):
        return "it is not text in UTF-8"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    return str(error).rstrip(".")


def unreadable(path: object, error: Exception, kind: str = "") -> FileError:
    """Return the error of a file that cannot be read, as a `kind` of file say.

    >>> str(unreadable("a.toml", FileNotFoundError(2, "No such file or directory")))
    'a.toml: no such file.'
    >>> str(unreadable("a.json", ValueError("line 1 is odd"), "JSON"))
    'a.json: cannot be read as JSON: line 1 is odd.'
    """
    if isinstance(error, FileNotFoundError):
        return FileError(f"{path}: no such file.")
    as_kind = f" as {kind}" if kind else ""
    return FileError(f"{path}: cannot be read{as_kind}: {plain(error)}.")


@contextmanager
def naming(source: str, *others: str) -> Iterator[None]:
    """Put the name of a file before the sentence of an error that names none of these.

    >>> with naming("walk.c3d"):
    ...     raise NotEnoughData("no frame is still.")
    Traceback (most recent call last):
    ikns.errors.NotEnoughData: walk.c3d: no frame is still.
    """
    try:
        yield
    except IknsError as error:
        if any(each in str(error) for each in (source, *others)):
            raise
        raise type(error)(f"{source}: {error}") from None
