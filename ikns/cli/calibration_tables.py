"""Tables and sentences of ``ikns calibrate``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from ikns.cli.output import held_sentences, notes, table


def _axes(body: dict[str, Any]) -> list[str]:
    """Say how the axes lie that the explorations show, against the generic body's."""
    told = [
        f"{name[:-2].replace('_', ' ')} {math.degrees(body['tilts_rad'][name]):+.1f} "
        f"about {name[-1].upper()} (sd {math.degrees(body['tilt_sd_rad'][name]):.1f})"
        for name in body.get("tilts_shown", [])
    ]
    return (
        [f"Joint axes relative to the generic body's, deg: {', '.join(told)}."]
        if told
        else []
    )


def calibration_parts(report: dict[str, Any]) -> list[Any]:
    """Return tables and sentences on the quality of a calibration."""
    static, extrinsic = report["static"], report["extrinsic"]
    # Folders from before explorations were used have no body of both.
    body = report.get("body") or static
    least = report["settings"]["min_samples"]
    seen = [item for item in extrinsic["joints_deg"].items() if item[1] is not None]
    moved = sorted(seen, key=lambda item: -item[1])[:2]
    places = report.get("methods", {}).get("places", [])
    scatter = {place["point"]: place["scatter"] for place in places}
    return [
        table(
            "Segments, joint to joint"
            + ", assumed from stature" * (static["source"] is None),
            {"segment": "s", "length mm": ".1f", "sd mm": ".1f"},
            [
                [name, 1000 * length, 1000 * body["length_sd_m"][name]]
                for name, length in body["lengths_m"].items()
            ],
        ),
        *_axes(body),
        table(
            "Explorations",
            {"recording": "s", "s": ".1f", "still s": ".1f", "residual mm": ".1f"},
            [
                [
                    Path(row["source"]).name,
                    row["duration_s"],
                    row["still_s"],
                    1000 * (row["residual_median_m"] or math.nan),
                ]
                for row in report["explorations"]
            ],
        ),
        table(
            f"PCA points of {report['chain']} in the thorax frame",
            {
                "point": "d",
                "forward\nmm": ".0f",
                "up\nmm": ".0f",
                "right\nmm": ".0f",
                "still\nsamples": "d",
                "end error\n% of range": ".0f",
                "verdict": "s",
            },
            [
                [
                    row["point"],
                    *(1000 * x for x in row["center_m"]),
                    row["samples"],
                    100 * scatter.get(row["point"], math.nan),
                    _verdict(row, least, report["settings"]["n_dof"]),
                ]
                for row in report["points"]
            ],
        ),
        "Outside the chain, while the hand was still: thorax "
        f"{1000 * extrinsic['thorax_translation_m']:.0f} mm and "
        f"{extrinsic['thorax_rotation_deg']:.0f} deg"
        + "; the joints that moved most: " * bool(moved)
        + " and ".join(f"{name} {angle:.0f} deg" for name, angle in moved)
        + ".",
        *held_sentences(static["held"]),
        *methods_parts(report),
        *notes([*report["warnings"], *report.get("methods", {}).get("warnings", [])]),
    ]


def methods_parts(report: dict[str, Any]) -> list[Any]:
    """Say which methods were learned, and what c of each does without intent.

    A folder of before has nothing to say of them.
    """
    methods = report.get("methods")
    if methods is None:
        return ["Methods learned: paper. Calibrated before other methods existed."]
    lost = methods["without"]
    known = [name for name in ("paper", "proximal", "intent") if name not in lost]
    parts = [f"Methods learned: {', '.join(known)}."]
    parts += [
        f"{name} was not learned: {reason.rstrip('.')}."
        for name, reason in lost.items()
    ]
    if "intent" not in lost:
        taught = methods["natural_posture"]
        parts.append(
            f"Natural posture: of {taught['frames']} frames of this person's movement."
            if taught["frames"]
            else "Natural posture: that of other people, as there was too little "
            "ordinary movement; add some with --natural."
        )
    found = methods.get("summary")
    if found is None:
        return parts
    from ikns.calibration.method_summary import recommendation

    return [_changes(found), *parts, recommendation(found)]


def _changes(found: dict[str, Any]) -> Any:
    """Return what c of each method does without intent."""
    from ikns.calibration.method_summary import counted_reaches

    counts = found["reaches"]
    natural = counts["natural"]
    return table(
        "Change of c without intent (mean; 1 is the whole range)",
        {
            "method": "s",
            f"{counted_reaches(counts['between_places'])}\nbetween points": ".2f",
            f"{natural} natural\n{'reach' if natural == 1 else 'reaches'}": ".2f",
            "% of reaches\nabove 0.2": ".0f",
            f"hand turned\nby {found['turned_deg']:.0f} deg": ".2f",
        },
        [
            [
                name,
                *(
                    math.nan if value is None else scale * value
                    for scale, value in (
                        (1, row["between_places"]),
                        (1, row["natural"]),
                        (100, row["above_0.2"]),
                        (1, row["turned_hand"]),
                    )
                ),
            ]
            for name, row in found["methods"].items()
        ],
    )


def _verdict(row: dict[str, Any], least: int, n_dof: int) -> str:
    if row["point"] is None:
        few = row["samples"] < least
        return f"left out: fewer than {least}" if few else "left out: freedoms"
    if row["components"] > n_dof:
        return f"used, but took {row['components']} components"
    return "used"


def shift_sentence(about: dict[str, Any], methods: list[str]) -> str:
    """Say by how much intent was shifted, and what was not."""
    if about["shift_rad"] is None:
        return (
            f"The markers' places are fitted; nothing was shifted, as {about['why']}."
        )
    rest = " and ".join(name for name in methods if name != "intent")
    return (
        "The markers' places are fitted, and intent's range is shifted by "
        f"{math.degrees(about['shift_rad']):+.1f} deg ({about['in_units_of_c']:+.3f} "
        f"of c), as {about['moving_s']:.0f} s of ordinary movement show; {rest} only "
        "know the new places."
    )
