"""A live loop on Rerun's timeline."""

from __future__ import annotations

import math

import numpy as np

from ikns.body.skeleton import Skeleton
from ikns.live.publish import PublishedFrame
from ikns.nullspace.signal_names import signal_names
from ikns.view.timeline.entries import frame_entries
from ikns.view.timeline.rerun import RerunLog


class RerunSink:
    """Logs frames and events of a live loop; a ``Sink`` of a publisher.

    Time 0 is the first event or frame.

    Parameters
    ----------
    log : RerunLog
        Closed with the sink.
    skeleton : Skeleton or None
        Whose markers come; None: only events do.
    """

    def __init__(self, log: RerunLog, skeleton: Skeleton | None) -> None:
        self._log, self._skeleton = log, skeleton
        self._start = math.nan

    def sample(self, at: float, sample: PublishedFrame) -> None:
        """Log a frame, received at a time of `time.monotonic`."""
        assert self._skeleton is not None
        decision = sample.decision
        solved = decision.solved
        n = len(solved.c)
        names = [*signal_names(n), *signal_names(n, "flexion")]
        values = (*solved.c.tolist(), *decision.flexions)
        numbers = {f"signal/{name}": v for name, v in zip(names, values, strict=True)}
        numbers |= {
            "residual/rms_mm": 1e3 * solved.residual,
            "residual/worst_mm": 1e3 * solved.worst_residual,
        }
        q = solved.q if decision.valid else np.full_like(solved.q, np.nan)
        labels = self._skeleton.marker_set.labels
        entries = frame_entries(self._skeleton, labels, sample.markers, q, numbers)
        self._log.frame(self._since(at), entries)

    def event(self, at: float, words: str) -> None:
        """Log an event."""
        self._log.event(self._since(at), words)

    def close(self) -> None:
        """Write what is left."""
        self._log.close()

    def _since(self, at: float) -> float:
        if math.isnan(self._start):
            self._start = at
        return at - self._start
