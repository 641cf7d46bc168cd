"""Conduct a visit: commands and control signals in, screen contents and files out.

`conductor` executes commands, `visit_state` is the state machine, `tracking` and
`picking` are the two experiments, `visit_log` keeps every attempt on disk. `inputs`
are sources of a control signal, `live` and `ring` those with a finger. `visit_loop`
runs them all in real time. There is no screen here.
"""

from ikns.experiments.conduct.conductor import Conductor
from ikns.experiments.conduct.experiment import COMMANDS, Command, Experiment
from ikns.experiments.conduct.inputs import Driver, HeldInput, Sample, VirtualInput
from ikns.experiments.conduct.picking import PickingExperiment
from ikns.experiments.conduct.tracking import TrackingExperiment
from ikns.experiments.conduct.visit_log import VisitLog
from ikns.experiments.conduct.visit_loop import run_visit

__all__ = [
    "COMMANDS",
    "Command",
    "Conductor",
    "Driver",
    "Experiment",
    "HeldInput",
    "PickingExperiment",
    "Sample",
    "TrackingExperiment",
    "VirtualInput",
    "VisitLog",
    "run_visit",
]
