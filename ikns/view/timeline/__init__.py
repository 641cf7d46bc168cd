"""Markers, arms, c, residuals and events on one timeline, for the viewer Rerun.

`entries` says what a frame shows, `rerun` hands it to the library, `recording` does so
for a recording and `sink` for a live loop.
"""

from ikns.view.timeline.recording import log_recording
from ikns.view.timeline.rerun import RerunLog
from ikns.view.timeline.sink import RerunSink

__all__ = ["RerunLog", "RerunSink", "log_recording"]
