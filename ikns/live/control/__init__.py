"""Control: from the markers of a frame to the control signal and the flexion."""

from ikns.live.control.frame import ControlFrame, FrameSolver

__all__ = ["ControlFrame", "FrameSolver"]
