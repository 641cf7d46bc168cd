"""Conduct a visit: commands and control signals in, what screens show out.

`conductor` is one visit as it goes on; `tracking` and `picking` are what it has to know
of an experiment; `book` keeps every attempt on disk; `inputs` are where a control
signal comes from, `live` and `ring` those with a finger; `carry` ties them to the
clock. There is no screen here.
"""

from ikns.experiments.conduct.conductor import Conductor
from ikns.experiments.conduct.experiment import COMMANDS, Command, Desk
from ikns.experiments.conduct.inputs import Driver, HeldInput, Sample, VirtualInput
from ikns.experiments.conduct.picking import PickingDesk
from ikns.experiments.conduct.tracking import TrackingDesk
from ikns.experiments.conduct.visit_log import VisitBook
from ikns.experiments.conduct.visit_loop import carry_out

__all__ = [
    "COMMANDS",
    "Command",
    "Conductor",
    "Desk",
    "Driver",
    "HeldInput",
    "PickingDesk",
    "Sample",
    "TrackingDesk",
    "VirtualInput",
    "VisitBook",
    "carry_out",
]
