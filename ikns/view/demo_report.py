"""The page that ``ikns demo`` writes: figures first, every number with its meaning."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ikns.body.chains import chain_joints
from ikns.experiments.demo import Demo
from ikns.view.demo_sections import (
    body_section,
    elbow_section,
    map_sections,
    methods_section,
    reach_changes,
    signal_section,
)
from ikns.view.figures import (
    arm_points,
    control_figure,
    directions_figure,
    methods_figure,
    principal_angle_figure,
    residual_figure,
    swivel_figure,
    workspace_figure,
)
from ikns.view.report import (
    KeyNumber,
    NextStep,
    report_html,
    write_report,
)
from ikns.view.style import figure_style

#: Largest angle expected of a simulated subject with 1 mm of marker noise, rad.
_ANGLE_GOAL = np.radians(6.0)
#: Hand speed below which samples were learned from: the default of a calibration, m/s.
_GATE = 0.05
#: Dots per inch of the picture next to the report: a page's width, under 200 kB.
_DPI = 110

_LEAD = (
    "A simulated person held the hand at ten places and swung the elbow at each (the "
    "calibration of Lisini Baldi et al., arXiv:2012.03600). From the C3D files alone "
    "came the body, the joint angles, and a map that turns the elbow's swing into the "
    "control signal c, from 0 to 1. This page compares them with the simulated truth. "
    "A PCA point is one of the places."
)
_NEXT_STEPS = (
    NextStep(
        "ikns view subject recordings/free.c3d --out free.html --open",
        "In this folder: another recording in 3-D (`view.html` shows points.c3d):",
    ),
    NextStep(
        "ikns calibrate --static static.c3d --exploration points.c3d --out person",
        "Calibrate a person from your own recordings:",
    ),
    NextStep(
        "ikns control --subject person recording.c3d --out control.csv",
        "Turn any recording into the control signal:",
    ),
)


def write_demo_report(path: Path, demo: Demo, summary: Mapping[str, Any]) -> None:
    """Write ``report.html``, and next to it ``workspace.png`` for slides.

    The summary is from :func:`ikns.experiments.demo.demo_summary`.
    """
    figures = _figures(demo, summary)
    with figure_style():
        figures["workspace"].savefig(
            path.with_name("workspace.png"), dpi=_DPI, metadata={"Software": None}
        )
    page = report_html(
        title=f"Virtual subject {demo.seed}: from markers to a control signal",
        lead=_LEAD,
        facts={
            "seed": demo.seed,
            "sex": summary["person"]["sex"],
            "stature (m)": round(summary["person"]["stature_m"], 3),
            "mass (kg)": round(summary["person"]["mass_kg"], 1),
            "chain": str(demo.subject.chain),
            "PCA points": len(demo.subject.null_space_map.centers_),
            "ikns": version("ikns"),
            "Python": platform.python_version(),
        },
        key_numbers=_key_numbers(summary),
        sections=[
            elbow_section(demo),
            signal_section(figures),
            methods_section(figures, demo, summary),
            *map_sections(figures),
            body_section(figures, demo, summary),
        ],
        next_steps=_NEXT_STEPS,
        simulated=True,
    )
    write_report(path, page)


def _figures(demo: Demo, summary: Mapping[str, Any]) -> dict[str, Figure]:
    """Draw every figure, by name."""
    subject, reaching, still = demo.subject, demo.reaching, demo.still
    curves = demo.curves
    learned, chain, motion = subject.null_space_map, subject.chain, subject.motions[0]
    rows = summary["points"]
    unknown = np.full(learned.directions_.shape[1:], np.nan).tolist()
    posture = motion.q[np.argmin(np.abs(motion.time - motion.time.mean()))]
    raw = learned.control_signal(
        reaching.chain_angles(chain), reaching.task_position(chain)
    )
    return {
        "workspace": workspace_figure(
            motion.task_position(chain),
            still.hand,
            still.labels,
            learned.centers_,
            facets=getattr(learned.interpolator_, "hull_facets", None),
            arms=arm_points(subject.skeleton, posture),
            simulated=True,
        ),
        "directions": directions_figure(
            learned.directions_,
            chain_joints(chain),
            analytic=[row.get("analytic_direction", unknown) for row in rows],
            simulated=True,
        ),
        "angles": principal_angle_figure(
            {"hand position and orientation held": np.radians(_angles_deg(summary))},
            goal=_ANGLE_GOAL,
            simulated=True,
        ),
        "swivel": swivel_figure(
            still.swivel, still.c, still.labels, still.correlations, simulated=True
        ),
        "control": control_figure(
            reaching.time,
            raw,
            reaching.hand_speed(chain),
            learned.inside(reaching.task_position(chain)),
            gate=_GATE,
            simulated=True,
        ),
        "methods": methods_figure(
            curves.reach_time,
            curves.reach,
            curves.turn,
            curves.turned,
            curves.swivel,
            curves.held,
            simulated=True,
        ),
        "residual": residual_figure(motion.time, motion.residual, simulated=True),
    }


def _angles_deg(summary: Mapping[str, Any]) -> list[float]:
    """Angle between both directions at every point, deg; NaN where unknown."""
    return [row.get("angle_deg", [np.nan])[0] for row in summary["points"]]


def _key_numbers(summary: Mapping[str, Any]) -> list[KeyNumber]:
    """Results to see first, each with its meaning."""
    worst = min(summary["r_of_c_and_true_swivel"], key=abs)
    rows, lengths = summary["points"], summary["length_error_m"]
    leaks, corrected = (
        [row[name] for row in rows if name in row]
        for name in ("learned_leak_m", "learned_leak_corrected_m")
    )
    return [
        KeyNumber(
            "c against the true elbow swivel",
            f"r = {worst:+.3f} at the worst point",
            "Correlation. 1 means that c rises exactly with the swivel; one sign "
            "everywhere means that lifting the elbow never moves the finger the wrong "
            "way.",
        ),
        KeyNumber(
            "learned against analytic direction",
            f"{np.nanmax(_angles_deg(summary)):.1f} deg at the worst point",
            "The analytic direction is the null space of the Jacobian, averaged "
            "over the visited postures; 0 would be the same direction.",
        ),
        KeyNumber(
            "leak",
            f"{1000 * np.median(leaks):.1f} mm at the median point",
            "How far the hand moves while c goes from 0 to 1; ideally 0. "
            + _noise_in(corrected),
        ),
        KeyNumber(
            "c on a reach",
            ", ".join(
                f"{method} {change:.2f}"
                for method, change in reach_changes(summary["methods"]).items()
            ),
            "Mean change of c without intent; ideally 0.",
        ),
        KeyNumber(
            "segment lengths",
            f"{1000 * max(map(abs, lengths.values())):.1f} mm off at most",
            "The static trial determines the body that all joint angles depend on.",
        ),
        KeyNumber(
            "marker residual",
            f"{1000 * summary['residual_median_m']:.1f} mm",
            "Distance between seen and modeled markers, median over frames; the "
            "simulated cameras have 1 mm of noise per axis.",
        ),
    ]


def _noise_in(corrected: list[float]) -> str:
    """Say at how many points noise alone explains the leak; without noise it is, m."""
    known = [leak for leak in corrected if np.isfinite(leak)]
    within, most = known.count(0.0), max(known, default=0.0)
    text = f"The noise of the markers explains it at {within} of {len(known)} points"
    return text + (f"; up to {1000 * most:.1f} mm remain." if most > 0 else ".")
