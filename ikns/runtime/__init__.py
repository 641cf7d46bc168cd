"""The live loop: source, pose, signal, finger, session; and again from disk."""

from ikns.runtime.loop import run
from ikns.runtime.priority import check_realtime
from ikns.runtime.replay import Replayed, replay_run
from ikns.runtime.report import Report, Status

__all__ = ["Replayed", "Report", "Status", "check_realtime", "replay_run", "run"]
