"""The page that ``ikns demo`` writes: pictures first, every number with its meaning."""

from __future__ import annotations

import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ikns.body.chains import SIDES, chain_joints
from ikns.calibration.subject import Subject
from ikns.motion.motion import Motion
from ikns.nullspace.map import still_mask
from ikns.simulation import Protocol
from ikns.view.figures import (
    arm_points,
    control_figure,
    directions_figure,
    principal_angle_figure,
    residual_figure,
    swivel_figure,
    workspace_figure,
)
from ikns.view.report import KeyNumber, Picture, Section, Step, Table, write_report
from ikns.view.style import house_style

__all__ = ["StillSamples", "still_samples", "write_demo_report"]

#: What is asked of a simulated subject with 1 mm of marker noise, rad.
_ANGLE_GOAL = np.radians(6.0)
#: Dots per inch of the picture beside the report: a page's width, under 200 kB.
_DPI = 110


class StillSamples(NamedTuple):
    """The samples that the map was learned from, with the truth beside them.

    Parameters
    ----------
    hand : (N, 3) array
        m in the thorax frame.
    labels : (N,) integer array
        PCA point, -1 for none.
    c : (N,) array
        Unclipped control signal.
    swivel : (N,) array
        True elbow swivel, rad.
    correlations : list of P float
        Of the two at each point.
    """

    hand: NDArray[np.float64]
    labels: NDArray[np.int64]
    c: NDArray[np.float64]
    swivel: NDArray[np.float64]
    correlations: list[float]


def still_samples(subject: Subject, swivel: NDArray[np.float64]) -> StillSamples:
    """Collect the still samples of a calibration with one exploration."""
    motion, learned = subject.motions[0], subject.null_space_map
    gate = still_mask(motion, subject.chain)
    x = motion.task_position(subject.chain)[gate]
    c = learned.control_signal(motion.chain_angles(subject.chain)[gate], x)
    true = swivel[gate]
    correlations = []
    for k in range(len(learned.centers_)):
        own = (learned.labels_ == k) & np.isfinite(true) & np.isfinite(c)
        correlations.append(float(np.corrcoef(c[own], true[own])[0, 1]))
    return StillSamples(x, learned.labels_, c, true, correlations)


def write_demo_report(
    path: Path,
    *,
    run: Protocol,
    subject: Subject,
    reaching: Motion,
    at_rest: StillSamples,
    summary: dict[str, Any],
) -> None:
    """Write ``report.html``, and beside it ``workspace.png`` for slides.

    Parameters
    ----------
    path : Path
    run : Protocol
        What was simulated.
    subject : Subject
        Calibrated from its files, `motions` included.
    reaching : Motion
        The free exploration as tracked.
    at_rest : StillSamples
    summary : dict
        As in ``summary.json``.
    """
    learned, chain, motion = subject.null_space_map, subject.chain, subject.motions[0]
    rows = summary["points"]
    nothing = np.full(learned.directions_.shape[1:], np.nan).tolist()
    angles = [np.radians(row.get("angle_deg", [np.nan])[0]) for row in rows]
    posture = motion.q[np.argmin(np.abs(motion.time - motion.time.mean()))]
    raw = learned.control_signal(
        reaching.chain_angles(chain), reaching.task_position(chain)
    )
    facets = getattr(learned.interpolator_, "hull_facets", None)
    worst = min(at_rest.correlations, key=abs)
    picture = {
        "workspace": workspace_figure(
            motion.task_position(chain),
            at_rest.hand,
            at_rest.labels,
            learned.centers_,
            facets=facets,
            arms=arm_points(subject.skeleton, posture),
            simulated=True,
        ),
        "directions": directions_figure(
            learned.directions_,
            chain_joints(chain),
            analytic=[row.get("analytic_direction", nothing) for row in rows],
            simulated=True,
        ),
        "angles": principal_angle_figure(
            {"hand position and orientation held": angles},
            goal=_ANGLE_GOAL,
            simulated=True,
        ),
        "swivel": swivel_figure(
            at_rest.swivel,
            at_rest.c,
            at_rest.labels,
            at_rest.correlations,
            simulated=True,
        ),
        "control": control_figure(
            reaching.time,
            raw,
            reaching.hand_speed(chain),
            learned.inside(reaching.task_position(chain)),
            gate=0.05,
            simulated=True,
        ),
        "residual": residual_figure(motion.time, motion.residual, simulated=True),
    }
    with house_style():
        picture["workspace"].savefig(
            path.with_name("workspace.png"), dpi=_DPI, metadata={"Software": None}
        )
    lengths = summary["length_error_m"]
    leaks = [row["learned_leak_m"] for row in rows if "learned_leak_m" in row]
    write_report(
        path,
        title=f"Virtual subject {summary['seed']}: from markers to a control signal",
        lead=(
            "A simulated person went through the calibration of the paper. The C3D "
            "files alone gave a scaled skeleton, joint angles, a null-space map and "
            "the control signal c; this page holds them against the simulated truth."
        ),
        facts={
            "seed": summary["seed"],
            "sex": summary["person"]["sex"],
            "stature (m)": round(summary["person"]["stature_m"], 3),
            "mass (kg)": round(summary["person"]["mass_kg"], 1),
            "chain": chain,
            "PCA points": len(learned.centers_),
            "ikns": version("ikns"),
            "Python": platform.python_version(),
        },
        key_numbers=[
            KeyNumber(
                "c against the true elbow swivel",
                f"r = {worst:+.3f} at the worst point",
                "1 means that c is the swivel; one sign everywhere means that lifting "
                "the elbow never turns the robot the other way.",
            ),
            KeyNumber(
                "learned against analytic direction",
                f"{np.degrees(np.nanmax(angles)):.1f} deg at the worst point",
                "The analytic direction is the null space of the Jacobian, averaged "
                "over the visited postures.",
            ),
            KeyNumber(
                "leak",
                f"{1000 * np.median(leaks):.1f} mm at the median point",
                "How far the hand goes with c from 0 to 1; it should stay.",
            ),
            KeyNumber(
                "segment lengths",
                f"{1000 * max(map(abs, lengths.values())):.1f} mm off at most",
                "The static trial settles the body that all angles rest on.",
            ),
            KeyNumber(
                "marker residual",
                f"{1000 * summary['residual_median_m']:.1f} mm",
                "Median over frames; simulated cameras have 1 mm of noise per axis.",
            ),
        ],
        sections=[
            Section(
                "Where the null space was learned",
                [
                    "Samples count as still while the hand is slower than 0.05 m/s. "
                    "They are clustered around the PCA points; in each cluster the "
                    "arm moves along one direction Z of joint space."
                ],
                [
                    Picture(
                        picture["workspace"],
                        "Hand path, still samples by PCA point, and the interpolation "
                        "volume, in the thorax frame.",
                        "Two 3-D views of the hand's workspace in front of the body",
                    )
                ],
            ),
            Section(
                "Directions",
                pictures=[
                    Picture(
                        picture["directions"],
                        "Bars by joint. The elbow's bar is near zero: with the hand "
                        "held, the distance from shoulder to wrist is fixed.",
                        "Bar charts of the direction Z at each PCA point",
                    ),
                    Picture(
                        picture["angles"],
                        "Angle between learned and analytic direction.",
                        "Dots: one angle per PCA point",
                    ),
                ],
            ),
            Section(
                "Control signal",
                [
                    "While the hand reaches elsewhere c moves too (crosstalk): the map "
                    "only promises meaning while the hand is held."
                ],
                [
                    Picture(
                        picture["swivel"],
                        "c against the true elbow swivel while the hand is still. Same "
                        "slope everywhere: same sign.",
                        "Scatter plots, one per PCA point",
                    ),
                    Picture(
                        picture["control"],
                        "The free exploration, which the map has not seen; "
                        "`control.csv` holds it clipped to 0 to 1.",
                        "Time series of c and of the hand speed",
                    ),
                ],
            ),
            Section(
                "Body and tracking",
                pictures=[
                    Picture(
                        picture["residual"],
                        "Distance between seen and modeled markers.",
                        "Time series of the marker residual",
                    )
                ],
                tables=[
                    Table(
                        ["segment", "true mm", "found mm", "error mm"],
                        [
                            [
                                name,
                                1000 * length,
                                1000 * (length + lengths[name]),
                                1000 * lengths[name],
                            ]
                            for name, length in sorted(
                                run.subject.skeleton.segment_lengths.items()
                            )
                            if name.startswith(SIDES)
                        ],
                        "Segment lengths, joint to joint.",
                    )
                ],
            ),
        ],
        next_steps=[
            Step(
                "ikns view subject recordings/points.c3d --open",
                "See body, map and motion in 3-D, as in `view.html` beside this page:",
            ),
            Step(
                "ikns calibrate --static static.c3d --exploration points.c3d "
                "--out person",
                "Calibrate a person from your own recordings:",
            ),
            Step(
                "ikns control --subject person recording.c3d --out control.csv",
                "Turn any recording into the control signal:",
            ),
        ],
        simulated=True,
    )
