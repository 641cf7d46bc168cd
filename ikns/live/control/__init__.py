"""Control: from what cameras see in one frame to the control signal."""

from ikns.live.control.frame import ControlFrame, FrameSolver
from ikns.live.control.null_rate import null_rate
from ikns.live.control.rate import RateControl
from ikns.live.control.reach_gain import reach_gain

__all__ = ["ControlFrame", "FrameSolver", "RateControl", "null_rate", "reach_gain"]
