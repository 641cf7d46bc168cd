"""Virtual subjects: simulated people whose true motion is known."""

from ikns.simulation.folder import write_protocol
from ikns.simulation.movement import Unsteadiness
from ikns.simulation.protocol import Protocol, simulate_protocol
from ikns.simulation.robot import explore_null_space, reach_pose
from ikns.simulation.subject import VirtualSubject, virtual_subject
from ikns.simulation.trial import Trial

__all__ = [
    "Protocol",
    "Trial",
    "Unsteadiness",
    "VirtualSubject",
    "explore_null_space",
    "reach_pose",
    "simulate_protocol",
    "virtual_subject",
    "write_protocol",
]
