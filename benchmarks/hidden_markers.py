"""How far does c move while markers are hidden, and does its deviation say so? A table.

Simulated people explore a box with the hand held and move freely; skin shifts the
markers over the bones (`--tissue`, root mean square, mm). Some markers are hidden for
0.3 s out of every 0.7 s. One table: how far c is from what all markers show (root mean
square), the share of these errors within two of the stated standard deviations, the
share of frames in which c is held for its deviation, overall and in the first 0.1 s,
and the errors of the frames that are left.
"""

import argparse

import numpy as np

from ikns.calibration import calibrate
from ikns.calibration.subject import Subject
from ikns.live.control import FrameSolver
from ikns.live.control.frame import MAX_UNCERTAINTY
from ikns.simulation import simulate_protocol, virtual_subject

RATE, HIDDEN, PERIOD = 100, 0.3, 0.7
SETS = {
    "none": (),
    "hand": ("RFIN",),
    "shoulder": ("RSHO",),
    "elbow": ("RELB",),
    "upper arm, two": ("RUPA", "RUPB"),
    "forearm, FRM WRA": ("RFRM", "RWRA"),
    "forearm, FRM WRB": ("RFRM", "RWRB"),
    "forearm, WRA WRB": ("RWRA", "RWRB"),
    "forearm, all three": ("RFRM", "RWRA", "RWRB"),
    "thorax, two": ("CLAV", "STRN"),
}


def person(seed: int, tissue: float, quick: bool) -> tuple[Subject, list[np.ndarray]]:
    """Return a calibrated person, and markers of two trials, none of them hidden."""
    run = simulate_protocol(
        virtual_subject(seed),
        seed=seed,
        soft_tissue=tissue,
        occluded=0.0,
        free_seconds=4.0 if quick else 20.0,
        point_seconds=1.5 if quick else 3.0,
        static_seconds=1.5,
    )
    subject = calibrate(run.static.recording, [run.points.recording])
    pick = subject.skeleton.marker_set.pick
    trials = [trial.recording for trial in (run.points, run.free)]
    return subject, [pick(trial.labels, trial.markers) for trial in trials]


def signal(
    subject: Subject, method: str, markers: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """C and its standard deviation, frame by frame, whatever they are."""
    solver = FrameSolver(
        subject.skeleton,
        subject.null_space_map,
        subject.chain,
        readout=subject.readout(method),
        max_uncertainty=np.inf,
    )
    frames = [solver.solve(seen, 1 / RATE) for seen in markers]
    return (
        np.array([frame.c[0] for frame in frames]),
        np.array([frame.uncertainty[0] for frame in frames]),
    )


def hide(markers: np.ndarray, columns: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Markers with some hidden, and for how long they are, s."""
    seen, age = markers.copy(), np.zeros(len(markers))
    length = round(HIDDEN * RATE)
    for start in range(length, len(markers) - length, round(PERIOD * RATE)):
        seen[start : start + length, columns] = np.nan
        age[start : start + length] = np.arange(1, length + 1) / RATE
    return seen, age


def row(error: np.ndarray, deviation: np.ndarray, age: np.ndarray) -> str:
    """One row of the table."""
    error, held = np.abs(error), deviation > MAX_UNCERTAINTY
    early, left = age < 0.105, error[~held]
    return (
        f"{np.median(deviation):>9.3f}{np.sqrt(np.mean(error**2)):>8.3f}"
        f"{100 * np.mean(error <= 2 * deviation):>9.1f}{100 * held.mean():>8.1f}"
        f"{100 * held[early].mean():>10.1f}"
        f"{np.sqrt(np.mean(left**2)) if left.size else np.nan:>11.3f}"
        f"{100 * np.mean((error > 0.05) & ~held):>9.1f}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="one person, short")
    parser.add_argument("--people", type=int, default=4)
    parser.add_argument("--tissue", type=float, default=4.0, help="mm")
    options = parser.parse_args()
    people = [
        person(seed, options.tissue / 1000, options.quick)
        for seed in range(1 if options.quick else options.people)
    ]
    print(
        f"simulated people: {len(people)}, soft tissue {options.tissue:g} mm, noise 1 "
        f"mm; c is held above a standard deviation of {MAX_UNCERTAINTY:g}"
    )
    print(
        f"{'method':<8}{'hidden for 0.3 s':<20}{'sd':>9}{'rms':>8}{'% in 2sd':>9}"
        f"{'% held':>8}{'% <0.1 s':>10}{'rms of rest':>11}{'% > .05':>9}"
    )
    for method in ("paper", "intent"):
        found: dict[str, list[tuple[np.ndarray, np.ndarray, np.ndarray]]] = {}
        for subject, trials in people:
            labels = subject.skeleton.marker_set.labels
            for markers in trials:
                whole, certain = signal(subject, method, markers)
                for name, hidden in SETS.items():
                    if not hidden:
                        found.setdefault(name, []).append((0 * whole, certain, whole))
                        continue
                    seen, age = hide(markers, [labels.index(one) for one in hidden])
                    c, deviation = signal(subject, method, seen)
                    gone = age > 0
                    found.setdefault(name, []).append(
                        ((c - whole)[gone], deviation[gone], age[gone])
                    )
        for name, parts in found.items():
            columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
            if name == "none":
                columns[2] = np.zeros(len(columns[0]))
            print(f"{method:<8}{name:<20}{row(*columns)}")


if __name__ == "__main__":
    main()
