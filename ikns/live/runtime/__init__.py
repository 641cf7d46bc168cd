"""The live loop from a source of frames to a finger, and its replay."""

from ikns.live.runtime.loop import run
from ikns.live.runtime.priority import check_realtime
from ikns.live.runtime.replay import Replayed, replay_run
from ikns.live.runtime.report import AxisStatus, LoopStatus, Report

__all__ = [
    "AxisStatus",
    "LoopStatus",
    "Replayed",
    "Report",
    "check_realtime",
    "replay_run",
    "run",
]
