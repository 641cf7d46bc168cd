"""Control: from the markers of a frame to the control signal and the flexion."""

from ikns.live.control.frame import FrameSolver
from ikns.live.control.frame_result import ControlFrame

__all__ = ["ControlFrame", "FrameSolver"]
