"""What does the check of recordings not notice? Real people's, spoiled one by one.

Clean recordings of UE_ADL with clusters of four markers on every segment:

- a cluster slides along its segment, or a band turns about the forearm by as much, in
  the middle of the recording or between static trial and recording;
- the static trial, or the subject folder, is another person's, who wore such plates;
- the cameras' volume is 2 or 5 % too large, or one axis of it 5 or 8 % too long in both
  recordings;
- a marker of a cluster is 0.05 to 0.2 s late;
- the frame rate is wrong in one file, or in both.

Told is what the judge warns of or refuses with any sentence; without a fault it must
say nothing. "Calibrated" compares with a subject folder instead of a static trial: four
tasks of the right arm, repeat 1; what is checked are repeats 2. The
segments and the wrist's and elbow's centers are the landmarks' of the static trial, no
part of the toolkit's body. Labels carry no subject's name.
"""

import argparse
import json
import platform
from itertools import product
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ikns.body.skeleton import Skeleton
from ikns.calibration.judge.offsets import offsets_in_links, offsets_report
from ikns.calibration.judge.recordings import check_recordings
from ikns.calibration.judge.subjects import other_session
from ikns.calibration.measured_body import measured_body
from ikns.calibration.scaling import scale
from ikns.motion.marker_ik import MarkerIK, turned_markers
from ikns.numerics.median import finite_median
from ikns.recording.files import read
from ikns.recording.recording import Recording

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
CLUSTERS = {"upper arm": "UAR", "forearm": "LAR", "hand": "HAN"}


def place(recording: Recording, *names: str) -> np.ndarray:
    """Mean place of markers over a static trial, (3,) m."""
    columns = [_column(recording, name) for name in names]
    return np.asarray(np.nanmean(recording.markers[:, columns], axis=(0, 1)))


def _column(recording: Recording, name: str) -> int:
    return [label.rpartition(":")[2] for label in recording.labels].index(name)


def slipped(
    static: Recording,
    recording: Recording,
    side: str,
    segment: str,
    *,
    slide: float = 0.0,
    turn: float = 0.0,
    start: float = 0.5,
) -> Recording:
    """Move a cluster along its segment, or about it along the skin, m.

    From a share `start` of the recording on.
    """
    elbow = place(static, f"{side}LEP", f"{side}MEP")
    wrist = place(static, f"{side}SPR", f"{side}SPU")
    ends = {
        "upper arm": (place(static, f"{side}GTH"), elbow),
        "forearm": (elbow, wrist),
        "hand": (wrist, 2 * wrist - elbow),
    }[segment]
    names = [f"{side}{CLUSTERS[segment]}{k}" for k in (1, 2, 3, 4)]
    own = [_column(recording, name) for name in names]
    calm = np.array([place(static, name) for name in names])
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    out = calm.mean(axis=0) - ends[0]
    out -= (out @ along) * along
    about = Rotation.from_rotvec(turn / np.linalg.norm(out) * along)
    moved = about.apply(calm - ends[0]) + ends[0] + slide * along - calm
    markers = np.array(recording.markers)
    late = markers[round(start * len(markers)) :]
    late[:, own] += np.einsum("tij,kj->tki", _turns(calm, late[:, own]), moved)
    return Recording(recording.time, markers, recording.labels, recording.source)


def _turns(calm: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """How markers (T, K, 3) are turned against (K, 3), (T, 3, 3); NaN where unseen."""
    known = np.isfinite(seen).all(axis=(1, 2))
    turns = np.full((len(seen), 3, 3), np.nan)
    here = seen[known] - seen[known].mean(axis=1, keepdims=True)
    u, _, v = np.linalg.svd(np.einsum("tki,kj->tij", here, calm - calm.mean(axis=0)))
    u[:, :, 2] *= np.linalg.det(u @ v)[:, None]
    turns[known] = u @ v
    return turns


def told(recording: Recording, skeleton: Skeleton, report: dict | None = None) -> bool:
    """Whether the judge says anything of a recording of this person."""
    found = check_recordings([recording], skeleton=skeleton, report=report)
    return any(finding.severity != "note" for finding in found.findings)


def trials_of(
    folder: Path, name: str, repeat: int, *, quick: bool
) -> list[tuple[str, Recording]]:
    """Read a repeat of each task and arm, with its side."""
    tasks = "F" if quick else "FADC"
    return [
        (side, read(folder / name / f"{name}{task}{side}{repeat}.csv"))
        for task, side in product(tasks, "R" if quick else "RL")
    ]


def calibrated(
    static: Recording, trials: list[Recording], chain: str = "right_arm"
) -> tuple[Skeleton, dict]:
    """Body and report as of a calibration, which needs hands at rest beside these."""
    body = measured_body(
        static,
        trials,
        (),
        generic=None,
        marker_set="ue_adl",
        chain=chain,
        min_static=0.15,
        progress=None,
    )
    rows = [{"residual_median_m": finite_median(m.residual)} for m in body.explorations]
    offsets = offsets_report(body.skeleton, chain, trials, body.explorations)
    return body.skeleton, {"explorations": rows, "offsets_m": offsets}


def offsets(body: Skeleton, trial: Recording, usual: dict | None = None) -> dict:
    """By link of the arms: median offset of its markers from the body, (3,) m.

    Beyond its range at calibration where `usual` gives that.
    """
    step = max(1, len(trial.time) // 60)
    some = trial.markers[::step]
    seconds = np.arange(len(some), dtype=float)
    few = Recording(seconds, some, trial.labels, trial.source)
    q = MarkerIK(body).track(few).q
    markers = body.marker_set.pick(few.labels, few.markers)
    placed = np.stack(
        [turned_markers(body, *one) for one in zip(q, markers, strict=True)]
    )
    found = {}
    for link, apart in offsets_in_links(body, q, placed, markers).items():
        middle = np.nanmedian(apart, axis=0)
        if usual is None:
            found[link] = middle
        elif link in usual:
            found[link] = middle - np.clip(middle, *usual[link])
    return found


def left_out(people: list[list[dict]]) -> list[tuple[str, float, float, int, int]]:
    """Compare each person's offsets with 1.5 times the largest of the others.

    Returns part of the arm, the largest offset, the most of such a limit, and how many
    trials are beyond it, of how many.
    """
    rows = []
    for part in ("clavicle", "upper_arm", "forearm", "hand"):
        sizes = [
            [
                max(np.linalg.norm(x) for link, x in trial.items() if part in link)
                for trial in own
            ]
            for own in people
        ]
        shares = [
            np.array(own) / (1.5 * max(max(o) for o in sizes if o is not own))
            for own in sizes
        ]
        largest = max(max(own) for own in sizes)
        share = np.concatenate(shares)
        rows.append((part, largest, share.max(), int((share > 1).sum()), len(share)))
    return rows


def late(recording: Recording, label: str, seconds: float) -> Recording:
    """Delay one marker."""
    markers = np.array(recording.markers)
    column, frames = _column(recording, label), round(seconds * recording.rate)
    markers[frames:, column] = recording.markers[:-frames, column]
    return Recording(recording.time, markers, recording.labels, recording.source)


def _usual(static: Recording, trial: Recording) -> tuple[Skeleton, dict]:
    body, report = calibrated(static, [trial])
    return body, report["offsets_m"]


def scaled(recording: Recording, *factors: float) -> Recording:
    """Scale the axes of the room."""
    markers = recording.markers * factors
    return Recording(recording.time, markers, recording.labels, recording.source)


def scaled_to(static: Recording) -> Skeleton:
    """Scale the generic adult to a static trial, however short."""
    return scale(Skeleton.load(), static, marker_set="ue_adl", min_duration=0.15)[0]


def at_rate(recording: Recording, factor: float) -> Recording:
    """Write another frame rate, `factor` times the true one."""
    return Recording(
        recording.time / factor,
        recording.markers,
        recording.labels,
        recording.source,
    )


def hand_speed(recording: Recording, side: str) -> float:
    """95th percentile of a hand's speed while it moves, m/s, over 50 ms."""
    own = [_column(recording, f"{side}HAN{k}") for k in (1, 2, 3, 4)]
    middle = recording.markers[:, own].mean(axis=1)
    lag = max(1, round(0.05 * recording.rate))
    away = np.linalg.norm(middle[lag:] - middle[:-lag], axis=1)
    speed = away * recording.rate / lag
    return float(np.nanquantile(speed[speed > 0.05], 0.95))


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--quick", action="store_true", help="two people, one trial")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    folder = options.data / "ue_adl"
    names = sorted(path.name for path in folder.glob("ADL*"))
    names = names[:2] if options.quick else names
    statics = {name: read(folder / name / f"{name}_static.csv") for name in names}
    bodies = {name: scaled_to(static) for name, static in statics.items()}
    trials = {name: trials_of(folder, name, 1, quick=options.quick) for name in names}
    every = [(name, side, trial) for name, own in trials.items() for side, trial in own]
    rows: dict[str, list[bool]] = {}
    some: dict[tuple[str, str, str], bool] = {}
    sizes = (0.02,) if options.quick else (0.02, 0.03)

    def add(
        row: str, trial: Recording, skeleton: Skeleton, report: dict | None = None
    ) -> None:
        rows.setdefault(row, []).append(told(trial, skeleton, report))

    for name, side, trial in every:
        body, static = bodies[name], statics[name]
        add("no fault", trial, body)
        for when, start in (("in the middle", 0.5), ("before", 0.0)):
            for segment, size in product(CLUSTERS, sizes):
                wrong = slipped(static, trial, side, segment, slide=size, start=start)
                add(f"{segment} slides {1000 * size:.0f} mm {when}", wrong, body)
            wrong = slipped(static, trial, side, "forearm", turn=0.02, start=start)
            add(f"forearm turns 20 mm {when}", wrong, body)
        for factor in (1.02, 1.05):
            add(
                f"volume {100 * (factor - 1):.0f} % larger",
                scaled(trial, factor, factor, factor),
                body,
            )
        for segment, seconds in product(CLUSTERS, (0.05, 0.1, 0.2)):
            wrong = late(trial, f"{side}{CLUSTERS[segment]}2", seconds)
            add(f"a marker of the {segment} {seconds:g} s late", wrong, body)
        worn = body.marker_set
        rows.setdefault("frame rate twice the static trial's", []).append(
            bool(other_session(static, at_rate(trial, 2.0), worn))
        )
        add("frame rate twice the true one in both", at_rate(trial, 2.0), body)
        for other in names:
            if other != name:
                row = "static trial of another"
                add(row, trial, bodies[other])
                some[row, name, other] = (
                    some.get((row, name, other), False) or (rows[row][-1])
                )
    for name, axis in product(names, range(3)):
        for percent in (5, 8):
            factors = [1.0, 1.0, 1.0]
            factors[axis] += percent / 100
            body = scaled_to(scaled(statics[name], *factors))
            for _, trial in trials[name]:
                row = f"{'xyz'[axis]} axis {percent} % longer in both"
                add(row, scaled(trial, *factors), body)
    known = {
        name: calibrated(statics[name], [one for side, one in own if side == "R"])
        for name, own in trials.items()
    }
    later = {name: trials_of(folder, name, 2, quick=options.quick) for name in names}
    for name, own in later.items():
        for side, trial in own:
            for other in names:
                row = "subject folder of another" if other != name else "no fault"
                add(f"{row}, calibrated", trial, *known[other])
                if other != name:
                    some[row, name, other] = (
                        some.get((row, name, other), False)
                        or (rows[f"{row}, calibrated"][-1])
                    )
            if side == "L":
                continue
            for segment, size in product(CLUSTERS, sizes):
                wrong = slipped(
                    statics[name], trial, side, segment, slide=size, start=0.0
                )
                row = f"{segment} slides {1000 * size:.0f} mm before, calibrated"
                add(row, wrong, *known[name])
    for (row, _, _), hit in some.items():
        rows.setdefault(f"{row}, in one of the trials or more", []).append(hit)
    held = {
        "static trial": [
            [offsets(bodies[name], trial) for _, trial in (*own, *later[name])]
            for name, own in trials.items()
        ]
    }
    if not options.quick:
        for task, title in enumerate(("forward", "across", "to drink", "to comb")):
            held[f"calibration with one reach {title}"] = [
                [
                    offsets(body, trial, usual)
                    for side, trial in (*own, *later[name])
                    if side == "R" and trial is not own[2 * task][1]
                ]
                for name, own in trials.items()
                for body, usual in [_usual(statics[name], own[2 * task][1])]
            ]
    speeds = [hand_speed(trial, side) for _, side, trial in every]
    if options.json:
        print(json.dumps({row: [sum(hit), len(hit)] for row, hit in rows.items()}))
        return
    print(f"numpy {np.__version__}, Python {platform.python_version()}, real people\n")
    print("| fault | told |\n|---|---|")
    for row, hit in rows.items():
        print(f"| {row} | {sum(hit)} of {len(hit)} |")
    print(
        "\n| offsets from | part | largest, mm | beyond 1.5 times the largest of the "
        "other people | most of that |\n|---|---|---|---|---|"
    )
    for title, people in held.items():
        for part, largest, share, beyond, count in left_out(people):
            print(
                f"| {title} | {part} | {1000 * largest:.1f} | {beyond} of {count} "
                f"| {share:.2f} |"
            )
    print(
        f"\nSpeed of the hand, 95th percentile of each clean trial: {min(speeds):.2f} "
        f"to {max(speeds):.2f} m/s"
    )


if __name__ == "__main__":
    main()
