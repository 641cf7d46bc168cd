"""Experiment 2: pick an object and place it, with the finger. No screen, no clock."""

from ikns.experiments.picking.objects import OBJECT_IDS, PickObject, load_objects
from ikns.experiments.picking.schedule import LIMIT, PickStep, pick_schedule
from ikns.experiments.picking.trial import PickMachine, PickRecord, PickView
from ikns.experiments.picking.visit import PickAttempt, PickVisit

__all__ = [
    "LIMIT",
    "OBJECT_IDS",
    "PickAttempt",
    "PickMachine",
    "PickObject",
    "PickRecord",
    "PickStep",
    "PickView",
    "PickVisit",
    "load_objects",
    "pick_schedule",
]
