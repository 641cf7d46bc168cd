"""What c of each method does where the person means nothing by it.

On reaches, between the held places and in natural movement, and while the hand turns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ikns.arrays import Array, Indices
from ikns.body.chains import ChainLike, end_sides
from ikns.calibration.folds import Folds
from ikns.calibration.subject import Subject
from ikns.motion.motion import Motion
from ikns.motion.reaches import find_reaches
from ikns.nullspace.readout import METHODS, IntentMap, Method, Readout
from ikns.nullspace.readout.coordinates import posture_samples
from ikns.nullspace.self_motion import visited_posture

#: The forearm turns by so much to either side, as for a glass that is emptied, rad.
TURN = np.radians(29.0)
#: A reach goes at least so far, m; fewer of them say nothing; c moves a lot by more
#: than this.
_FAR, _FEWEST, _LOT = 0.10, 5, 0.2
#: A method whose c a reach changes by more than this is not recommended: real people's
#: reaches change the paper's by 0.2, where the elbow was swung at held places.
_USELESS = 0.5
#: Methods that can be recommended. Proximal follows the elbow: in real people's reaches
#: its c changes more than that of intent, by 0.139 against 0.051, or 0.127 with the
#: natural posture of other people (benchmarks/README.md, null_space_bench).
_CHOICES: tuple[Method, ...] = ("paper", "intent")
#: Kinds of reaches as a sentence says them; natural ones decide where there are enough.
_REACHES = {"natural": "natural reach", "between_places": "reach between points"}


def method_summary(
    subject: Subject,
    explorations: Sequence[Motion] | None = None,
    natural: Sequence[Motion] = (),
    *,
    own: bool = False,
) -> dict[str, Any]:
    """Compare the methods of a subject when nothing is intended.

    Parameters
    ----------
    subject : Subject
        Also one from a folder; methods that it lacks are left out.
    explorations : sequence of Motion, optional
        With reaches between held places; default those of the calibration, which a
        folder does not hold.
    natural : sequence of Motion
        Ordinary movement.
    own : bool
        Whether the natural posture was learned from these motions. It is then learned
        again for each quarter of them, from the other three.

    Returns
    -------
    dict
        ``reaches``: how many of 0.1 m or more, ``between_places`` and ``natural``;
        ``turned_deg``; ``methods``, for each the mean change of c over a reach of
        either kind, the share of reaches ``above_0.2``, the mean change with the
        ``turned_hand`` at the held places, all None where unknown; ``recommended`` for
        live use, paper or intent, or None where no reach or too many speak for
        one, and ``why``.

    Examples
    --------
    >>> import ikns
    >>> person = ikns.virtual_subject(1)
    >>> run = ikns.simulate_protocol(person, seed=1, n_points=4, rate=25, quick=True)
    >>> subject = ikns.calibrate(run.static.recording, [run.points.recording])
    >>> found = method_summary(subject)
    >>> sorted(found["methods"]), round(found["methods"]["intent"]["turned_hand"], 2)
    (['intent', 'paper', 'proximal'], 0.0)
    """
    motions = [*(subject.motions if explorations is None else explorations)]
    kinds = {"between_places": motions, "natural": [*natural]}
    speed = subject.gate["max_hand_speed"]
    ends = {
        kind: [_reaches(motion, subject.chain, speed) for motion in of_kind]
        for kind, of_kind in kinds.items()
    }
    known: list[Method] = [m for m in METHODS if m == "paper" or m in subject.readouts]
    folds = Folds(subject, motions, natural, speed) if own else None
    rows: dict[str, dict[str, float | None]] = {}
    for method in known:
        readout = subject.readout(method)
        changes = {
            kind: np.concatenate(
                [
                    _changes(subject, readout, motion, reach, folds)
                    for motion, reach in zip(kinds[kind], ends[kind], strict=True)
                ]
                or [np.empty(0)]
            )
            for kind in kinds
        }
        both = np.concatenate(list(changes.values()))
        rows[method] = {kind: _mean(change) for kind, change in changes.items()} | {
            "above_0.2": _mean((both > _LOT).astype(float)),
            "turned_hand": _turned(subject, readout),
        }
    counts = {kind: sum(map(len, ends[kind])) for kind in ends}
    found = {
        "reaches": counts,
        "turned_deg": round(float(np.degrees(2 * TURN)), 6),
        "methods": rows,
    }
    return found | _recommended(rows, counts)


def no_range_learned(summary: dict[str, Any]) -> str:
    """Say that reaches move c by more than its range, whatever the method; or nothing.

    Then no one turned the elbow with the hand held: the range that was learned is that
    of small movements, or of noise.
    """
    counts, rows = summary["reaches"], summary["methods"].values()
    for kind in ("between_places", "natural"):
        changes = [row[kind] for row in rows if row[kind] is not None]
        if counts[kind] >= _FEWEST and changes and min(changes) > 1.0:
            return (
                f"a reach moves c of every method by more than its whole range (by "
                f"{min(changes):.1f} at least): no one turned the elbow with the hand "
                "held; hold the hand at each place, and turn the elbow to both ends."
            )
    return ""


def counted_reaches(count: int) -> str:
    """Singular or plural.

    >>> counted_reaches(1), counted_reaches(0)
    ('1 reach', '0 reaches')
    """
    return "1 reach" if count == 1 else f"{count} reaches"


def _reaches(motion: Motion, chain: ChainLike, speed: float) -> Indices:
    """First and last frame of each reach, (R, 2)."""
    return find_reaches(
        motion.hand_speed(chain),
        motion.task_position(chain),
        max_hand_speed=speed,
        min_distance=_FAR,
    )


def _changes(
    subject: Subject,
    readout: Readout,
    motion: Motion,
    reaches: Indices,
    folds: Folds | None,
) -> Array:
    """Size of the change of c over each reach, (R,), of the largest output."""
    if not len(reaches):
        return np.empty(0)
    x, y = readout.samples(subject.skeleton, motion)
    x = readout.led(x)
    at = []
    for frames in np.transpose(reaches):
        if readout.method == "intent" and folds is not None and folds.postures:
            # Both ends by the same posture: that of the first frame's part.
            assert isinstance(readout.map, IntentMap)
            c = folds.signal(
                readout.map, motion, reaches[:, 0], y[frames, 0], x[frames]
            )
        else:
            c = readout.map.control_signal(y[frames], x[frames])
        at.append(np.reshape(c, (len(reaches), -1)))
    return np.asarray(np.abs(at[1] - at[0]).max(axis=1, initial=0.0))


def _turned(subject: Subject, readout: Readout) -> float | None:
    """Mean change of c over the held places while the forearm turns by twice TURN."""
    postures = [
        visited_posture(subject.skeleton, subject.null_space_map, subject.chain, k)
        for k in range(len(subject.null_space_map.centers_))
    ]
    known = [posture for posture in postures if posture is not None]
    if not known:
        return None
    columns = [
        subject.skeleton.joint_names.index(f"{side}_forearm_pronation")
        for side in end_sides(subject.chain)
    ]
    ends = []
    before = None
    for turn in (-TURN, TURN):
        angles = np.array(known)
        angles[:, columns] += turn
        x, y = posture_samples(
            subject.skeleton,
            angles,
            subject.chain,
            readout.method,
            reference=readout.reference,
        )
        # The hand turns where it is, place by place.
        before = x if before is None else before
        x = np.array(
            [readout.led(np.stack(pair))[1] for pair in zip(before, x, strict=True)]
        )
        c = np.asarray(readout.map.control_signal(y, x))
        ends.append(c.reshape(len(known), -1))
    return _mean(np.abs(ends[1] - ends[0]).max(axis=1))


def _mean(values: Array) -> float | None:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else None


def _recommended(
    rows: dict[str, dict[str, float | None]], counts: dict[str, int]
) -> dict[str, str | None]:
    """Choose the method whose c changes least, and say which took part.

    By the mean of what a reach and a turned hand do to c: natural reaches where enough
    are known, else those between points. No method without enough reaches, and none
    whose c a reach changes by more than half of its range.
    """
    known = [m for m in _CHOICES if m in rows]
    aside = [m for m in rows if m not in _CHOICES]
    kind = next((k for k in _REACHES if counts[k] >= _FEWEST), None)
    reach = {m: rows[m][kind] for m in known} if kind else {}
    changes = {m: value for m, value in reach.items() if value is not None}
    usable = [m for m in known if changes.get(m, 0.0) <= _USELESS]
    spoiled = " and ".join(f"{m} by {changes[m]:.2f}" for m in known if m not in usable)
    if not usable:
        return {
            "recommended": None,
            "why": f"a {_REACHES[str(kind)]} changes c by more than half of its range: "
            f"{spoiled}; hold the hand at each place, and turn the elbow to both ends",
        }
    if len(known) == 1:
        why = (
            "intent was not learned" if aside else "paper is the only method available"
        )
        return {"recommended": known[0], "why": why}
    if kind is None:
        return {
            "recommended": None,
            "why": f"{counted_reaches(counts['between_places'])} between points and "
            f"{counts['natural']} in natural movement were recorded; at least "
            f"{_FEWEST} of one kind are needed",
        }
    if spoiled:
        why = (
            f"a {_REACHES[kind]} changes c of {spoiled}, more than half of its range; "
            f"that of {usable[0]} by {changes.get(usable[0], math.nan):.2f}"
        )
        return {"recommended": usable[0], "why": why}
    words = {kind: _REACHES[kind], "turned_hand": "hand turned"}
    causes = {
        cause: {m: value for m in known if (value := rows[m][cause]) is not None}
        for cause in words
    }
    # Means of different causes would not compare.
    causes = {c: of for c, of in causes.items() if len(of) == len(known)}
    if not causes:
        return {"recommended": None, "why": "c is unknown at the ends of the reaches"}
    cost = {m: float(np.mean([of[m] for of in causes.values()])) for m in known}
    best, other = sorted(cost, key=lambda method: cost[method])
    each = [
        f"{words[c]}: {of[best]:.2f} and {of[other]:.2f}" for c, of in causes.items()
    ]
    why = (
        f"its c changes by {cost[best]:.2f} on average, that of {other} by "
        f"{cost[other]:.2f} ({'; '.join(each)})"
    )
    if aside:
        why += (
            f"; {' and '.join(aside)} is shown for comparison only: in real people's "
            "reaches its c changes more than that of intent"
        )
    return {"recommended": best, "why": why}


def recommendation(summary: dict[str, Any]) -> str:
    """Say which method is recommended and why, or why none is."""
    if summary["recommended"] is None:
        return f"No method is recommended: {summary['why']}."
    return f"Recommended: --method {summary['recommended']}; {summary['why']}."
