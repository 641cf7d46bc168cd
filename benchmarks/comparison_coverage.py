"""Do the intervals of leak and crosstalk hold the truth? Virtual subjects, one table.

Everything here is simulated: a calibration of 5 s at each of three points
(50 Hz, 1 mm of marker noise, 3 % occluded, landmarks palpated to 2 mm), then 20 s of
natural reaches. `ikns.compare` reports leak, turn and crosstalk with 95 % intervals
from these seconds alone. What the intervals should hold was written down before any
was drawn:

- The map is the one that was calibrated: its Z, m and M are taken as given.
- leak, turn: the length of the slope of the true hand's position (orientation) on c,
  with c from the true joint angles through this map, while the same person explores the
  same place again and again: 24 visits of 5 s, no cameras. All points: root mean
  square over the three.
- crosstalk: the mean change of c from rest to rest, and the sum of changes over the sum
  of distances, over 150 natural reaches of the same person, likewise.

So an interval has to allow for the few swivels in 5 s, for the noise, and for the error
of the scaled body. The truth is itself a sample, 24 and about 10 times as long as the
recording; what that adds to the scatter (2 and 5 %) counts against the intervals.

Coverage is the share of intervals that hold their truth, with its own exact binomial
interval (Clopper and Pearson 1934). Points of one subject are not independent; the rows
"all points" have one interval a subject.
"""

import argparse
import json
import os
import platform
import sys
import time
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation
from scipy.stats import binomtest

from ikns.analysis.compare import (
    Crosstalk,
    NullSpaceComparison,
    compare_motion,
    crosstalk,
    motion_crosstalk,
)
from ikns.analysis.compare.leak import hand_turns, slopes
from ikns.body.chains import SIDES
from ikns.body.skeleton import Skeleton
from ikns.calibration import calibrate
from ikns.motion.marker_ik import MarkerIK
from ikns.nullspace.map import MapWarning, NullSpaceMap
from ikns.simulation import (
    Protocol,
    Unsteadiness,
    simulate_protocol,
    virtual_subject,
)
from ikns.simulation.arm import ArmKinematics
from ikns.simulation.habitual_places import habitual_somewhere, reach_by_joints
from ikns.simulation.movement import MovementPlan, explore, join, reach_samples
from ikns.simulation.places import Place
from ikns.simulation.posture_habits import PostureHabits
from ikns.simulation.protocol_body import ProtocolBody, draw_protocol_body
from ikns.simulation.wander import tremor, wander
from ikns.view.render import png
from ikns.view.style import GREY, INK, RED, figure_style, new_figure

CHAIN, SIDE = "right_arm", "right"
POINTS, RATE, TRUE_RATE = 3, 50.0, 25.0
SECONDS, REACHING, VISITS, REACHES = 5.0, 20.0, 24, 150
ROWS = (
    "leak, each point",
    "leak, all points",
    "turn, each point",
    "turn, all points",
    "crosstalk, mean change",
    "crosstalk, per meter",
)


def drawn_body(run: Protocol, arm: ArmKinematics) -> ProtocolBody:
    """Draw again what :func:`simulate_protocol` drew about a person first."""
    body = draw_protocol_body(
        run.subject,
        [arm],
        n_points=POINTS,
        girdle_follow=0.0,
        habits=run.habits,
        rng=np.random.default_rng(run.settings["seed"]).spawn(7)[0],
    )
    np.testing.assert_array_equal(body.positions[0], run.places)  # in step with it
    return body


def carried_out(
    arm: ArmKinematics,
    sitting: np.ndarray,
    plan: MovementPlan,
    rng: np.random.Generator,
) -> np.ndarray:
    """Joint angles of the body as in the simulation, all samples at a time, (T, 18)."""
    n, u, body = len(plan.point), Unsteadiness(), arm.skeleton
    settings = {"cutoff": u.drift_hz, "rate": TRUE_RATE}
    shift = wander(rng, n, 3, sd=u.drift, **settings)
    shift += tremor(rng, n, 3, sd=u.tremor, rate=TRUE_RATE)
    tilt = wander(rng, n, 3, sd=u.tilt, **settings)
    tilt += tremor(rng, n, 3, sd=u.tremor_tilt, rate=TRUE_RATE)
    wanted = Rotation.from_rotvec(tilt) * Rotation.from_matrix(plan.rotation)
    # Joints outside the arm wander a third of a degree there; they do not move it.
    angles = np.tile(sitting, (n, 1))
    angles[:, arm.columns] = plan.postures
    side = SIDES.index(SIDE)
    for _ in range(20):
        x, R = (each[:, side] for each in body.hands_in_thorax(angles))
        turn = (wanted * Rotation.from_matrix(R).inv()).as_rotvec()
        error = np.hstack([plan.position + shift - x, turn])
        if np.abs(error).max() < 1e-7:
            return angles
        J = body.chain_jacobian(angles, CHAIN)
        Jt = np.swapaxes(J, 1, 2)
        step = (Jt @ np.linalg.solve(J @ Jt, error[:, :, None]))[:, :, 0]
        longest = np.abs(step).max(axis=1, keepdims=True)
        step *= np.minimum(1.0, 0.3 / np.maximum(longest, 1e-300))
        angles[:, arm.columns[2:]] += step
    raise RuntimeError("a planned hand pose was not reached")


def true_slopes(
    learned: NullSpaceMap,
    arm: ArmKinematics,
    sitting: np.ndarray,
    place: Place,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Slopes of the true hand and its turn on c, at the map's point nearest to here."""
    visits = [
        explore(place, seconds=SECONDS, rate=TRUE_RATE, rng=rng, index=0)
        for _ in range(VISITS)
    ]
    angles = carried_out(arm, sitting, join(visits), rng)
    x, R = (each[:, SIDES.index(SIDE)] for each in arm.skeleton.hands_in_thorax(angles))
    k = int(np.linalg.norm(learned.centers_ - place.position, axis=1).argmin())
    width = learned.upper_[k, 0] - learned.lower_[k, 0]
    c = angles[:, arm.columns[2:]] @ learned.directions_[k, 0] / width
    return slopes(c[:, None], x)[0], slopes(c[:, None], hand_turns(R))[0]


def true_crosstalk(
    learned: NullSpaceMap,
    arm: ArmKinematics,
    body: ProtocolBody,
    habits: PostureHabits,
    rng: np.random.Generator,
) -> Crosstalk:
    """Crosstalk on many natural reaches of the true body."""
    sitting = body.sitting
    stops = [
        habitual_somewhere(
            arm, sitting, habits=habits, girdle_rest=body.girdle_rest, rng=rng
        )
        for _ in range(REACHES + 1)
    ]
    reaches = [
        reach_by_joints(arm, sitting, *ends, n=reach_samples(*ends, rate=TRUE_RATE))
        for ends in pairwise(stops)
    ]
    plan = join(reaches)
    angles = carried_out(arm, sitting, plan, rng)
    x = arm.skeleton.hands_in_thorax(angles)[0][:, SIDES.index(SIDE)]
    speed = np.linalg.norm(np.gradient(x, 1 / TRUE_RATE, axis=0), axis=1)
    c = learned.control_signal(angles[:, arm.columns[2:]], x)
    return crosstalk(c, speed, x, resamples=0)


def reported(
    seed: int, resamples: int
) -> tuple[NullSpaceComparison, Crosstalk, NullSpaceMap, Protocol]:
    """Return what the recordings alone say about a virtual subject."""
    person = virtual_subject(seed)
    run = simulate_protocol(
        person,
        seed=seed,
        n_points=POINTS,
        static_seconds=2.0,
        free_seconds=REACHING,
        point_seconds=SECONDS,
        rate=RATE,
    )
    adult = person.adult
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MapWarning)
        subject = calibrate(
            run.static.recording,
            [run.points.recording],
            generic=Skeleton.from_anthropometry(
                adult.stature_m, adult.mass_kg, adult.sex
            ),
            n_points=POINTS,
        )
    learned = subject.null_space_map
    found = compare_motion(
        learned, subject.skeleton, subject.motions[0], resamples=resamples, seed=seed
    )
    reaching = MarkerIK(subject.skeleton).track(run.free.recording, chain=CHAIN)
    across = motion_crosstalk(learned, reaching, resamples=resamples, seed=seed)
    return found, across, learned, run


def one_subject(seed: int, resamples: int) -> dict[str, list[list[float]]]:
    """Return the reported value, low, high, and the truth of each row."""
    found, across, learned, run = reported(seed, resamples)
    arm = ArmKinematics(run.subject.skeleton, SIDE)
    body = drawn_body(run, arm)
    (places,) = body.places
    rng = np.random.default_rng([seed, 1])
    order = [
        int(np.linalg.norm([p.position - center for p in places], axis=1).argmin())
        for center in learned.centers_[found.points]
    ]
    true = [true_slopes(learned, arm, body.sitting, places[k], rng) for k in order]
    truly = true_crosstalk(learned, arm, body, run.habits, rng)
    rows: dict[str, list[list[float]]] = {}
    for i, name in enumerate(("leak", "turn")):
        lengths = np.array([np.linalg.norm(slope[i]) for slope in true])
        values = getattr(found, name)[:, 0]
        ends = getattr(found, f"{name}_interval")[:, 0]
        rows[f"{name}, each point"] = np.column_stack([values, ends, lengths]).tolist()
        root = float(np.sqrt(np.mean(lengths**2)))
        rows[f"{name}, all points"] = [[*found.pooled[name], root]]
    for name, key in (("mean change", "mean_change"), ("per meter", "per_meter")):
        ends = getattr(across, f"{key}_interval")
        rows[f"crosstalk, {name}"] = [
            [getattr(across, key), *ends, getattr(truly, key)]
        ]
    return rows


def summary(subjects: list[dict[str, list[list[float]]]]) -> dict[str, dict]:
    """Coverage of each row."""
    table = {}
    for name in ROWS:
        rows = np.array([row for subject in subjects for row in subject[name]])
        known = np.isfinite(rows).all(axis=1)
        value, low, high, truth = rows[known].T
        hit = (low <= truth) & (truth <= high)
        exact = binomtest(int(hit.sum()), len(hit)).proportion_ci(0.95)
        table[name] = {
            "intervals": len(hit),
            "without": int((~known).sum()),
            "coverage": float(hit.mean()),
            "coverage_interval": [float(exact.low), float(exact.high)],
            "truth_below": float((truth < low).mean()),
            "truth_above": float((truth > high).mean()),
            "median_value": float(np.median(value)),
            "median_low": float(np.median(low)),
            "median_high": float(np.median(high)),
            "median_truth": float(np.median(truth)),
        }
    return table


def print_table(table: dict[str, dict]) -> None:
    """Print the table; leak in mm, turn in deg."""
    print(
        "                             coverage of 95 % intervals    truth     "
        "median reported [interval]   median\n"
        "                          n  %     (exact 95 %)        below above   "
        "mm, deg or c                  truth"
    )
    scale = {"leak": 1000.0, "turn": float(np.degrees(1)), "cros": 1.0}
    for name, row in table.items():
        unit = scale[name[:4]]
        low, high = (100 * end for end in row["coverage_interval"])
        value = [unit * row[f"median_{k}"] for k in ("value", "low", "high", "truth")]
        print(
            f"{name:24}{row['intervals']:5d} {100 * row['coverage']:5.1f}  "
            f"({low:4.1f} to {high:5.1f}) {100 * row['truth_below']:10.1f} "
            f"{100 * row['truth_above']:5.1f}  {value[0]:7.2f} "
            f"[{value[1]:5.2f}, {value[2]:6.2f}] {value[3]:13.2f}"
        )


def figure(subjects: list[dict[str, list[list[float]]]]) -> Figure:
    """Draw every interval beside its truth, in the order of the truth."""
    with figure_style():
        drawn = new_figure(
            f"Intervals that hold the truth, {len(subjects)} people",
            simulated=True,
            height=3.4,
        )
        panels = drawn.subplots(1, 2)
        for axes, (name, unit, scale) in zip(
            panels,
            (
                ("leak, each point", "leak (mm per unit of c)", 1000.0),
                ("crosstalk, mean change", "change of c a reach", 1.0),
            ),
            strict=True,
        ):
            rows = scale * np.array([row for s in subjects for row in s[name]])
            rows = rows[np.isfinite(rows).all(axis=1)]
            rows = rows[np.argsort(rows[:, 3])]
            at = np.arange(len(rows))
            hit = (rows[:, 1] <= rows[:, 3]) & (rows[:, 3] <= rows[:, 2])
            # Misses differ in width as well as in color.
            for chosen, color, width in ((hit, GREY, 0.5), (~hit, RED, 1.4)):
                axes.vlines(
                    at[chosen], *rows[chosen, 1:3].T, color=color, lw=width, zorder=1
                )
            axes.plot(at, rows[:, 3], color=INK, lw=1.4, label="truth", zorder=2)
            axes.set(
                title=f"{hit.mean():.1%} of {len(hit)} hold it",
                xlabel="interval, by its truth",
                ylabel=unit,
            )
        panels[0].vlines([], [], [], color=RED, lw=1.4, label="95 % interval beside it")
        panels[0].legend(loc="upper left")
    return drawn


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=200, help="how many subjects")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--resamples", type=int, default=400)
    parser.add_argument("--quick", action="store_true", help="one subject")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--figure", type=Path, help="picture to write, .png")
    parser.add_argument("--progress", action="store_true", help="on stderr")
    options = parser.parse_args()
    seeds = range(
        options.first, options.first + (1 if options.quick else options.seeds)
    )
    started, subjects = time.process_time(), []
    for seed in seeds:
        subjects.append(one_subject(seed, options.resamples))
        if options.progress:
            sys.stderr.write(json.dumps({"seed": seed} | subjects[-1]) + "\n")
            sys.stderr.flush()
    about = {
        "seeds": [seeds[0], seeds[-1]],
        "resamples": options.resamples,
        "processor_s_a_subject": (time.process_time() - started) / len(subjects),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "cores": os.cpu_count(),
    }
    table = summary(subjects)
    if options.figure:
        options.figure.write_bytes(png(figure(subjects)))
    if options.json:
        result = {"about": about, "simulated": True, "coverage": table}
        print(json.dumps(result | {"subjects": subjects}, indent=1))
        return
    print("Virtual subjects: everything here is simulated.")
    print(", ".join(f"{key} {value}" for key, value in about.items()))
    print_table(table)


if __name__ == "__main__":
    main()
