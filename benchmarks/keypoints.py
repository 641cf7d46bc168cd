"""What can keypoints from video give? One table, simulated.

People hold the hand at ten points and swivel the elbow. Their true joints give the
keypoints: at the places of the marker set, moved by a distance that stays (a network
does not find the same place on everybody) and by noise, new in every frame or drifting.
Then everything is as with markers: static trial, calibration, control signal. Compared
with the truth are the swivel of the elbow, and c with the best straight line through
the true swivel at each point, as c is a number without a unit.
"""

import argparse
import json
import platform

import numpy as np

import ikns
from ikns.calibration import calibrate
from ikns.errors import IknsError
from ikns.nullspace.map import still_mask
from ikns.recording.low_pass import low_pass
from ikns.recording.recording import Recording
from ikns.simulation import Trial, simulate_protocol, virtual_subject
from ikns.simulation.wander import wander

RATE = 60.0
#: Standard deviation of the distance that stays, per axis, m; Hz of drifting noise.
PLACE, DRIFT = 0.01, 1.0
#: Noise per axis, m; whether it drifts; low-pass, Hz; gate on the hand's speed, m/s.
CASES = [
    (0.0, False, None, 0.05),
    (0.0, False, None, 0.2),
    (0.005, False, 4.0, 0.05),
    (0.005, False, None, 0.2),
    (0.005, False, 4.0, 0.2),
    (0.010, False, None, 0.2),
    (0.010, False, 4.0, 0.2),
    (0.020, False, 4.0, 0.2),
    (0.005, True, 4.0, 0.2),
    (0.010, True, 4.0, 0.2),
]


def keypoints(
    body: ikns.Skeleton,
    trial: Trial,
    places: np.ndarray,
    *,
    noise: float,
    drifts: bool,
    cutoff: float | None,
    rng: np.random.Generator,
) -> Recording:
    """Joint centers of a trial as a network might find them."""
    seen = np.array([body.markers_in_world(q) for q in trial.truth.q]) + places
    n, m, _ = seen.shape
    if drifts and noise:
        drift = wander(rng, n, 3 * m, sd=noise, cutoff=DRIFT, rate=RATE)
        seen += drift.reshape(n, m, 3)
    else:
        seen += rng.normal(0, noise, seen.shape)
    found = Recording(trial.truth.time, seen, body.marker_set.labels, trial.name)
    return found if cutoff is None else low_pass(found, cutoff)


def person(seed: int, name: str, *, seconds: float, stature: bool) -> list[dict]:
    """One person's row of each case."""
    subject = virtual_subject(seed)
    run = simulate_protocol(
        subject, seed=seed, free_seconds=0.1, point_seconds=seconds, rate=RATE
    )
    worn = ikns.MarkerSet.load(name)
    body = subject.skeleton.with_nominal_markers(worn)
    adult = subject.adult
    generic = ikns.Skeleton.from_anthropometry(
        adult.stature_m, adult.mass_kg, adult.sex
    )
    rows = []
    for noise, drifts, cutoff, gate in CASES:
        # The same draws in every case, as far as they are the same.
        rng = np.random.default_rng(seed)
        places = rng.normal(0, PLACE, (len(worn.markers), 3))
        static, points = (
            keypoints(
                body, trial, places, noise=noise, drifts=drifts, cutoff=cutoff, rng=rng
            )
            for trial in (run.static, run.points)
        )
        try:
            found = calibrate(
                None if stature else static,
                [points],
                generic=generic,
                marker_set=name,
                max_hand_speed=gate,
            )
        except IknsError as error:
            rows.append({"refused": str(error)})
            continue
        rows.append(compared(found, points, run.points, gate))
    return rows


def compared(found: ikns.Subject, points: Recording, trial: Trial, gate: float) -> dict:
    """Swivel and c against the truth while the hand is held, and what was used."""
    motion = ikns.MarkerIK(found.skeleton).track(points)
    truth, own = trial.swivel, found.skeleton.swivel(motion.q)[:, 0]
    error = np.degrees(own - truth)
    c = found.null_space_map.control_signal(
        motion.chain_angles(found.chain), motion.task_position(found.chain)
    )
    c_errors, r = [], []
    for point in range(trial.point.max() + 1):
        rows = (trial.point == point) & np.isfinite(c) & np.isfinite(error)
        if rows.sum() < 10:
            continue
        error[rows] -= error[rows].mean()
        line = np.polyval(np.polyfit(truth[rows], c[rows], 1), truth[rows])
        c_errors.append(float((c[rows] - line).std()))
        r.append(float(np.corrcoef(c[rows], truth[rows])[0, 1]))
    held = trial.point >= 0
    still = still_mask(motion, found.chain, max_hand_speed=gate)
    return {
        "swivel_deg": float(np.nanstd(error[held])),
        "c": float(np.median(c_errors)),
        "r_worst": min(r),
        "r_median": float(np.median(r)),
        "still_share": float(still[held].mean()),
        "points": sum(row["point"] is not None for row in found.report["points"]),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--set", default="halpe26", help="body25, halpe26 or opencap")
    parser.add_argument("--people", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--stature", action="store_true", help="no static trial")
    parser.add_argument("--quick", action="store_true", help="one person, 2 s a point")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    people = [
        person(
            options.seed + k,
            options.set,
            seconds=2.0 if options.quick else 5.0,
            stature=options.stature,
        )
        for k in range(1 if options.quick else options.people)
    ]
    if options.json:
        print(json.dumps({"set": options.set, "cases": CASES, "people": people}))
        return
    body = "body from stature" if options.stature else "static trial"
    print(
        f"Simulated: {len(people)} people, {options.set}, {body}, {RATE:g} frames a "
        f"second, places off by {1000 * PLACE:g} mm, seed {options.seed}; "
        f"{platform.machine()}, numpy {np.__version__}.\n"
    )
    columns = {
        "swivel off by, deg": ("swivel_deg", "{:.1f}"),
        "c off by": ("c", "{:.2f}"),
        "r of c, median": ("r_median", "{:.2f}"),
        "worst point": ("r_worst", "{:.2f}"),
        "frames still, %": ("still_share", "{:.0%}"),
        "points": ("points", "{:.0f}"),
    }
    print(f"| noise mm | low-pass | gate m/s | {' | '.join(columns)} |")
    print("|---|---|---|" + "---|" * len(columns))
    for k, (noise, drifts, cutoff, gate) in enumerate(CASES):
        own = [rows[k] for rows in people if "refused" not in rows[k]]
        cells = []
        for name, form in columns.values():
            worst = min if name == "r_worst" else np.median
            cells.append(
                form.format(worst([row[name] for row in own])) if own else "refused"
            )
        kind = f"{1000 * noise:g}" + ", drifting" * drifts
        low = "-" if cutoff is None else f"{cutoff:g} Hz"
        lost = len(people) - len(own)
        if own and lost:
            cells[-1] += f" ({lost} people refused)"
        print(f"| {kind} | {low} | {gate:g} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
