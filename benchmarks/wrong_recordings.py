"""What the judge of recordings says when two labels are exchanged, and when none are.

Every pair of markers of a set that lie at different places carries each other's name:
everywhere (static trial and recording), or in 30 or 5 % of the recording's frames. It
counts when a joint turns by more than 10 deg for it, median over the frames concerned;
it is told when the judge finds anything. `oxford24` is worn by a simulated person,
`ue_adl` by seven real ones, of whom each pair gets one, drawn by the seed. False alarms
are counted on clean real recordings of all people.
"""

import argparse
import json
import platform
import sys
import time
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ikns import MarkerIK, MarkerSet, Skeleton, read
from ikns.calibration.judge.finding import Finding, refused
from ikns.calibration.judge.recordings import check_recordings
from ikns.calibration.scaling import StaticJudgment, judge_static
from ikns.recording.part import between
from ikns.recording.recording import Recording
from ikns.simulation import simulate_protocol, virtual_subject

BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"
MODES = {"everywhere": 1.0, "in 30 %": 0.3, "in 5 %": 0.05}
#: Markers closer than this lie at one place, m.
ONE_PLACE = 0.015
#: A joint that turns by more than this is wrong, rad.
WRONG = np.radians(10.0)


class Person(NamedTuple):
    """A clean static trial and recording, and what they give."""

    name: str
    marker_set: str
    static: Recording
    recording: Recording
    skeleton: Skeleton
    angles: np.ndarray


def clean(
    name: str, marker_set: str, static: Recording, recording: Recording
) -> Person:
    """Scale and track without any exchange."""
    skeleton = judge_static(
        Skeleton.load(), static, marker_set=marker_set, min_duration=0.1
    ).skeleton
    assert skeleton is not None, f"{name}: a clean static trial is refused"
    angles = MarkerIK(skeleton).track(recording).angles
    return Person(name, marker_set, static, recording, skeleton, angles)


def simulated(seed: int) -> Person:
    """Simulate somebody who holds the hand at ten points."""
    run = simulate_protocol(
        virtual_subject(seed),
        seed=seed,
        rate=50,
        static_seconds=1.2,
        free_seconds=0.1,
        point_seconds=1.5,
    )
    return clean(
        f"simulated {seed}", "oxford24", run.static.recording, run.points.recording
    )


def real(folder: Path, name: str, task: str, seconds: float) -> Person:
    """Read a person of UE_ADL: the static trial, and the middle of a recording."""
    static = read(folder / name / f"{name}_static.csv")
    whole = read(folder / name / f"{name}{task}.csv")
    half = min(seconds, whole.time[-1] - whole.time[0]) / 2
    middle = (whole.time[0] + whole.time[-1]) / 2
    return clean(name, "ue_adl", static, between(whole, middle - half, middle + half))


def exchanged(recording: Recording, a: str, b: str, rows: slice) -> Recording:
    """Exchange two names in some frames of a recording, where it has both."""
    labels = [label.rpartition(":")[2] for label in recording.labels]
    if not {a, b} <= set(labels):
        return recording
    markers = np.array(recording.markers)
    i, j = labels.index(a), labels.index(b)
    markers[rows, i], markers[rows, j] = (
        recording.markers[rows, j],
        (recording.markers[rows, i]),
    )
    return Recording(recording.time, markers, recording.labels, recording.source)


def pairs_of(person: Person) -> list[tuple[str, str]]:
    """Pairs of markers at different places in the static trial."""
    worn = MarkerSet.load(person.marker_set)
    places = worn.pick(person.static.labels, person.static.markers)
    seen = np.isfinite(places).all(axis=2).any(axis=0)
    middle = np.full(places.shape[1:], np.nan)
    middle[seen] = np.nanmedian(places[:, seen], axis=0)
    return [
        (worn.labels[i], worn.labels[j])
        for i, j in combinations(np.flatnonzero(seen), 2)
        if np.linalg.norm(middle[i] - middle[j]) > ONE_PLACE
    ]


def judge(
    person: Person,
    a: str,
    b: str,
    share: float,
    rng: np.random.Generator,
    *,
    name: bool,
) -> dict:
    """Exchange two markers, and ask the judge.

    Without `name` the judge does not look for the exchange that mends a static trial
    if it finds the trial unlikely anyway: that the pair is named is not known then.
    """
    n = len(person.recording.time)
    count = max(1, round(share * n))
    first = int(rng.integers(n - count + 1))
    rows = slice(first, first + count)
    recording = exchanged(person.recording, a, b, rows)
    skeleton: Skeleton | None = person.skeleton
    start = time.process_time()
    found: list[Finding] = []
    if share == 1.0:
        static = exchanged(person.static, a, b, rows=slice(None))
        judged = static_judgment(person, static, repair=name)
        if not name and not judged.findings:
            judged = static_judgment(person, static, repair=True)
        found, skeleton = judged.findings, judged.skeleton
    told = [f for f in found if f.severity != "note"]
    if skeleton is not None and not refused(found) and (name or not told):
        found = [*found, *check_recordings([recording], skeleton=skeleton).findings]
    spent = time.process_time() - start
    told = [f for f in found if f.severity != "note"]
    return {
        "pair": (a, b),
        "person": person.name,
        "told": bool(told),
        "named": any({a, b} <= set(f.markers) for f in told if f.kind == "exchanged"),
        "refused": bool(refused(found)),
        "turned_deg": _turned(person, skeleton, recording, rows),
        "seconds": spent,
    }


def static_judgment(
    person: Person, static: Recording, *, repair: bool
) -> StaticJudgment:
    """Judge a static trial, however short."""
    return judge_static(
        Skeleton.load(),
        static,
        marker_set=person.marker_set,
        min_duration=0.1,
        repair=repair,
    )


def _turned(
    person: Person, skeleton: Skeleton | None, recording: Recording, rows: slice
) -> float:
    """How far the worst joint turns, deg; NaN where there is no body to fit."""
    if skeleton is None:
        return float("nan")
    # As solved, before tracking itself leaves out frames that do not fit.
    q = MarkerIK(skeleton).track(recording).q[:, -person.angles.shape[1] :]
    off = np.abs(q - person.angles)[rows]
    seen = np.isfinite(off).any(axis=0)
    if not seen.any():  # the clean recording does not show these frames either
        return 0.0
    return float(np.degrees(np.nanmedian(off[:, seen], axis=0).max()))


def judge_all(
    people: list[Person], mode: str, options: argparse.Namespace
) -> dict | None:
    """Judge all pairs of a set, or as many as were asked for, in random order.

    Each pair of one of the people, drawn by the seed.
    """
    rng = np.random.default_rng([options.seed, list(MODES).index(mode)])
    own = [set(pairs_of(person)) for person in people]
    pairs = sorted(set.union(*own))
    wanted = 1 if options.quick else options.pairs or len(pairs)
    cases: list[dict] = []
    started = time.process_time()
    for k in rng.permutation(len(pairs))[:wanted].tolist():
        if time.process_time() - started > options.cpu:
            break
        fitting = [i for i in range(len(people)) if pairs[k] in own[i]]
        drawn = people[fitting[int(rng.integers(len(fitting)))]]
        cases.append(judge(drawn, *pairs[k], MODES[mode], rng, name=options.named))
        if options.progress and len(cases) % 50 == 0:
            so_far = _summary(people, mode, cases, of=len(pairs))
            sys.stderr.write(json.dumps(so_far) + "\n")
    if not cases:
        return None
    summary = _summary(people, mode, cases, of=len(pairs))
    return summary | {"named_known": options.named}


def false_alarms(folder: Path, people: list[str], *, quick: bool) -> list[dict]:
    """Check all clean recordings of each person, a row a person."""
    rows = []
    for name in people:
        files = sorted((folder / name).glob(f"{name}*[0-9].csv"))[
            : 4 if quick else None
        ]
        recordings = [read(path) for path in files]
        static = read(folder / name / f"{name}_static.csv")
        start = time.process_time()
        found = check_recordings(
            recordings, static=static, marker_set="ue_adl", min_static=0.1
        )
        alone = check_recordings(recordings, marker_set="ue_adl")
        rows.append(
            {
                "person": name,
                "recordings": len(recordings),
                "frames": sum(len(one.time) for one in recordings),
                "alarms": [
                    finding.sentence
                    for finding in (*found.findings, *alone.findings)
                    if finding.severity != "note"
                ],
                "seconds": time.process_time() - start,
            }
        )
    return rows


def speed(person: Person, *, count: int, seconds: float) -> float:
    """CPU time for recordings of this length with a known body, s."""
    one = person.recording
    frames = round(seconds * one.rate)
    # There and back again, so that nothing jumps.
    there = np.concatenate([one.markers, one.markers[::-1]])
    markers = np.tile(there, (-(-frames // len(there)), 1, 1))[:frames]
    markers = markers + np.random.default_rng(0).normal(0, 2e-4, markers.shape)
    long = Recording(np.arange(frames) / one.rate, markers, one.labels, "long")
    start = time.process_time()
    check_recordings([long] * count, skeleton=person.skeleton)
    return time.process_time() - start


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=BESIDE)
    parser.add_argument("--pairs", type=int, help="random pairs a set; default: all")
    parser.add_argument(
        "--named",
        action="store_true",
        help="ask which pair a wrong static trial has (six times slower)",
    )
    parser.add_argument("--set", choices=["oxford24", "ue_adl"], help="only this set")
    parser.add_argument("--mode", choices=list(MODES), help="only this one")
    parser.add_argument("--person", nargs="+", help="of ue_adl; default: all")
    parser.add_argument("--task", default="CR1")
    parser.add_argument("--seconds", type=float, default=3.0, help="of each recording")
    parser.add_argument(
        "--cpu", type=float, default=np.inf, help="seconds a row; stops there"
    )
    parser.add_argument("--progress", action="store_true", help="on stderr")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--quick", action="store_true", help="few pairs, few recordings"
    )
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    folder = options.data / "ue_adl"
    names = sorted(path.name for path in folder.glob("ADL*"))
    sets: list[list[Person]] = []
    if options.set != "ue_adl":
        sets.append([simulated(options.seed)])
    if options.set != "oxford24" and names:
        chosen = names[-1:] if options.quick else options.person or names
        task, seconds = options.task, options.seconds
        sets.append([real(folder, name, task, seconds) for name in chosen])
    result: dict = {"exchanges": [], "clean": [], "twenty_of_60_s": {}}
    for people in sets:
        for mode in MODES:
            if options.mode in (None, mode) and (
                row := judge_all(people, mode, options)
            ):
                result["exchanges"].append(row)
                if not options.json:
                    _print_row(row, first=len(result["exchanges"]) == 1)
        if options.mode is None:
            result["twenty_of_60_s"][people[0].marker_set] = speed(
                people[0], count=2 if options.quick else 20, seconds=60.0
            ) * (10 if options.quick else 1)
    if options.mode is None:
        result["clean"] = false_alarms(
            folder, names[: 1 if options.quick else None], quick=options.quick
        )
    if options.json:
        print(json.dumps(result))
        return
    _print(result)
    if not folder.is_dir():
        print(f"\nNo real recordings in {folder}: only simulated ones were judged.")


def _summary(people: list[Person], mode: str, cases: list[dict], of: int) -> dict:
    # Without a body there is nothing to turn: it counts, and is told.
    wrong = [c for c in cases if not c["turned_deg"] <= np.degrees(WRONG)]
    names = {c["person"] for c in cases}
    return {
        "people": people[0].name if len(people) == 1 else f"{len(names)} people",
        "marker_set": people[0].marker_set,
        "mode": mode,
        "pairs": len(cases),
        "of": of,
        "wrong": len(wrong),
        "told": sum(c["told"] for c in wrong),
        "named": sum(c["named"] for c in wrong),
        "refused": sum(c["refused"] for c in wrong),
        "silent": [
            [*c["pair"], c["person"], round(c["turned_deg"])]
            for c in wrong
            if not c["told"]
        ],
        "seconds": float(np.mean([c["seconds"] for c in cases])),
    }


def _print_row(row: dict, *, first: bool) -> None:
    if first:
        print(f"numpy {np.__version__}, Python {platform.python_version()}\n")
        print(
            "| set | person | exchanged | pairs | turn a joint > 10 deg | told | of "
            "these the pair named | CPU s each |"
        )
        print("|---|---|---|---|---|---|---|---|")
    share = row["told"] / row["wrong"] if row["wrong"] else 1.0
    asked = row["named_known"] or row["mode"] != "everywhere"
    print(
        f"| {row['marker_set']} | {row['people']} | {row['mode']} | {row['pairs']} of "
        f"{row['of']} | {row['wrong']} | {row['told']} ({share:.1%}) "
        f"| {row['named'] if asked else 'not asked'} | {row['seconds']:.2f} |",
        flush=True,
    )


def _print(result: dict) -> None:
    for row in result["exchanges"]:
        for a, b, person, turned in row["silent"]:
            print(
                f"not told: {row['marker_set']} {row['mode']}: {a} {b} of {person}, "
                f"{turned} deg"
            )
    alarms = sum(len(row["alarms"]) for row in result["clean"])
    files = sum(row["recordings"] for row in result["clean"])
    print(f"\nFalse alarms on {files} clean real recordings: {alarms}")
    for row in result["clean"]:
        for alarm in row["alarms"]:
            print(f"- {alarm}")
    for name, seconds in result["twenty_of_60_s"].items():
        print(f"\nTwenty recordings of 60 s, {name}: {seconds:.1f} s of CPU")


if __name__ == "__main__":
    main()
