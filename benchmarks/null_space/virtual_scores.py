"""Scores of entrants on virtual people: markers in, calibration, c out.

Each person is calibrated from a static trial, ten held places and 20 s of ordinary
movement; c is then read of recordings that nobody learned from.
"""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ikns.calibration import calibrate
from ikns.calibration.readouts import learn_readouts
from ikns.calibration.subject import Subject
from ikns.live.control import FrameSolver
from ikns.live.control.controller import Controller
from ikns.live.control.settings import ControlSettings
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.nullspace.map import still_mask
from ikns.nullspace.posture_terms import wrist_of
from ikns.nullspace.readout import Readout, readout_samples
from ikns.recording.recording import Recording
from null_space.entrants import entrant
from null_space.virtual_people import (
    RATE,
    STANDING,
    Rests,
    Virtual,
    box,
    draw_virtual,
    exploring,
    holdable,
    reaching,
    rests,
    sweeps,
    turning,
    worn,
)

Array = np.ndarray
CHAIN = "right_arm"
#: Ordinary movement that is learned from, s: of all methods the first.
SECONDS = (22, 0, 11, 43)
#: Half the width of the region of unseen places, and how many, m.
REGION, PLACES = 0.11, 12
#: Markers are hidden for so long, and so often, s.
HIDDEN, EVERY = 0.3, 1.5
HIDES = {"forearm": ("RFRM", "RWRA"), "hand": ("RFIN",), "shoulder": ("RSHO",)}
#: What live knows; the others read the tracked recording.
LIVE = ("paper", "intent")


@dataclass(frozen=True)
class Trials:
    """What one person recorded; `meant` (T,) is the truth of `wishes`.

    ``postures`` are the true joint angles (T, 7) of each recording, by its name, and
    ``calm`` the rests between which ordinary movement went.
    """

    person: Virtual
    static: Recording
    points: Recording
    ordinary: Recording
    wishes: Recording
    meant: Array
    reaches: Recording
    ends: list[tuple[int, int]]
    turns: dict[str, tuple[Recording, Array]]
    postures: dict[str, Array]
    calm: Rests


def recorded(seed: int) -> Trials:
    """Draw and record a person."""
    person, rng = draw_virtual(seed), np.random.default_rng([34, seed])
    postures: dict[str, Array] = {}

    def record(name: str, q: Array) -> Recording:
        postures[name] = q
        markers, labels = worn(person, q, rng)
        clock = np.arange(len(q)) / RATE
        return Recording(clock, markers, tuple(labels), f"{name}, simulated")

    held = holdable(person, box(rng), rng)
    points, _, _ = exploring(
        person, held, [sweeps(person, 4.0, rng) for _ in held.off], rng
    )
    calm = rests(person, rng.uniform(-0.19, 0.19, (40, 3)), rng)
    ordinary, _ = reaching(person, calm, np.arange(40), 0.25)
    new = holdable(person, rng.uniform(-REGION, REGION, (PLACES, 3)), rng)
    wishes, _, meant = exploring(
        person, new, [sweeps(person, 3.0, rng) for _ in new.off], rng
    )
    to = rests(person, rng.uniform(-0.17, 0.17, (24, 3)), rng)
    reaches, stops = reaching(person, to, np.arange(24), 0.4)
    last = [np.flatnonzero(stops == k) for k in range(24)]
    ends = [(int(a[-1]), int(b[0])) for a, b in zip(last[:-1], last[1:], strict=True)]
    turns = {}
    for kind in ("forearm", "wrist"):
        q, place = turning(person, first_rests(new, 6), kind)
        turns[kind] = (record(kind, q), place)
    return Trials(
        person,
        record("static", np.tile(STANDING, (150, 1))),
        record("points", points),
        record("ordinary", ordinary),
        record("wishes", wishes),
        meant,
        record("reaches", reaches),
        ends,
        turns,
        postures,
        calm,
    )


def first_rests(at: Rests, n: int) -> Rests:
    """Return the first n rests."""
    return Rests(at.wrist[:n], at.distal[:n], at.off[:n])


@dataclass(frozen=True)
class Calibrated:
    """A calibrated person, and how each motion was tracked."""

    subject: Subject
    readouts: dict[int, dict[str, Readout]]
    ordinary: Motion
    track: Callable[[Recording], Motion]


def calibrated(trials: Trials) -> Calibrated:
    """Calibrate, and learn what ordinary movement tells, by its seconds."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        subject = calibrate(trials.static, [trials.points])
        skeleton, learned = subject.skeleton, subject.null_space_map

        def track(recording: Recording) -> Motion:
            return MarkerIK(skeleton).track(recording, chain=CHAIN)

        ordinary = track(trials.ordinary)
        pairs = [(motion, still_mask(motion, CHAIN)) for motion in subject.motions]
        readouts = {}
        for seconds in SECONDS:
            first = [track(_first(trials.ordinary, seconds))] if seconds else []
            readouts[seconds] = learn_readouts(
                skeleton, learned, pairs, CHAIN, natural=first
            )[0]
    return Calibrated(subject, readouts, ordinary, track)


def _first(recording: Recording, seconds: float) -> Recording:
    n = round(seconds * RATE)
    return Recording(
        recording.time[:n], recording.markers[:n], recording.labels, recording.source
    )


def signal(
    found: Calibrated, name: str, seconds: int = 22
) -> Callable[[Motion], Array]:
    """Fit an entrant; return its c of a motion, (T,)."""
    subject, what = found.subject, entrant(name)
    if isinstance(what, str):
        readout = (
            subject.readout("paper") if what == "paper"
            else found.readouts[seconds][what]
        )  # fmt: skip
        return lambda motion: readout.control_signal(subject.skeleton, motion)
    reads = {"joints": "paper", "swivel": "intent"}[getattr(what, "reads", "joints")]

    def samples(motion: Motion) -> tuple[Array, Array]:
        place, coordinate = readout_samples(subject.skeleton, motion, CHAIN, reads)
        return wrist_of(place), coordinate

    gates = [still_mask(motion, CHAIN) for motion in subject.motions]
    each = [samples(motion) for motion in subject.motions]
    X, y = (
        np.concatenate([part[i][g] for part, g in zip(each, gates, strict=True)])
        for i in (0, 1)
    )
    own = subject.null_space_map.labels_
    X, y, groups = X[own >= 0], y[own >= 0], own[own >= 0]
    n = round(seconds * RATE)
    x0, y0 = (part[:n] for part in samples(found.ordinary))
    moves = found.ordinary.hand_speed(CHAIN)[:n] >= 0.05
    moves &= np.isfinite(x0).all(axis=1) & np.isfinite(y0).all(axis=1)
    body = (
        {"skeleton": subject.skeleton, "chain": CHAIN}
        if getattr(what, "needs_body", False)
        else {}
    )
    made = what(**body).fit(
        X, y, groups=groups, natural_X=x0[moves], natural_y=y0[moves]
    )
    swivel = np.concatenate(
        [
            readout_samples(subject.skeleton, motion, CHAIN, "intent")[1][g, 0]
            for motion, g in zip(subject.motions, gates, strict=True)
        ]
    )[own >= 0]
    rising = np.polyfit(swivel, made.control_signal(y, X), 1)[0] >= 0

    def c(motion: Motion) -> Array:
        place, coordinate = samples(motion)
        read = np.asarray(made.control_signal(coordinate, place))
        return read if rising else 1 - read

    return c


def live(
    found: Calibrated, readout: Readout, recording: Recording
) -> tuple[Array, float]:
    """Read c of the frames that drive the finger, NaN of others; and us a frame."""
    subject = found.subject
    worn_set = subject.skeleton.marker_set
    columns = worn_set.columns(recording.labels)
    markers = recording.markers[:, columns]
    markers[:, columns < 0] = np.nan
    solver = FrameSolver(
        subject.skeleton, subject.null_space_map, CHAIN, readout=readout
    )
    control = Controller(solver, ControlSettings(method=readout.method))
    c, spent = np.full(len(markers), np.nan), []
    for i, (frame, now) in enumerate(zip(markers, recording.time, strict=True)):
        before = time.perf_counter_ns()
        decision = control.frame(frame, now, now)
        spent.append(time.perf_counter_ns() - before)
        if decision.valid:
            c[i] = decision.solved.c[0]
    return c, float(np.median(spent)) / 1e3


def hidden(recording: Recording, labels: tuple[str, ...]) -> tuple[Recording, Array]:
    """Hide markers 0.3 s long every 1.5 s; also says when, (T,)."""
    off = recording.time % EVERY >= EVERY - HIDDEN
    markers = recording.markers.copy()
    markers[np.ix_(off, [recording.labels.index(label) for label in labels])] = np.nan
    made = Recording(recording.time, markers, recording.labels, recording.source)
    return made, off


def of_person(seed: int, names: list[str]) -> dict[str, dict[str, float]]:
    """All scores of one person by entrant."""
    trials = recorded(seed)
    found = calibrated(trials)
    wishes, reaches = found.track(trials.wishes), found.track(trials.reaches)
    turns = {kind: (found.track(r), p) for kind, (r, p) in trials.turns.items()}
    gaps = {name: hidden(trials.wishes, labels) for name, labels in HIDES.items()}
    tracked = {name: found.track(recording) for name, (recording, _) in gaps.items()}
    rows = {}
    for name in names:
        c = signal(found, name)
        row = wished(c(wishes), trials.meant)
        read = c(reaches)
        row["reach"] = float(
            np.nanmean([abs(read[b] - read[a]) for a, b in trials.ends])
        )
        for kind, (motion, place) in turns.items():
            row[kind] = _turned(c(motion), place)
        readout = None
        if name in LIVE:
            readout = (
                found.subject.readout("paper") if name == "paper"
                else found.readouts[22][name]
            )  # fmt: skip
            usual, row["us"] = live(found, readout, trials.wishes)
        else:
            usual = c(wishes)
        for part, (recording, off) in gaps.items():
            seen = live(found, readout, recording)[0] if readout else c(tracked[part])
            row |= {f"{part}_{k}": v for k, v in _gaps(seen, usual, off).items()}
        rows[name] = row
    if "intent" in names:
        for seconds in SECONDS:
            c = signal(found, "intent", seconds)
            read = c(reaches)
            rows["intent"][f"rms_{seconds}"] = wished(c(wishes), trials.meant)["rms"]
            rows["intent"][f"reach_{seconds}"] = float(
                np.nanmean([abs(read[b] - read[a]) for a, b in trials.ends])
            )
    return rows


def wished(c: Array, meant: Array) -> dict[str, float]:
    """Error, gain and offset of c over what was meant."""
    known = np.isfinite(c) & np.isfinite(meant)
    gain, offset = np.polyfit(meant[known], c[known], 1)
    return {
        "rms": float(np.sqrt(np.mean((c[known] - meant[known]) ** 2))),
        "gain": float(gain),
        "offset": float(offset),
    }


def _turned(c: Array, place: Array) -> float:
    """Mean over places of the range that c runs through."""
    runs = [np.nanmax(c[place == k]) - np.nanmin(c[place == k]) for k in set(place)]
    return float(np.mean(runs))


def _gaps(c: Array, usual: Array, off: Array) -> dict[str, float]:
    """Median over gaps of the farthest that c goes, and frames lost.

    NaN where no gap has a c: the finger is held through all of them.
    """
    starts = np.flatnonzero(np.diff(np.r_[0, off.astype(int)]) == 1)
    most = []
    for a in starts:
        rows = a + np.flatnonzero(off[a : a + round(HIDDEN * RATE)])
        change = np.abs(c[rows] - usual[rows])
        if np.isfinite(change).any():
            most.append(np.nanmax(change))
    lost = np.isnan(c[off]) & np.isfinite(usual[off])
    return {"median": _median(np.array(most)), "max": float(np.max([*most, 0.0])),
            "lost": float(lost.mean())}  # fmt: skip


def _median(values: Array) -> float:
    """Median of what is known; NaN where nothing is."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else np.nan


def gathered(people: list[dict[str, dict[str, float]]]) -> dict[str, dict[str, float]]:
    """Scores over all people, by entrant."""
    table = {}
    for name in people[0]:
        rows = [person[name] for person in people]
        column = {key: np.array([row[key] for row in rows]) for key in rows[0]}
        made = {key: _median(values) for key, values in column.items()}
        made["rms_p90"] = float(np.quantile(column["rms"], 0.9))
        made["gain_in"] = float(np.mean(np.abs(column["gain"] - 1) <= 0.03))
        made["offset_in"] = float(np.mean(np.abs(column["offset"]) <= 0.03))
        made["forearm_max"] = float(np.nanmax([*column["forearm_max"], 0.0]))
        table[name] = made
    return table
