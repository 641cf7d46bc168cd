"""The errors a user can meet: one sentence with what, where and what would be right."""


class IknsError(Exception):
    """Root of every error that this package raises on purpose."""


class FileError(IknsError, ValueError):
    """A file is missing, empty, damaged, or not what its name promises."""


class MarkerMismatch(IknsError, ValueError):
    """A recording lacks markers that the skeleton wears."""


class NotEnoughData(IknsError, ValueError):
    """The samples are too few or too alike for what was asked."""


class InvalidInput(IknsError, ValueError):
    """An argument is outside what the function accepts."""
