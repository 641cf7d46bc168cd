"""A study: declared in one file, simulated visit by visit, and resumed at any time.

A study folder holds ``study.toml`` and its results in ``visits``. Each simulated visit
is a cell of the design: one participant in one experiment under one variation of the
settings. It depends on the study's seed alone, not on the order, the number of workers
or the machine.
"""

from ikns.experiments.study.declaration import Study, read_study, study_from_table
from ikns.experiments.study.design import Parameters, PickingDesign, TrackingDesign
from ikns.experiments.study.example import init_study
from ikns.experiments.study.results import check_declaration, save_declaration
from ikns.experiments.study.run import StudyRun, run_study

__all__ = [
    "Parameters",
    "PickingDesign",
    "Study",
    "StudyRun",
    "TrackingDesign",
    "check_declaration",
    "init_study",
    "read_study",
    "run_study",
    "save_declaration",
    "study_from_table",
]
