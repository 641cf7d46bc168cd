"""What is left of c after the markers were put on again? One row a way of wearing.

Simulated people of `ikns.simulation` are calibrated; on another day the same body does
the same movements with the old markers and with new ones, whose clusters are placed
with 10 mm of standard deviation per axis, and landmarks with what the row says. Their
habits, the natural posture and the scatter about it, are drawn from real people. Error:
c read in the new wearing less c as the calibration reads the same movement in the old
one, over all still samples at ten places.

- as if nothing had happened: the old markers' places for the new ones;
- new static trial: the body scaled anew, the map kept;
- rewear: `ikns.rewear`, with a static trial and 20 s of movement;
- without shift: the same, the range of intent as it was.
"""

import argparse
import dataclasses
import platform
import warnings
from typing import Any

import numpy as np

import ikns
from ikns.body.marker_set import MarkerSet
from ikns.calibration.subject import Subject
from ikns.errors import IknsError
from ikns.motion.motion import Motion
from ikns.nullspace.map import MapWarning, still_mask
from ikns.nullspace.readout import METHODS
from ikns.simulation import VirtualSubject
from ikns.simulation.posture_habits import draw_posture_habits

#: Placement of clusters, and of landmarks by row, m per axis.
CLUSTERS, LANDMARKS = 10e-3, (2e-3, 5e-3)
#: A marker with a larger spread of placement is of a cluster (`ikns.simulation`), m.
LOOSE = 12e-3
#: What was asked of intent: root mean square error of c.
GOAL = 0.04


def reapplied(person: VirtualSubject, landmarks: float, seed: int) -> VirtualSubject:
    """Return the same body with its markers at other places."""
    rng = np.random.default_rng([seed, 1])
    body = person.skeleton.with_nominal_markers(MarkerSet.load(person.marker_set))
    loose = [min(m.placement_sd) > LOOSE for m in body.marker_set.markers]
    sd = np.where(loose, CLUSTERS, landmarks)[:, None]
    places = body.marker_positions + sd * rng.normal(size=(len(sd), 3))
    worn = body.with_markers(body.marker_set.at(places))
    return dataclasses.replace(person, skeleton=worn)


def worn_as_before(old: Subject, recording: ikns.Recording) -> Motion:
    """Track a recording with the places of the markers in the old wearing."""
    return ikns.MarkerIK(old.skeleton).track(recording, chain=old.chain)


def errors(seed: int, landmarks: float, *, quick: bool) -> dict[tuple[str, str], float]:
    """Root mean square error of c by (way, method) for one person."""
    protocol: dict[str, Any] = {
        "habits": draw_posture_habits(np.random.default_rng([seed, 2])),
        "free_seconds": 5.0 if quick else 20.0,
        "point_seconds": 2.0 if quick else 4.0,
        "rate": 50.0,
    }
    person = ikns.virtual_subject(seed)
    first = ikns.simulate_protocol(person, seed=seed, **protocol)
    old = ikns.calibrate(
        first.static.recording,
        [first.points.recording],
        natural=[first.free.recording],
    )
    days = [
        ikns.simulate_protocol(who, seed=seed + 1000, **protocol)
        for who in (person, reapplied(person, landmarks, seed))
    ]
    assert np.array_equal(days[0].points.swivel, days[1].points.swivel)
    before = worn_as_before(old, days[0].points.recording)
    static, points = days[1].static.recording, days[1].points.recording
    anew, _ = ikns.scale(ikns.Skeleton.load(), static)
    new = ikns.rewear(old, static, [days[1].free.recording])
    unshifted = dataclasses.replace(new, readouts=old.readouts)
    ways = {
        "as if nothing had happened": old,
        "new static trial": dataclasses.replace(old, skeleton=anew),
        "without shift": unshifted,
        "rewear": new,
    }
    found = {}
    for way, subject in ways.items():
        motion = ikns.MarkerIK(subject.skeleton).track(points, chain=subject.chain)
        still = still_mask(before, old.chain) & still_mask(motion, old.chain)
        for method in METHODS:
            was = old.readout(method).control_signal(old.skeleton, before)
            now = subject.readout(method).control_signal(subject.skeleton, motion)
            off = (now - was)[still]
            found[way, method] = float(np.sqrt(np.nanmean(off**2)))
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=10)
    parser.add_argument("--quick", action="store_true", help="one person, 5 s")
    options = parser.parse_args()
    warnings.simplefilter("ignore", MapWarning)
    people = 1 if options.quick else options.people
    print(
        f"{people} simulated people a row, seeds from 1; numpy {np.__version__}, "
        f"Python {platform.python_version()}. Error of c, rms: median (worst).\n"
    )
    print("| landmarks mm | way | " + " | ".join(METHODS) + " | intent as asked |")
    print("|---|---|" + "---|" * (len(METHODS) + 1))
    for landmarks in LANDMARKS[:1] if options.quick else LANDMARKS:
        rows = []
        for seed in range(1, people + 1):
            try:
                rows.append(errors(seed, landmarks, quick=options.quick))
            except IknsError as error:
                print(f"person {seed} is left out: {error}")
        for way in dict.fromkeys(way for way, _ in rows[0]):
            cells = []
            for method in METHODS:
                values = [row[way, method] for row in rows]
                cells.append(f"{np.median(values):.3f} ({np.max(values):.3f})")
            right = sum(row[way, "intent"] <= GOAL for row in rows)
            print(
                f"| {1e3 * landmarks:.0f} | {way} | {' | '.join(cells)} "
                f"| {right} of {len(rows)} |"
            )


if __name__ == "__main__":
    main()
