"""Sidecar files of a session: what BIDS wants to know about each table."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ikns.errors import InvalidInput
from ikns.live.session.channels import STATES, Channel

TASK = "ikns"
#: Content of the sidecar of the events.
EVENTS_ABOUT = {
    "trial_type": {"Description": "What happened."},
    "value": {"Description": "Its reason or size."},
}


def write_sidecars(
    path: Path, name: str, channels: Sequence[Channel], rate: float
) -> None:
    """Write the sidecars of a motion file: its JSON file and its channels."""
    kinds = [channel.type for channel in channels]
    names = [channel.name for channel in channels]
    if len(set(names)) < len(names):
        twice = next(n for n in names if names.count(n) > 1)
        raise InvalidInput(f"two columns of the session are called '{twice}'.")
    points = {c.tracked_point for c in channels if c.type == "POS"}
    counts = {
        f"{'Misc' if kind == 'MISC' else kind}ChannelCount": kinds.count(kind)
        for kind in sorted(set(kinds))
    }
    write_json(
        path.with_suffix(".json"),
        {
            "TaskName": TASK,
            "TaskDescription": "A wearable robot driven by the arm's null space.",
            "SamplingFrequency": rate,
            "TrackingSystemName": name,
            "MotionChannelCount": len(channels),
            "TrackedPointsCount": len(points),
            "MissingValues": "n/a",
            **counts,
        },
    )
    fields = ("name", "component", "type", "tracked_point", "units", "reference_frame")
    rows = [
        (c.name, c.component, c.type, c.tracked_point, c.units, c.frame)
        for c in channels
    ]
    stem = path.name.removesuffix("_motion.tsv")
    table = "".join("\t".join(row) + "\n" for row in [fields, *rows])
    write_new(path.with_name(f"{stem}_channels.tsv"), table)
    # World: as the cameras were calibrated. Thorax: axes of the ISB.
    levels = {
        "world": {"SpatialAxes": "n/a", "RotationRule": "right-hand"},
        "thorax": {"SpatialAxes": "ASR", "RotationRule": "right-hand"},
    }
    used = {c.frame for c in channels} & set(levels)
    about: dict[str, Any] = {
        "reference_frame": {
            "Levels": {
                frame: {"RotationOrder": "n/a", **levels[frame]}
                for frame in sorted(used)
            }
        }
    }
    if "state" in names:
        about["state"] = {"Levels": {str(k): s for k, s in enumerate(STATES)}}
    write_json(path.with_name(f"{stem}_channels.json"), about)


def write_json(path: Path, value: Mapping[str, Any]) -> None:
    """Write a new JSON file; see :func:`write_new`."""
    write_new(path, json_text(value))


def json_text(value: Mapping[str, Any]) -> str:
    """Return strict JSON."""
    return json.dumps(value, indent=1, allow_nan=False) + "\n"


def write_new(path: Path, text: str) -> None:
    """Write a new file and sync it to the disk; remove it when that fails."""
    with path.open("x", encoding="utf-8", newline="") as file:
        try:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        except BaseException:
            path.unlink(missing_ok=True)
            raise
