"""Control: from what cameras see in one frame to the control signal."""

from ikns.control.carried import carried
from ikns.control.frame import ControlFrame, FrameSolver
from ikns.control.null_rate import null_rate
from ikns.control.rate import RateControl

__all__ = ["ControlFrame", "FrameSolver", "RateControl", "carried", "null_rate"]
