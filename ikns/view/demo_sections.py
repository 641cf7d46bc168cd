"""Sections of the page that ``ikns demo`` writes, after its figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from ikns.body.chains import SIDES
from ikns.calibration.method_summary import recommendation
from ikns.experiments.demo import Demo
from ikns.view.elbow import elbow_widget
from ikns.view.report import (
    Picture,
    Section,
    Table,
)


def elbow_section(demo: Demo) -> Section:
    """Let the reader move the elbow."""
    return Section(
        "Move the elbow yourself",
        [
            "The hand keeps its position and orientation; all that is left to the arm "
            "is to turn the elbow about the line from shoulder to wrist. Drag the "
            "elbow: c follows, and so does the finger. The page computes this itself "
            "from the map. The person is simulated.",
        ],
        widget=elbow_widget(demo.subject),
    )


def signal_section(figures: Mapping[str, Figure]) -> Section:
    """Show c against the truth, and over time."""
    return Section(
        "Control signal",
        [
            "c is meaningful while the hand is held. While the hand moves, c changes "
            "too (crosstalk)."
        ],
        [
            Picture(
                figures["swivel"],
                "c against the true elbow swivel while the hand is still. Slopes of "
                "one sign mean that lifting the elbow moves the finger the same way "
                "everywhere.",
                "Scatter plots, one per PCA point",
            ),
            Picture(
                figures["control"],
                "c during the free exploration, which was not used to learn the map; "
                "`control.csv` has it clipped to 0 to 1.",
                "Time series of c and of the hand speed",
            ),
        ],
    )


def map_sections(figures: Mapping[str, Figure]) -> list[Section]:
    """Where the map was learned, and its directions."""
    return [
        Section(
            "Where the null space was learned",
            [
                "Samples count as still while the hand is slower than 0.05 m/s. "
                "They are clustered around the PCA points; in each cluster the "
                "arm moves along one direction Z of joint space."
            ],
            [
                Picture(
                    figures["workspace"],
                    "Hand path, still samples by PCA point, and the interpolation "
                    "volume, in the thorax frame.",
                    "Two 3-D views of the hand's workspace in front of the body",
                )
            ],
        ),
        Section(
            "Directions",
            folded=True,
            pictures=[
                Picture(
                    figures["directions"],
                    "Bars by joint. The elbow's bar is near zero: with the hand "
                    "held, the distance from shoulder to wrist is fixed.",
                    "Bar charts of the direction Z at each PCA point",
                ),
                Picture(
                    figures["angles"],
                    "Angle between learned and analytic direction.",
                    "Dots: one angle per PCA point",
                ),
            ],
        ),
    ]


def methods_section(
    figures: Mapping[str, Figure], demo: Demo, summary: Mapping[str, Any]
) -> Section:
    """Say what c of each method can mean, with this subject's numbers."""
    found = summary["methods"]
    reach = f"{100 * demo.curves.reach_distance:.0f} cm"
    return Section(
        "Posture or intent",
        [
            "Posture is not intent: people turn the elbow whenever they reach, and "
            "the paper's c follows posture. `paper` reads all joints of the chain, so "
            "turning the hand changes it; `proximal` reads the upper arm and elbow "
            "flexion only; `intent` reads the elbow's swivel minus what is usual for "
            "this person with the hand there and pointing so. No method knows what a "
            "person wants: even `intent` only says how far the elbow departs from the "
            "usual.",
            recommendation(found),
        ],
        [
            Picture(
                figures["methods"],
                f"Left: a reach of {reach} without intent. Middle: the forearm turns "
                "while elbow and wrist stay. In both c should not change. Right: the "
                "hand is held and the elbow lifted; c should follow.",
                "Three panels of the control signal, one line or cloud per method",
            )
        ],
        [
            Table(
                [
                    "method",
                    "change on a reach",
                    "share of reaches above 0.2",
                    "change with a turned hand",
                ],
                [
                    [method, *(row[name] for name in _reach_columns(found))]
                    for method, row in found["methods"].items()
                ],
                "Mean change of c without intent; the forearm turns by "
                f"{found['turned_deg']:.0f} deg.",
            )
        ],
    )


def reach_changes(found: Mapping[str, Any]) -> dict[str, float]:
    """Return the mean change of c on a reach, by method, where it is known."""
    kind = _reach_columns(found)[0]
    rows = found["methods"].items()
    return {method: row[kind] for method, row in rows if row[kind] is not None}


def _reach_columns(found: Mapping[str, Any]) -> tuple[str, str, str]:
    """Columns to show: ordinary movement where there was any."""
    kind = "natural" if found["reaches"]["natural"] else "between_places"
    return kind, "above_0.2", "turned_hand"


def body_section(
    figures: Mapping[str, Figure], demo: Demo, summary: Mapping[str, Any]
) -> Section:
    """Marker residual, and segment lengths against the truth."""
    errors = summary["length_error_m"]
    true = demo.protocol.subject.skeleton.segment_lengths
    return Section(
        "Body and tracking",
        folded=True,
        pictures=[
            Picture(
                figures["residual"],
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
                        1000 * (length + errors[name]),
                        1000 * errors[name],
                    ]
                    for name, length in sorted(true.items())
                    if name.startswith(SIDES)
                ],
                "Segment lengths, joint to joint.",
            )
        ],
    )
