"""Experiment 2: pick and place objects with the finger; without screen or clock."""

from ikns.experiments.picking.objects import OBJECT_IDS, PickObject, load_objects
from ikns.experiments.picking.schedule import LIMIT, PickStep, pick_schedule
from ikns.experiments.picking.trial import PickRecord, PickTrial, PickView
from ikns.experiments.picking.visit import PickAttempt, PickVisit

__all__ = [
    "LIMIT",
    "OBJECT_IDS",
    "PickAttempt",
    "PickObject",
    "PickRecord",
    "PickStep",
    "PickTrial",
    "PickView",
    "PickVisit",
    "load_objects",
    "pick_schedule",
]
