"""The whole line on a virtual subject, from C3D files to a control signal."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from ikns.calibration import calibrate
from ikns.calibration.simulated import SwivelSamples, swivel_samples
from ikns.calibration.steps import FITTING, JUDGING, LEARNING, METHODS, SCALING
from ikns.calibration.subject import Subject
from ikns.experiments.method_curves import MethodCurves, method_curves
from ikns.live.control.recorded import ControlTable, control_table
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.recording.files import read
from ikns.recording.part import between
from ikns.recording.recording import Recording
from ikns.simulation import (
    Protocol,
    simulate_protocol,
    virtual_subject,
    write_protocol,
)

#: Step of the command after :func:`run_demo`.
DRAWING = "drawing"
#: All steps of `ikns demo` and what they cost, CPU s; see `ikns.calibration.steps`.
DEMO_STEPS = (
    ("simulating", 1.2),
    (SCALING, 0.25),
    (JUDGING, 0.15),
    ("points.c3d", 0.16),
    (FITTING, 0.27),
    ("points.c3d", 0.16),
    (LEARNING, 0.1),
    (METHODS, 0.3),
    ("free.c3d", 0.2),
    (DRAWING, 2.9),
)
#: Share of the free exploration that teaches the natural posture.
_NATURAL = 1 / 3


class Demo(NamedTuple):
    """A calibrated virtual subject, and the truth.

    Parameters
    ----------
    seed : int
    quick : bool
    protocol : Protocol
        What was simulated.
    subject : Subject
        Calibrated from the files alone; its motion is the exploration of the points.
    points : Recording
        The exploration of the points, as read.
    reaching : Motion
        The free exploration, which the map has not seen; its first third taught the
        natural posture.
    control : ControlTable
        Control signal during the free exploration.
    still : SwivelSamples
        Control signal and true swivel on the samples that the map was learned from.
    curves : MethodCurves
        What c of each method does on a reach that taught nothing, with a turned hand,
        and at a held hand.
    """

    seed: int
    quick: bool
    protocol: Protocol
    subject: Subject
    points: Recording
    reaching: Motion
    control: ControlTable
    still: SwivelSamples
    curves: MethodCurves


def run_demo(
    folder: Path,
    *,
    seed: int = 1,
    quick: bool = False,
    progress: Callable[[str, int, int], None] = lambda step, done, total: None,
) -> Demo:
    """Simulate a calibration as files, calibrate from them, and compare with the truth.

    Parameters
    ----------
    folder : Path
        Existing folder; gets ``recordings`` and ``subject``.
    seed : int
        Which virtual subject.
    quick : bool
        3 s a point instead of 5 s.
    progress : callable
        Called with (step, done, total) of :data:`DEMO_STEPS`.
    """
    progress("simulating", 0, 1)
    protocol = simulate_protocol(virtual_subject(seed), seed=seed, quick=quick)
    files = write_protocol(folder / "recordings", protocol)
    progress("simulating", 1, 1)

    # From here on as with a real person: nothing but the files is used.
    static, free, points = (read(path) for path in files)
    parted = float(free.time[0] + _NATURAL * (free.time[-1] - free.time[0]))
    subject = calibrate(
        static, [points], natural=[between(free, end=parted)], progress=progress
    )
    report = subject.report | {"simulated": True}
    subject = dataclasses.replace(subject, report=report)
    subject.save(folder / "subject")
    reaching = MarkerIK(subject.skeleton).track(
        free, chain=subject.chain, progress=partial(progress, "free.c3d")
    )
    control = control_table(subject, reaching)

    still = swivel_samples(subject, protocol.points.swivel)
    curves = method_curves(subject, reaching, still, after=parted)
    return Demo(
        seed, quick, protocol, subject, points, reaching, control, still, curves
    )


def demo_summary(
    demo: Demo, rows: list[dict[str, Any]], warned: Sequence[str]
) -> dict[str, Any]:
    """Return the numbers of a demo, ready for ``summary.json``.

    Parameters
    ----------
    demo : Demo
    rows : list of dict
        Learned against analytic at each PCA point.
    warned : sequence of str
        Warnings of that comparison.
    """
    person = demo.protocol.subject
    true = person.skeleton.segment_lengths
    found = demo.subject.skeleton.segment_lengths
    correlations, report = demo.still.correlations, demo.subject.report
    return {
        "simulated": True,
        "ikns": version("ikns"),
        "seed": demo.seed,
        "quick": demo.quick,
        "person": {
            "sex": person.adult.sex,
            "stature_m": person.adult.stature_m,
            "mass_kg": person.adult.mass_kg,
        },
        "length_error_m": {name: found[name] - true[name] for name in true},
        "residual_median_m": report["explorations"][0]["residual_median_m"],
        "r_of_c_and_true_swivel": correlations,
        "same_sign_everywhere": bool(min(correlations) * max(correlations) > 0),
        "points": rows,
        "control_while_reaching_freely": demo.control.summary,
        "methods": report["methods"]["summary"],
        "warnings": [*report["warnings"], *warned],
    }
