"""``ikns markers check``: a marker set against recordings of a person."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import ikns
from ikns.cli.marker_options import (
    Movement,
    SetArgument,
    StaticFile,
    followed_sentence,
)
from ikns.cli.options import AsJson, From, MinStatic, To
from ikns.cli.output import notes, show, table
from ikns.cli.reading import Read, reads_markers
from ikns.errors import MarkerMismatch, naming

if TYPE_CHECKING:
    from ikns.calibration.set_check import CheckedJoint, FollowedSet, SetCheck

#: A marker this many placement deviations from its nominal place is pointed out.
_FAR = 3.0


@reads_markers
def check(
    read: Read,
    marker_set: SetArgument,
    static: StaticFile,
    movement: Movement = None,
    min_static: MinStatic = 1.0,
    from_: From = None,
    to: To = None,
    as_json: AsJson = False,
) -> None:
    """Compare a marker set with a static trial, and with a movement.

    How far each marker is from where the set expects it, in millimeters and in
    placement deviations, and the joint angles in which the person stands; with
    --movement, how far the markers are from the body that follows them. Exits with 2
    when the static trial must not be used, as of a mirror image. --from and --to take
    a part of the static trial.
    """
    from ikns.calibration.judge.finding import refusal, refused
    from ikns.calibration.set_check import check_marker_set, follow_movement

    frames = read(static, start=from_, end=to)
    worn = ikns.MarkerSet.load(marker_set)
    with naming(str(static)):
        found = check_marker_set(
            ikns.Skeleton.load(),
            frames,
            marker_set=worn,
            min_duration=min_static,
        )
    faults = refused(found.findings)
    moved = None
    if movement is not None and not faults:
        moved = follow_movement(
            ikns.Skeleton.load(),
            frames,
            read(movement),
            marker_set=worn,
            min_duration=min_static,
        )
    in_motion = {} if moved is None else moved.markers
    remarks = _remarks(found, moved)
    show(
        {
            "marker_set": marker_set,
            "static": static,
            "converged": found.converged,
            "markers": [
                {
                    "label": m.label,
                    "segment": m.link,
                    "seen": m.seen,
                    "offset_m": m.offset,
                    "offset_sd": m.offset_sd,
                    "residual_m": m.residual,
                    "residual_in_movement_m": in_motion.get(m.label),
                }
                for m in found.markers
            ],
            "movement": movement,
            "residual_in_movement_m": None if moved is None else moved.residual,
            "static_angles_deg": {j.joint: math.degrees(j.angle) for j in found.joints},
            "held": [j.joint for j in found.joints if j.held],
            "segment_lengths_m": found.lengths,
            "notes": remarks,
        },
        _marker_table(found, moved, f"{marker_set} in {static}"),
        _posture_table(found),
        *([] if moved is None else [followed_sentence(movement, moved.residual)]),
        # What the error says is not said twice.
        *notes(remarks[min(len(faults), 1) :]),
        as_json=as_json,
    )
    if faults:
        raise MarkerMismatch(refusal(faults))


def _remarks(found: SetCheck, moved: FollowedSet | None) -> list[str]:
    """Say what is unusual about the markers, the posture and the movement."""
    told = [f.sentence for f in found.findings]
    if any(f.severity == "refuse" for f in found.findings):
        # What follows from it is in the tables.
        return told
    return [
        *told,
        *(
            f"{m.label} is {m.offset_sd:.1f} standard deviations from its place: "
            "misplaced, swapped, or from another set."
            for m in found.markers
            if m.seen and m.offset_sd > _FAR
        ),
        *(f"{m.label} is never seen." for m in found.markers if not m.seen),
        *(
            f"{j.joint} is at {math.degrees(j.angle):.0f} deg, beyond its limits."
            for j in found.joints
            if _beyond(j)
        ),
        *([] if found.converged else ["the fit did not converge."]),
        *([] if moved is None else [one.sentence for one in moved.findings]),
    ]


def _beyond(j: CheckedJoint) -> bool:
    """Whether a joint is beyond its limits."""
    return not j.lower <= j.angle <= j.upper


def _marker_table(found: SetCheck, moved: FollowedSet | None, title: str) -> Any:
    """Return how far each marker is from its place, and from the body."""
    return table(
        title,
        {
            "marker": "s",
            "segment": "s",
            "off its place mm": ".1f",
            "in sd": ".1f",
            "residual mm": ".1f",
            **({} if moved is None else {"moving mm": ".1f"}),
        },
        [
            [
                m.label,
                m.link,
                1000 * m.offset,
                m.offset_sd,
                1000 * m.residual,
                *(
                    []
                    if moved is None
                    else [1000 * moved.markers.get(m.label, math.nan)]
                ),
            ]
            for m in found.markers
        ],
    )


def _posture_table(found: SetCheck) -> Any:
    """Return the joint angles of the static trial."""
    return table(
        "The person stands like this",
        {"joint": "s", "deg": ".0f", "limits deg": "s", "note": "s"},
        [
            [
                j.joint,
                math.degrees(j.angle),
                f"{math.degrees(j.lower):z.0f} .. {math.degrees(j.upper):z.0f}",
                "held" if j.held else "beyond" if _beyond(j) else "",
            ]
            for j in found.joints
        ],
    )
