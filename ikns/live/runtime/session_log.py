"""Rows that the live loop writes into a session."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ikns.live.control.controller import Decision
from ikns.live.session import RunWriter
from ikns.live.session.channels import STATES


def write_frame(
    session: RunWriter,
    timing: tuple[int, float, float],
    markers: NDArray[np.float64],
    decision: Decision,
    *,
    sent: Sequence[float],
    measured: Sequence[float],
    durations: tuple[float, float],
) -> None:
    """Write the two rows of a frame: what came in, and the results.

    Parameters
    ----------
    session : RunWriter
    timing : (int, float, float)
        Frame number, device time and receive time, s.
    markers : (M, 3) array
        m in the world.
    decision : Decision
    sent, measured : sequence of d float
        Flexion that was sent to the finger of each freedom, and that it measured; NaN
        without one.
    durations : (float, float)
        Of solving, and from receipt to command, s.
    """
    solved = decision.solved
    session.row("markers", [*timing, *markers.ravel().tolist()])
    session.row(
        "model",
        [
            *solved.q[:7].tolist(),
            *np.degrees(solved.q[7:]).tolist(),
            *solved.hand_in_thorax.tolist(),
            *solved.c.tolist(),
            *decision.flexions,
            *sent,
            *measured,
            solved.residual,
            solved.worst_residual,
            solved.intermarker_error,
            *solved.uncertainty.tolist(),
            float(solved.inside),
            float(STATES.index(decision.state)),
            *durations,
        ],
    )


def write_event(session: RunWriter, time: float, name: str, text: str) -> None:
    """Write an event at a time since the start, s."""
    session.row("events", [time, 0.0, name, text])
