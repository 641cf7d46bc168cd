"""The command line: a thin shell over the package's public names."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from ikns.endings import (
    BROKEN_PIPE,
    flush_output,
    handle_endings,
    open_standard_streams,
    signal_exit_code,
)

__all__ = ["main"]

#: New objects between two collections of garbage; Python's 700 are for programs that do
#: not import a million objects which then stay.
_COLLECT_EVERY = 300_000


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Everything else is imported once signals are handled, so that even Ctrl-C during the
    imports is an end in order.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments after the program's name; those of the process by default.

    Returns
    -------
    int
        0 on success, 2 on bad input, 128 + the number of the signal that ended the
        command, 141 when no one reads its output any more; `ikns run` adds 3.
    """
    open_standard_streams()
    last = argv is None
    with handle_endings(last=last), _little_garbage(process=last):
        try:
            from ikns.cli.app import run_command

            code = run_command(argv)
        except (KeyboardInterrupt, SystemExit) as ended:
            code = signal_exit_code()
            if not code and isinstance(ended.__context__, BrokenPipeError):
                code = BROKEN_PIPE  # typer makes an exit of it
            if not code:
                raise
        return code if flush_output() else code or BROKEN_PIPE


@contextmanager
def _little_garbage(*, process: bool) -> Iterator[None]:
    """Do not look for garbage among what was imported, in a process of our own.

    Half of that is at the interpreter's end, when all memory is returned anyway.
    """
    if process:
        gc.set_threshold(_COLLECT_EVERY, 10, 10)
    try:
        yield
    finally:
        if process:
            gc.freeze()
