"""A figure as a file: checked before any work, written whole or not at all."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ikns.output.file import refuse_overwriting, write_bytes

_ENDINGS = (".png", ".svg", ".pdf")


def refuse_picture(
    path: Path | None, *, force: bool, inputs: Iterable[Path | None]
) -> None:
    """Check, before any work, that a picture may be written.

    Raises
    ------
    InvalidInput
        When its ending is unknown, or the file may not be written; see
        :func:`ikns.output.file.refuse_overwriting`.
    """
    if path is None:
        return
    refuse_overwriting(path, force=force, inputs=inputs, endings=_ENDINGS)


def write_picture(path: Path, figure: Any, *, force: bool) -> None:
    """Write a matplotlib figure in the format of its ending."""
    from ikns.view.render import pdf, png, svg

    draw = {".png": png, ".svg": svg, ".pdf": pdf}[path.suffix.lower()]
    write_bytes(path, draw(figure), force=force)
