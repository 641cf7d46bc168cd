"""Wearable robotic fingers, simulated and real, safe below any controller.

Research software, not a medical device. :class:`Safety` holds the limits, timeouts and
safe state of a finger, :class:`Finger` is the interface of every finger, and
:func:`check_finger` tests an implementation of it.
"""

from ikns.finger.check import FingerReport, check_finger
from ikns.finger.dynamixel import DynamixelFinger
from ikns.finger.errors import FingerError
from ikns.finger.group import FingerGroup
from ikns.finger.guard import Safety
from ikns.finger.lerobot import LeRobotFinger
from ikns.finger.limiter import Limiter, Limits
from ikns.finger.opening import open_finger, open_fingers
from ikns.finger.relay import RelayFinger
from ikns.finger.ros import RosFinger
from ikns.finger.simulated import SimulatedFinger
from ikns.finger.state import MODES, SAFE_STATES, Finger, FingerState

__all__ = [
    "MODES",
    "SAFE_STATES",
    "DynamixelFinger",
    "Finger",
    "FingerError",
    "FingerGroup",
    "FingerReport",
    "FingerState",
    "LeRobotFinger",
    "Limiter",
    "Limits",
    "RelayFinger",
    "RosFinger",
    "Safety",
    "SimulatedFinger",
    "check_finger",
    "open_finger",
    "open_fingers",
]
