"""Columns of the motion files: names, BIDS types, units, and number formats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ikns.nullspace.signal_names import signal_names

#: States of the safety machine; the column ``state`` has their index.
STATES = ("disarmed", "armed", "active", "holding", "safe")

#: Six decimals: micrometers and microseconds.
_MICRO = "%.6f"
#: Text unchanged; a number with the fewest digits that read back as the same number.
_EXACT = "%s"


@dataclass(frozen=True)
class Channel:
    """One column of a motion file.

    Parameters
    ----------
    name : str
        Unique within the file.
    type : str
        BIDS type: POS, ORNT, JNTANG, LATENCY, MISC.
    units : str
    component : str
        x, y, z, quat_x to quat_w, or n/a.
    tracked_point : str
        Marker, segment or joint that it belongs to.
    frame : str
        Reference frame: world, thorax, or n/a.
    form : str
        Number format.
    """

    name: str
    type: str
    units: str
    component: str = "n/a"
    tracked_point: str = "n/a"
    frame: str = "n/a"
    form: str = _MICRO


def micro(values: ArrayLike) -> NDArray[np.float64]:
    """Round to six decimals (micrometers or microseconds), as is done with all input.

    Numbers printed with six decimals then read back as the same numbers, so a replay
    computes with the same numbers as the live run. A micrometer is a hundredth of the
    resolution of cameras. All NaN get the same bits, so that equal frames are equal
    bytes.

    Examples
    --------
    >>> float(f"{float(micro(0.1234567891)):.6f}") == float(micro(0.1234567891))
    True
    """
    # Dividing an integer by a power of ten rounds correctly, like reading decimals.
    rounded = np.asarray(
        np.rint(np.asarray(values, dtype=np.float64) * 1e6) / 1e6 + 0.0
    )
    rounded[rounded != rounded] = np.nan
    return rounded


def marker_channels(labels: Sequence[str]) -> list[Channel]:
    """Columns of the input: frame number, times, markers.

    Times are LATENCY channels in s: ``device_time`` on the cameras' clock since their
    first frame, ``receive_time`` on this machine's since the onset of the run.
    """
    timing = [
        Channel("frame", "MISC", "n/a", form="%d"),
        Channel("device_time", "LATENCY", "s"),
        Channel("receive_time", "LATENCY", "s"),
    ]
    return timing + [
        Channel(f"{label}_{axis}", "POS", "m", axis, label, "world")
        for label in labels
        for axis in "xyz"
    ]


def model_channels(joint_names: Sequence[str], n_dof: int = 1) -> list[Channel]:
    """Columns of the results.

    Thorax pose, joint angles, hand, control signal, flexion commanded, sent and
    measured, and the quality and timing of the frame: ``c_uncertainty`` is the standard
    deviation of c. With several freedoms these are ``c_1``, ``flexion_1_asked``,
    ``c_1_uncertainty`` and so on.
    """
    body = [
        Channel(f"thorax_{axis}", "POS", "m", axis, "thorax", "world") for axis in "xyz"
    ]
    body += [
        Channel(f"thorax_{c}", "ORNT", "n/a", c, "thorax", "world")
        for c in ("quat_x", "quat_y", "quat_z", "quat_w")
    ]
    # BIDS asks for degrees.
    joints = [
        Channel(name, "JNTANG", "deg", tracked_point=name) for name in joint_names
    ]
    hand = [
        Channel(f"hand_{axis}", "POS", "m", axis, "hand", "thorax") for axis in "xyz"
    ]
    signal = [Channel(name, "MISC", "n/a", form=_EXACT) for name in signal_names(n_dof)]
    uncertainty = [
        Channel(f"{channel.name}_uncertainty", "MISC", "n/a", form=_EXACT)
        for channel in signal
    ]
    fingers = signal_names(n_dof, "finger")
    finger = [
        Channel(f"{name}_{what}", "MISC", "n/a", tracked_point=point, form=_EXACT)
        for what in ("asked", "sent", "measured")
        for name, point in zip(signal_names(n_dof, "flexion"), fingers, strict=True)
    ]
    health = [
        Channel("residual", "MISC", "m"),
        Channel("worst_residual", "MISC", "m"),
        Channel("intermarker_error", "MISC", "m"),
        *uncertainty,
        Channel("inside", "MISC", "n/a", form="%d"),
        Channel("state", "MISC", "n/a", form="%d"),
        Channel("solve_time", "MISC", "s"),
        Channel("latency", "MISC", "s"),
    ]
    return body + joints + hand + signal + finger + health
