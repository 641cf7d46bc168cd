"""Measure how far a marker may stray before a frame stops counting, and what c does.

One visible marker of the chain is moved by a distance in a random direction, or
exchanged with another, in one frame of a simulated recording, and the pose solved from
the pose before. Compared are three checks, each with those before it: root mean square
distance of all markers; the largest distance of a marker of the chain; the largest
difference between the distance of two markers of a segment and that at calibration.
What the second and third may not refuse is what real people's markers do anyway: that
stands below, where their recordings are.
"""

import argparse
import json
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ikns import MarkerIK, Skeleton, read, scale
from ikns.calibration import calibrate, sight_needs
from ikns.calibration.subject import Subject
from ikns.live.control import ControlFrame, FrameSolver
from ikns.live.control.settings import ControlSettings
from ikns.motion.marker_ik.turns import turned_markers
from ikns.recording.recording import Recording
from ikns.simulation import simulate_protocol, virtual_subject

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
DISTANCES = (0.03, 0.05, 0.08, 0.10, 0.12, 0.15, 0.20, 0.25, 0.30, 0.40, 0.50)
CHECKS = ControlSettings()
#: Landmarks on the skin of an arm and a trunk, by segment, without a static trial.
LANDMARKS = {
    "box_lift/markers_analogs.c3d": (
        ("STER", "STERr", "STERl", "XIPH", "T1", "T10"),
        ("DELT", "ARMl", "ARMm", "ARMp_up", "ARMp_do", "EPICl", "EPICm"),
        ("LARMm", "LARMl", "LARM_elb", "LARM_ant", "STYLr", "STYLr_up", "STYLu"),
        ("INDEX", "LASTC", "MEDH", "LATH"),
    ),
    "shoulder_kinova/example.c3d": (
        ("C7", "T10", "MAN", "XYP"),
        ("ARM", "DELT", "EPI_med", "EPI_lat"),
        ("ULNA", "RADIUS", "SEML"),
        ("MET5", "MET2"),
    ),
}
NAMES = ("rms", "worst", "distances")


def person(seed: int) -> tuple[Subject, Recording]:
    """Simulate somebody at ten points, cameras' noise and occlusion included."""
    protocol = simulate_protocol(
        virtual_subject(seed),
        seed=seed,
        static_seconds=1.2,
        free_seconds=0.1,
        point_seconds=2.0,
    )
    points = protocol.points.recording
    return calibrate(protocol.static.recording, [points]), points


class Strayed(NamedTuple):
    """One person's draws.

    Figures are (..., 4): rms distance, worst distance, intermarker error, all m, and
    the change of c.
    """

    #: (draws, distances, 4)
    astray: np.ndarray
    #: (draws,) segment of the marker, with how many it carries.
    segment: np.ndarray
    #: (exchanges, 4)
    exchanged: np.ndarray
    #: Frames of the recording as it is that do not count.
    refused: int


def strayed(seed: int, draws: int) -> Strayed:
    """Draw frames, markers and directions; then exchange all markers two and two."""
    subject, recording = person(seed)
    skeleton, chain = subject.skeleton, subject.chain
    seen = skeleton.marker_set.pick(recording.labels, recording.markers)
    shown = MarkerIK(skeleton).track(recording).in_sight(chain)
    segments = {
        column: f"{link.replace('_', ' ')}, {len(columns)}"
        for link, (columns, _) in sight_needs(skeleton, chain).items()
        for column in columns
    }
    of_chain = np.array(list(segments))
    rng = np.random.default_rng(seed)
    solver = FrameSolver(skeleton, subject.null_space_map, chain)
    refused = 0
    for frame in np.flatnonzero(shown):
        refused += not counts(np.array(figures(solver.solve(seen[frame]), 0.0)))[-1]

    def compare(markers: np.ndarray, true: ControlFrame) -> tuple[float, ...]:
        solver.reset(true.q)
        return figures(solver.solve(markers), float(true.c[0]))

    rows, drawn = [], []
    while len(rows) < draws:
        frame, marker = rng.choice(np.flatnonzero(shown)), rng.choice(of_chain)
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        if not np.isfinite(seen[frame, marker]).all():
            continue
        solver.reset()
        true = solver.solve(seen[frame])
        row = []
        for distance in DISTANCES:
            markers = seen[frame].copy()
            markers[marker] += distance * direction
            row.append(compare(markers, true))
        rows.append(row)
        drawn.append(segments[marker])
    exchanged = []
    for frame in rng.choice(np.flatnonzero(shown), max(1, draws // 100)):
        solver.reset()
        true = solver.solve(seen[frame])
        for a, b in combinations(of_chain, 2):
            markers = seen[frame].copy()
            markers[[a, b]] = markers[[b, a]]
            if np.isfinite(markers[[a, b]]).all():
                exchanged.append(compare(markers, true))
    return Strayed(np.array(rows), np.array(drawn), np.array(exchanged), refused)


def figures(solved: ControlFrame, c: float) -> tuple[float, float, float, float]:
    """Return what the checks look at, and how far c is off."""
    away = abs(float(solved.c[0]) - c)
    return solved.residual, solved.worst_residual, solved.intermarker_error, away


def counts(found: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Whether a frame counts by the first check, by two, and by all."""
    rms = found[..., 0] <= CHECKS.max_residual
    worst = rms & (found[..., 1] <= CHECKS.max_worst_residual)
    return rms, worst, worst & (found[..., 2] <= CHECKS.max_intermarker_error)


def real(folder: Path, *, quick: bool) -> list[dict]:
    """Worst distance of the chain's markers in real recordings, a row a trial, mm."""
    rows = []
    names = sorted(p.name for p in folder.iterdir() if p.is_dir())
    for name in names[:1] if quick else names:
        static = read(folder / name / f"{name}_static.csv")
        skeleton, _ = scale(
            Skeleton.load(), static, marker_set="ue_adl", min_duration=0.15
        )
        for task in "F" if quick else "FADC":
            for side, letter in (("right", "R"), ("left", "L")):
                recording = read(folder / name / f"{name}{task}{letter}1.csv")
                motion = MarkerIK(skeleton).track(recording)
                seen = skeleton.marker_set.pick(recording.labels, recording.markers)
                model = np.stack(
                    [
                        turned_markers(skeleton, q, frame)
                        for q, frame in zip(motion.q, seen, strict=True)
                    ]
                )
                needs = sight_needs(skeleton, f"{side}_arm").values()
                of_chain = np.concatenate([columns for columns, _ in needs])
                away = np.linalg.norm(model - seen, axis=2)[:, of_chain]
                apart = [
                    np.linalg.norm(model[:, a] - model[:, b], axis=1)
                    - np.linalg.norm(seen[:, a] - seen[:, b], axis=1)
                    for columns, _ in needs
                    for a, b in combinations(columns, 2)
                ]
                row = {"trial": f"{name}{task}{letter}1", "frames": len(seen)}
                for what, off in (("worst", away.T), ("intermarker", np.abs(apart))):
                    largest = 1000 * np.nanmax(off, axis=0)
                    row[f"{what}_p50_mm"] = float(np.median(largest))
                    row[f"{what}_p99_mm"] = float(np.percentile(largest, 99))
                    row[f"{what}_max_mm"] = float(largest.max())
                rows.append(row)
    return rows


def landmarks(folder: Path) -> list[dict]:
    """Change of distances within segments since they were first seen, mm."""
    rows = []
    for name, segments in LANDMARKS.items():
        recording = read(folder / name)
        labels = [label.partition(":")[2] for label in recording.labels]
        row = {"trial": name.partition("/")[0], "frames": len(recording.time)}
        largest = (0.0, "")
        for segment in segments:
            for pair in combinations(segment, 2):
                first, second = (recording.markers[:, labels.index(m)] for m in pair)
                apart = np.linalg.norm(first - second, axis=1)
                apart = apart[np.isfinite(apart)]
                if len(apart) > 20:
                    off = float(np.abs(apart - apart[:20].mean()).max())
                    largest = max(largest, (1000 * off, " and ".join(pair)))
        row["intermarker_max_mm"], row["between"] = largest
        rows.append(row)
    return rows


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--people", type=int, default=5)
    parser.add_argument("--draws", type=int, default=2000, help="per person")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="one person, few draws")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    people, draws = (1, 100) if options.quick else (options.people, options.draws)
    drawn = [strayed(options.seed + person, draws) for person in range(people)]
    found = np.concatenate([one.astray for one in drawn])
    segment = np.concatenate([one.segment for one in drawn])
    rows = [
        {"astray": f"{distance:.2f} m"} | _summary(found[:, k])
        for k, distance in enumerate(DISTANCES)
    ]
    exchanged = np.concatenate([one.exchanged for one in drawn])
    rows.append({"astray": "exchanged"} | _summary(exchanged))
    folder = options.data / "ue_adl"
    trials = real(folder, quick=options.quick) if folder.is_dir() else []
    on_skin = landmarks(options.data) if folder.is_dir() else []
    refused = sum(one.refused for one in drawn)
    by_segment = {
        name: counts(found[segment == name])[-1].mean(axis=0).tolist()
        for name in np.unique(segment).tolist()
    }
    if options.json:
        told = {
            "simulated": rows,
            "counts_by_segment": by_segment,
            "undisturbed_refused": refused,
            "real": trials,
            "real_landmarks": on_skin,
        }
        print(json.dumps(told))
        return
    print(
        f"Simulated: {people} people x {draws} draws of frame, marker, direction; "
        f"{len(exchanged)} exchanges.\nA frame counts with rms <= "
        f"{1000 * CHECKS.max_residual:g} mm; worst marker <= "
        f"{1000 * CHECKS.max_worst_residual:g} mm besides; distances within\nsegments "
        f"off by <= {1000 * CHECKS.max_intermarker_error:g} mm besides. Of frames as "
        f"they are, {refused} do not count.\n"
    )
    print(
        "| astray | counts by rms, % | c then off by (p95) | and by worst, % | off by "
        "| and by distances, % | off by |"
    )
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        cells = [row["astray"]]
        for name in NAMES:
            change = row[f"{name}_c_p95"]
            cells.append(f"{100 * row[f'{name}_counts']:.2f}")
            cells.append("-" if change is None else f"{change:.2f}")
        print(f"| {' | '.join(cells)} |")
    print("\nBy all checks, %, by segment of the marker and how many it carries\n")
    print(f"| segment, markers | {' | '.join(f'{d:.2f} m' for d in DISTANCES)} |")
    print("|---|" + "---|" * len(DISTANCES))
    for name, shares in by_segment.items():
        print(f"| {name} | {' | '.join(f'{100 * share:.1f}' for share in shares)} |")
    if not trials:
        print(f"\nNo real recordings in {folder}: not measured.")
        return
    print("\nReal: worst marker of the chain, and distances within its segments, mm\n")
    print("| trial | frames | worst p50 | p99 | largest | apart p50 | p99 | largest |")
    print("|---|---|---|---|---|---|---|---|")
    for trial in trials:
        told = [
            f"{trial[f'{what}_{which}_mm']:.0f}"
            for what in ("worst", "intermarker")
            for which in ("p50", "p99", "max")
        ]
        print(f"| {trial['trial']} | {trial['frames']} | {' | '.join(told)} |")
    for row in on_skin:
        print(
            f"\n{row['trial']}, {row['frames']} frames, landmarks on the skin: up to "
            f"{row['intermarker_max_mm']:.0f} mm, between {row['between']}."
        )


def _summary(found: np.ndarray) -> dict[str, float | None]:
    row: dict[str, float | None] = {}
    for name, passed in zip(NAMES, counts(found), strict=True):
        change = found[passed, 3]
        row[f"{name}_counts"] = float(passed.mean())
        row[f"{name}_c_p95"] = float(np.percentile(change, 95)) if len(change) else None
    return row


if __name__ == "__main__":
    main()
