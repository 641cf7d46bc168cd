"""The live loop: source, pose, signal, finger, session; and again from disk."""

from ikns.runtime.loop import Report, Status, run
from ikns.runtime.replay import Replayed, replay_run

__all__ = ["Replayed", "Report", "Status", "replay_run", "run"]
