"""Is c 0 and 1 at the ends of what the person really swept? One row a noise.

Simulated people of `ikns.simulation` explore ten places; cameras add noise, and in half
of them skin moves over the bones (4 mm). The oracle knows the true swivel of every
frame, its lowest and highest value at each place, and so the true c. A line through c
over the true c at each place has a gain and an offset; a person's are the means over
the places. Asked: gain 0.97 to 1.03 and offset at most 0.03 in nine of ten people.
"""

import argparse
import platform
import warnings

import numpy as np

import ikns
from ikns.errors import InvalidInput
from ikns.nullspace.map import MapWarning, still_mask
from ikns.nullspace.readout import METHODS
from ikns.simulation.trial import Trial

#: Camera noise, mm per axis: from a good laboratory to keypoints of few cameras.
NOISE = (0.5, 1.0, 2.0, 3.0)
GAIN, OFFSET = (0.97, 1.03), 0.03


def line(subject: ikns.Subject, trial: Trial, method: str) -> tuple[float, float]:
    """Gain and offset of a method's c against the true c, mean over the places."""
    motion = subject.motions[0]
    still = still_mask(motion, subject.chain)
    c = subject.readout(method).control_signal(subject.skeleton, motion)
    lines = []
    for k in range(trial.point.max() + 1):
        here = trial.point == k
        low, high = trial.swivel[here].min(), trial.swivel[here].max()
        row = here & still & np.isfinite(c)
        true = (trial.swivel[row] - low) / (high - low)
        lines.append(np.polyfit(true, c[row], 1))
    gain, offset = np.mean(lines, axis=0)
    return float(gain), float(offset)


def person(seed: int, noise: float, *, quick: bool) -> dict[str, tuple[float, float]]:
    """Gain and offset of each method for one simulated person; none out of reach."""
    skin = 4e-3 if seed % 2 else 0.0
    try:
        run = ikns.simulate_protocol(
            ikns.virtual_subject(seed),
            seed=seed,
            marker_noise=1e-3 * noise,
            soft_tissue=skin,
            free_seconds=20.0,
            rate=50.0 if quick else 100.0,
            quick=quick,
        )
    except InvalidInput:
        return {}
    subject = ikns.calibrate(
        run.static.recording, [run.points.recording], natural=[run.free.recording]
    )
    return {method: line(subject, run.points, method) for method in METHODS}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=10)
    parser.add_argument("--quick", action="store_true", help="two people, 1 mm")
    options = parser.parse_args()
    warnings.simplefilter("ignore", MapWarning)
    people = 2 if options.quick else options.people
    print(
        f"{people} simulated people a row, seeds from 1; numpy {np.__version__}, "
        f"Python {platform.python_version()}.\n"
    )
    print(
        "| noise mm | method | gain, median (lowest to highest) | offset, median "
        "(farthest) | both as asked |\n|---|---|---|---|---|"
    )
    for noise in NOISE[1:2] if options.quick else NOISE:
        rows = [
            person(seed, noise, quick=options.quick) for seed in range(1, people + 1)
        ]
        for method in METHODS:
            gain, offset = np.array([row[method] for row in rows if row]).T
            right = (gain >= GAIN[0]) & (gain <= GAIN[1]) & (np.abs(offset) <= OFFSET)
            farthest = offset[np.abs(offset).argmax()]
            print(
                f"| {noise:g} | {method} | {np.median(gain):.3f} ({gain.min():.3f} to "
                f"{gain.max():.3f}) | {np.median(offset):+.3f} ({farthest:+.3f}) "
                f"| {right.sum()} of {len(right)} |"
            )


if __name__ == "__main__":
    main()
