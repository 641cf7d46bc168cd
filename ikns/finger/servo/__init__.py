"""A simulated Dynamixel servo on a pseudo-terminal, for work without hardware."""

from ikns.finger.servo.device import Servo
from ikns.finger.servo.faults import FAULTS, Fault, parse_fault
from ikns.finger.servo.wire import Wire

__all__ = ["FAULTS", "Fault", "Servo", "Wire", "parse_fault"]
