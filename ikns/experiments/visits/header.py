"""The file ``visit.json`` of a visit: who, which experiment, simulated or not."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ikns.errors import FileError, unreadable
from ikns.experiments.visits.rows import EXPERIMENTS

#: Version of a visit's files.
FORMAT = 1
#: Name of the file.
HEADER = "visit.json"


def header_fault(table: Mapping[str, Any]) -> str:
    """Say what is wrong with the header of a visit; empty if nothing is."""
    if table.get("format") != FORMAT:
        return f"expected a visit of format {FORMAT}, found {table.get('format')}"
    if table.get("experiment") not in EXPERIMENTS:
        return (
            f"expected an experiment of {', '.join(EXPERIMENTS)}, found "
            f"{table.get('experiment')}"
        )
    if not isinstance(table.get("participant"), str):
        return f"expected a participant as text, found {table.get('participant')}"
    if not isinstance(table.get("simulated"), bool):
        return f"expected simulated true or false, found {table.get('simulated')}"
    return ""


def read_header(visit: Path) -> dict[str, Any]:
    """Read the header of a visit's folder.

    Raises
    ------
    FileError
        When it is missing, unreadable or not that of a visit.
    """
    file = visit / HEADER
    try:
        table = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise FileError(f"{visit}: this is no visit; {HEADER} is missing.") from None
    except OSError as error:
        raise unreadable(file, error) from None
    except ValueError:
        raise FileError(f"{file}: cannot be read as JSON.") from None
    fault = "expected a table" if not isinstance(table, dict) else header_fault(table)
    if fault:
        raise FileError(f"{file}: {fault}.")
    return dict(table)
