"""Control: from what cameras see in one frame to the control signal."""

from ikns.control.frame import ControlFrame, FrameSolver

__all__ = ["ControlFrame", "FrameSolver"]
