"""What readers repaired, told once for a command, not once for a file."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from ikns.errors import RecordingWarning


@contextmanager
def repairs() -> Iterator[dict[str, list[str]]]:
    """Collect the files by note while the body runs."""
    found: dict[str, list[str]] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("always", RecordingWarning)
        show = warnings.showwarning

        def collect(message: Any, *rest: Any, **more: Any) -> None:
            if not isinstance(message, RecordingWarning):
                show(message, *rest, **more)
                return
            files = found.setdefault(message.note, [])
            if message.source not in files:
                files.append(message.source)

        warnings.showwarning = collect
        yield found


def tell(found: dict[str, list[str]]) -> None:
    """Write each note to stderr with the files that it is about."""
    for note, files in found.items():
        more = len(files) - 1
        where = f"{files[0]} and {more} more" if more else files[0]
        with suppress(OSError):  # the terminal may be gone
            sys.stderr.write(f"ikns: note: {where}: {note}\n")
