"""What ``ikns ucm`` finds in each design: numbers, a table, and what to draw."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import ikns
from ikns.cli.output import table
from ikns.errors import naming

if TYPE_CHECKING:
    from ikns.analysis.ucm import SplitAnalysis

#: Which normalized times the table shows, %; JSON has all.
_SHOWN = range(0, 101, 10)


@dataclass(frozen=True)
class Found:
    """What a design found.

    Parameters
    ----------
    result : dict
        For JSON.
    shown : list
        Tables and sentences.
    drawn : dict
        Arguments of the figure.
    """

    result: dict[str, Any]
    shown: list[Any]
    drawn: dict[str, Any]


def over_time(
    subject: ikns.Subject,
    motions: list[ikns.Motion],
    sources: list[str],
    *,
    task: Literal["position", "pose"],
    speed: float,
    surrogates: int,
    seed: int,
    most_different: float,
) -> Found:
    """Split the variance over repetitions, at each normalized time."""
    import numpy as np

    from ikns.analysis.ucm import analyze_trials

    chain = subject.chain
    found = analyze_trials(
        subject.skeleton,
        motions,
        chain=chain,
        task=task,
        threshold=speed,
        n_surrogates=surrogates,
        seed=seed,
        names=sources,
        most_different=most_different,
    )
    analysis, overall = found.over_time, found.overall
    split, test = analysis.split, analysis.surrogates
    percent = np.linspace(0, 100, len(split.v_ucm))
    rows = [
        {"time_percent": float(at)} | row
        for at, row in zip(percent, _rows(analysis), strict=True)
    ]
    lost = int(split.rank_lost.sum())
    warned = [
        f"the Jacobian has less than rank {split.n_task} at {lost} of "
        f"{len(percent)} normalized times; there is no split there."
    ]
    result = {
        "design": "across trials",
        "trials": len(motions),
        "movement_s": found.durations.tolist(),
        "overall": {
            "delta_vz": overall.estimate,
            "delta_vz_interval": [overall.low, overall.high],
            "delta_vz_no_structure": split.no_structure,
            "surrogates_mean": np.nanmean(test.mean),
            "p": test.p_overall,
        },
        "over_time": rows,
        "warnings": warned if lost else [],
    }
    title = f"{len(motions)} trials of {chain}, hand {task}, normalized time"
    shown = [
        _table(title, "time %", "time_percent", ".0f", [rows[i] for i in _SHOWN]),
        f"dVz over the whole movement {overall.estimate:.2f} "
        f"({overall.low:.2f} to {overall.high:.2f}; {split.no_structure:.2f} is no "
        f"structure), with joints shuffled {np.nanmean(test.mean):.2f}, "
        f"p = {test.p_overall:.3g}",
    ]
    return Found(result, shown, {"at": percent} | _drawn(analysis))


def over_points(
    subject: ikns.Subject,
    motions: list[ikns.Motion],
    sources: list[str],
    *,
    task: Literal["position", "pose"],
    speed: float,
    surrogates: int,
    seed: int,
) -> Found:
    """Split the variance over the still samples at each PCA point."""
    import numpy as np

    from ikns.analysis.ucm import analyze_points

    (motion,), (source,) = motions, sources
    with naming(source):
        found = analyze_points(
            subject.skeleton,
            motion,
            subject.null_space_map,
            chain=subject.chain,
            task=task,
            max_hand_speed=speed,
            n_surrogates=surrogates,
            seed=seed,
        )
    rows: list[dict[str, Any]] = [
        {"point": k + 1, "samples": int(count)} for k, count in enumerate(found.counts)
    ]
    for k, analysis in found.points.items():
        rows[k] |= _rows(analysis)[0]
    warned = [
        "samples with a still hand are chosen by the task, which by itself makes V_ORT "
        "small; compare people, points and tasks, not with zero."
    ]
    result = {"design": "within a trial", "points": rows, "warnings": warned}
    title = f"{source}: still samples of {subject.chain} at each PCA point, hand {task}"
    points = [{"at": k + 1} | _drawn(each) for k, each in found.points.items()]
    drawn: dict[str, Any] = {
        key: np.stack([one[key] for one in points], axis=-1)
        for key in points[0]
        if key != "no_structure"
    }
    drawn |= {"no_structure": points[0]["no_structure"], "over": "points"}
    shown = [_table(title, "point", "point", "d", rows)]
    return Found(result, shown, drawn)


def _rows(analysis: SplitAnalysis) -> list[dict[str, Any]]:
    import numpy as np

    split, interval, test = analysis.split, analysis.interval, analysis.surrogates
    columns = {
        "samples": split.trials,
        "rank": split.rank,
        "v_ucm_rad2": split.v_ucm,
        "v_ort_rad2": split.v_ort,
        "v_tot_rad2": split.v_tot,
        "delta_v": split.delta_v,
        "delta_vz": split.delta_vz,
        "delta_vz_corrected": split.delta_vz_corrected,
        "delta_vz_low": interval.low,
        "delta_vz_high": interval.high,
        "surrogates_mean": test.mean,
        "p": test.p,
    }
    arrays = [np.atleast_1d(column).tolist() for column in columns.values()]
    return [dict(zip(columns, row, strict=True)) for row in zip(*arrays, strict=True)]


def _drawn(analysis: SplitAnalysis) -> dict[str, Any]:
    import numpy as np

    split, interval = analysis.split, analysis.interval
    return {
        "v_ucm": split.v_ucm,
        "v_ort": split.v_ort,
        "delta_vz": split.delta_vz,
        "interval": np.stack([interval.low, interval.high]),
        "surrogates": analysis.surrogates.band(),
        "no_structure": split.no_structure,
    }


def _table(
    title: str, first: str, key: str, form: str, rows: list[dict[str, Any]]
) -> Any:
    square_degrees = math.degrees(math.degrees(1.0))
    scales = {
        "v_ucm_rad2": square_degrees,
        "v_ort_rad2": square_degrees,
        "delta_v": 1.0,
        "delta_vz": 1.0,
        "delta_vz_low": 1.0,
        "delta_vz_high": 1.0,
        "surrogates_mean": 1.0,
        "p": 1.0,
    }
    return table(
        title,
        {
            first: form,
            "n": "d",
            "V_UCM\ndeg2": ".2f",
            "V_ORT\ndeg2": ".2f",
            "dV": ".2f",
            "dVz": ".2f",
            "95 %\nfrom": ".2f",
            "\nto": ".2f",
            "dVz,\nshuffled": ".2f",
            "p": ".3f",
        },
        [
            [row[key], row["samples"]]
            + [scale * row.get(name, math.nan) for name, scale in scales.items()]
            for row in rows
        ],
    )
