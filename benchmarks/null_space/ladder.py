"""The error of intent on virtual people, with parts of what it rests on made true."""

import dataclasses
from collections.abc import Callable

import numpy as np

from ikns.calibration.readouts import moving_samples
from ikns.motion.motion import Motion
from ikns.nullspace.led_direction import led_direction
from ikns.nullspace.map import still_mask
from ikns.nullspace.natural_posture import NaturalPosture
from ikns.nullspace.posture_terms import quadratic_terms
from ikns.nullspace.readout import IntentMap, readout_samples
from ikns.nullspace.readout.ends import swept_ends_of
from null_space.virtual_arm import pose
from null_space.virtual_people import RATE, Rests, Virtual, reaching
from null_space.virtual_scores import CHAIN, calibrated, recorded, wished

Array = np.ndarray
#: Ordinary movement that is learned from, s, besides that between the held places.
SECONDS = 22
#: Rests that are visited in it.
AGAIN = 16


@dataclasses.dataclass(frozen=True)
class Seen:
    """Wrists (T, 3) m, swivels (T,) rad and the hand's direction (T, 3) of a motion."""

    wrist: Array
    swivel: Array
    axis: Array

    def of(self, rows: Array) -> "Seen":
        """Return some rows."""
        return Seen(self.wrist[rows], self.swivel[rows], self.axis[rows])


@dataclasses.dataclass(frozen=True)
class Person:
    """What one virtual person showed: as tracked, and as it was.

    `moved` are the frames of ordinary movement between the held places, and of 22 s
    more, by how they were made; `held`, `group` and `time` are those of held places.
    `again` are true reaches between places of the ordinary movement, in another order.
    """

    virtual: Virtual
    held: dict[str, Seen]
    group: Array
    time: Array
    moved: dict[str, Seen]
    wishes: dict[str, Seen]
    meant: Array
    reaches: dict[str, Seen]
    ends: list[tuple[int, int]]
    again: Seen
    again_ends: list[tuple[int, int]]


def true(person: Virtual, q: Array) -> Seen:
    """Where the arm really was."""
    at = pose(person.arm, q)
    return Seen(at.wrist, at.swivel, at.hand_axis)


def shown(seed: int) -> Person:
    """Record, calibrate and track a person."""
    trials = recorded(seed)
    one, found = trials.person, calibrated(trials)
    body = found.subject.skeleton

    def tracked(motion: Motion) -> Seen:
        place, swivel = readout_samples(body, motion, CHAIN, "intent")
        return Seen(place[:, :3], swivel[:, 0], place[:, 3:])

    points = found.subject.motions[0]
    (_, _, between), (_, _, after) = moving_samples(
        body,
        found.subject.null_space_map,
        [points],
        [found.ordinary],
        CHAIN,
        max_hand_speed=0.05,
    )
    after = after & (np.arange(len(after)) < SECONDS * RATE)
    still = still_mask(points, CHAIN)
    parts = {"tracked": tracked(points), "true": true(one, trials.postures["points"])}
    calm = dataclasses.replace(trials.calm, off=np.zeros(len(trials.calm.off)))
    flat = dataclasses.replace(one, rough=0.0)

    def ordinary(who: Virtual, at: Rests) -> Seen:
        return true(who, reaching(who, at, np.arange(len(at.off)), 0.25)[0])

    more = {
        "tracked": tracked(found.ordinary),
        "true": true(one, trials.postures["ordinary"]),
        "no scatter": ordinary(one, calm),
        "no rough field": ordinary(flat, trials.calm),
        "neither": ordinary(flat, calm),
    }
    first = {name: parts.get(name, parts["true"]).of(between) for name in more}
    return Person(
        one,
        {name: part.of(still) for name, part in parts.items()},
        found.subject.null_space_map.labels_,
        points.time[still],
        {name: joined(first[name], part.of(after)) for name, part in more.items()},
        {
            "tracked": tracked(found.track(trials.wishes)),
            "true": true(one, trials.postures["wishes"]),
        },
        trials.meant,
        {
            "tracked": tracked(found.track(trials.reaches)),
            "true": true(one, trials.postures["reaches"]),
        },
        trials.ends,
        *once_more(one, trials.calm),
    )


def once_more(person: Virtual, calm: Rests) -> tuple[Seen, list[tuple[int, int]]]:
    """Reaches between rests of the ordinary movement, hands as there; first and last.

    The order differs, and so does the scatter from rest to rest.
    """
    rng = np.random.default_rng([35, person.seed])
    rows = slice(0, AGAIN)
    off = rng.normal(scale=person.rest, size=AGAIN)
    at = Rests(calm.wrist[rows], calm.distal[rows], off)
    order = rng.permutation(AGAIN)
    q, stops = reaching(person, at, order, 0.4)
    rests = [np.flatnonzero(stops == k) for k in order]
    ends = [(int(a[-1]), int(b[0])) for a, b in zip(rests[:-1], rests[1:], strict=True)]
    return true(person, q), ends


def joined(*parts: Seen) -> Seen:
    """Put parts one after the other."""
    return Seen(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("wrist", "swivel", "axis")
        )
    )


def natural_of(person: Person, how: str) -> Callable[[Seen], Array]:
    """Return a natural posture: ``"wrist"``, ``"wrist and hand"``, or a learned one."""
    one = person.virtual
    if how == "wrist and hand":
        return lambda at: one.natural(at.wrist, at.axis, rough=False)
    if how == "all of it":
        return lambda at: one.natural(at.wrist, at.axis)
    if how == "wrist":
        moved = person.moved["true"]
        smooth = one.natural(moved.wrist, moved.axis, rough=False)
        fit = np.linalg.lstsq(quadratic_terms(moved.wrist), smooth, rcond=None)[0]
        return lambda at: quadratic_terms(at.wrist) @ fit
    name, _, part = how.partition(", ")
    near = {"local_penalty": None} if part == "smooth" else {}
    moved = person.moved[name]

    def places(at: Seen) -> Array:
        return at.wrist if part == "wrist alone" else np.hstack([at.wrist, at.axis])

    learned = NaturalPosture(**near).fit(places(moved), moved.swivel)
    if part == "wrist alone":
        return lambda at: learned.swivel(at.wrist)
    return lambda at: learned.swivel(led_direction(places(at)))


def scored(
    person: Person, seen: str, natural: str, *, true_ends: bool = False
) -> dict[str, float]:
    """Scores of c with what is seen, what is natural and the ends as given."""
    of = natural_of(person, natural)
    a, b = person.virtual.low, person.virtual.high
    if not true_ends:
        held, used = person.held[seen], person.group >= 0
        rows = [np.flatnonzero(used & (person.group == k)) for k in set(person.group)]
        rows = [row for row in rows if row.size]
        ends = swept_ends_of(held.swivel - of(held), person.time, rows)
        # The package's ends; its natural posture has no say in them.
        a, b = IntentMap.from_arrays(
            NaturalPosture.of_people(), np.zeros((len(rows), 3)), *ends.T
        ).ends_
    c = (person.wishes[seen].swivel - of(person.wishes[seen]) - a) / (b - a)

    def change(at: Seen, ends: list[tuple[int, int]]) -> float:
        read = (at.swivel - of(at)) / (b - a)
        return float(
            np.nanmean([abs(read[last] - read[first]) for first, last in ends])
        )

    return wished(c, person.meant) | {
        "reach": change(person.reaches[seen], person.ends),
        "again": change(person.again, person.again_ends),
    }
