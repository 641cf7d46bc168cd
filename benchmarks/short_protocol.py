"""What does the short protocol cost? One row a protocol and method.

Virtual people who share nothing with the simulation but how real elbows go with the
hand (`null_space/virtual_people.py`). The full protocol has ten held places and all of
their ordinary movement (some 45 s), the short one 3 s of static trial, 20 s of that
movement and two of these places. Both are judged where they learned nothing: wishes at
twelve other places, whose true c is known. Error of c, root mean square; gain and
offset of a line of c over the true c.
"""

import argparse
import platform
import warnings

import numpy as np
from null_space.virtual_people import RATE
from null_space.virtual_scores import CHAIN, Trials, recorded

import ikns
from ikns.errors import IknsError
from ikns.recording.recording import Recording

#: What was asked of the short protocol: root mean square error of c.
GOAL = 0.05
#: Each place is held for so long, and so far apart in time, s (`recorded`).
HELD, APART = 4.0, 5.0
#: Held places by protocol: all, and those above and below the middle of the box.
PLACES = {"full": range(10), "short": (8, 9)}
#: Ordinary movement by protocol, s.
SECONDS = {"full": 60.0, "short": 20.0}


def part(recording: Recording, start: float, seconds: float) -> Recording:
    """Cut a part out of a recording, s."""
    a = round(start * RATE)
    rows = slice(a, a + round(seconds * RATE))
    markers = recording.markers[rows]
    time = np.arange(len(markers)) / RATE
    return Recording(time, markers, recording.labels, f"from {start:g} s, simulated")


def calibrated(trials: Trials, protocol: str) -> ikns.Subject:
    """Calibrate a person by one of the protocols."""
    chosen = PLACES[protocol]
    return ikns.calibrate(
        part(trials.static, 0.0, 3.0),
        [part(trials.points, APART * k, HELD) for k in chosen],
        natural=[part(trials.ordinary, 0.0, SECONDS[protocol])],
        n_points=len(chosen),
    )


def judged(subject: ikns.Subject, trials: Trials, method: str) -> list[float]:
    """Error, gain and offset of a method's c."""
    motion = ikns.MarkerIK(subject.skeleton).track(trials.wishes, chain=CHAIN)
    c = subject.readout(method).control_signal(subject.skeleton, motion)
    known = np.isfinite(c) & np.isfinite(trials.meant)
    gain, offset = np.polyfit(trials.meant[known], c[known], 1)
    error = np.sqrt(np.mean((c[known] - trials.meant[known]) ** 2))
    return [float(error), float(gain), float(offset)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=20)
    parser.add_argument("--quick", action="store_true", help="one person")
    options = parser.parse_args()
    warnings.simplefilter("ignore")  # of places that are far from the mean ends
    people = 1 if options.quick else options.people
    print(
        f"{people} virtual people, seeds from 0; numpy {np.__version__}, Python "
        f"{platform.python_version()}.\n"
    )
    rows: dict[tuple[str, str], list[list[float]]] = {}
    for seed in range(people):
        trials = recorded(seed)
        for protocol in ("short",) if options.quick else PLACES:
            try:
                subject = calibrated(trials, protocol)
            except IknsError as error:
                print(f"{protocol} of person {seed} is left out: {error}")
                continue
            for method in subject.methods:
                row = judged(subject, trials, method)
                rows.setdefault((protocol, method), []).append(row)
    print(
        "| protocol | method | error of c, median (p90) | gain | offset | "
        f"error of {GOAL:g} or less |\n|---|---|---|---|---|---|"
    )
    for (protocol, method), values in rows.items():
        error, gain, offset = np.array(values).T
        print(
            f"| {protocol} | {method} | {np.median(error):.3f} "
            f"({np.quantile(error, 0.9):.3f}) | {np.median(gain):.2f} "
            f"| {np.median(offset):+.3f} | {(error <= GOAL).sum()} of {len(error)} |"
        )


if __name__ == "__main__":
    main()
