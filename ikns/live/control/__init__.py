"""Control: from the markers of a frame to the control signal and the flexion."""

from ikns.live.control.frame import ControlFrame, FrameSolver
from ikns.live.control.null_rate import null_rate
from ikns.live.control.rate import RateControl
from ikns.live.control.reach_gain import reach_gain

__all__ = ["ControlFrame", "FrameSolver", "RateControl", "null_rate", "reach_gain"]
