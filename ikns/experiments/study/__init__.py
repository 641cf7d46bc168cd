"""A study: declared in one file, simulated cell by cell, and gone on with where it was.

A study folder holds ``study.toml`` and what came of it in ``visits``. A cell is one
participant in one experiment under one variation of the settings. Cells depend on the
study's seed and on nothing else: not on the order, the number of workers, or where they
run.
"""

from ikns.experiments.study.declaration import Study, read_study, study_from_table
from ikns.experiments.study.design import Parameters, PickingDesign, TrackingDesign
from ikns.experiments.study.example import init_study
from ikns.experiments.study.results import check_declared, keep_declared
from ikns.experiments.study.run import StudyRun, run_study

__all__ = [
    "Parameters",
    "PickingDesign",
    "Study",
    "StudyRun",
    "TrackingDesign",
    "check_declared",
    "init_study",
    "keep_declared",
    "read_study",
    "run_study",
    "study_from_table",
]
