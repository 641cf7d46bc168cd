"""A simulated Dynamixel servo on a pseudo-terminal, for work without hardware."""

from ikns.finger.emulator.device import Servo
from ikns.finger.emulator.faults import FAULTS, Fault, parse_fault
from ikns.finger.emulator.wire import Wire

__all__ = ["FAULTS", "Fault", "Servo", "Wire", "parse_fault"]
