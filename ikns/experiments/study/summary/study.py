"""Summarizes a study folder, or one visit: tables and statistics."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ikns.errors import FileError
from ikns.experiments.study import check_declaration, read_study
from ikns.experiments.study.declaration import FILE
from ikns.experiments.study.summary.accumulate import VisitAccumulator
from ikns.experiments.study.summary.digest import Digest, ExcludedVisit, digest_visit
from ikns.experiments.study.summary.picking import PickingSummary, summarize_picking
from ikns.experiments.study.summary.tracking import TrackingSummary, summarize_tracking
from ikns.experiments.visits import empty_visits, list_visits

#: With fewer visits, several processes take longer to start than they save.
_MIN_PARALLEL = 40


@dataclass(frozen=True, eq=False)
class Group:
    """Summaries of people, or of simulated participants.

    Parameters
    ----------
    simulated : bool
    tracking : TrackingSummary or None
    picking : PickingSummary or None
    """

    simulated: bool
    tracking: TrackingSummary | None
    picking: PickingSummary | None


@dataclass(frozen=True, eq=False)
class StudySummary:
    """Content of a report.

    Parameters
    ----------
    folder : Path
    name : str
    plan : dict
        From :meth:`ikns.experiments.study.Study.declared`; empty without a study file.
    groups : tuple of Group
        People first.
    left_out : tuple of ExcludedVisit
        Visits that could not be used, with the reasons.
    visits : int
        Number of visits that were used.
    """

    folder: Path
    name: str
    plan: dict[str, Any]
    groups: tuple[Group, ...]
    left_out: tuple[ExcludedVisit, ...]
    visits: int


def summarize(
    folder: str | Path,
    *,
    workers: int | None = None,
    progress: Callable[[str, int, int], None] = lambda step, done, total: None,
) -> StudySummary:
    """Summarize a study, from the attempts on disk.

    Parameters
    ----------
    folder : str or Path
        A study, or a single visit.
    workers : int, optional
        Processes that read visits; -1 is one per core. Default: this process for few
        visits, else one per core. The result does not depend on it.
    progress : callable
        Called with (step, done, total).

    Raises
    ------
    FileError
        When there is no visit, or none that can be read.
    InvalidInput
        When the study file is invalid, or was changed after the first result.
    """
    top = Path(folder)
    single = (top / "visit.json").is_file()
    paths = [top] if single else list_visits(top)
    plan = {} if single else _plan(top)
    left_out = [] if single else _empty(top)
    if not paths and left_out:
        raise FileError(left_out[0].reason)
    if not paths:
        raise FileError(
            f"{top}: there are no visits in it; "
            "`ikns study run` simulates them, `ikns track` and `ikns pick` make them."
        )
    groups: dict[tuple[bool, str], VisitAccumulator] = {}
    used = 0
    for done, digest in enumerate(_digests(paths, workers), start=1):
        progress("reading visits", done, len(paths))
        if isinstance(digest, ExcludedVisit):
            left_out.append(digest)
            continue
        simulated = bool(digest.about["simulated"])
        kind = (simulated, digest.experiment)
        if kind not in groups:
            groups[kind] = VisitAccumulator(digest.experiment, simulated=simulated)
        fault = groups[kind].add(digest)
        if fault:
            left_out.append(ExcludedVisit(digest.folder, f"{digest.folder}: {fault}."))
        used += not fault
    if not used:
        more = f" (and {len(left_out) - 1} more)" if len(left_out) > 1 else ""
        raise FileError(f"{left_out[0].reason.rstrip('.')}{more}.")
    progress("testing", 0, 1)
    summary = StudySummary(
        top,
        str(plan.get("name") or top.resolve().name),
        plan,
        tuple(
            Group(simulated, *_summaries(groups, simulated, plan))
            for simulated in (False, True)
            if any(kind[0] == simulated for kind in groups)
        ),
        tuple(left_out),
        used,
    )
    progress("testing", 1, 1)
    return summary


def _summaries(
    groups: dict[tuple[bool, str], VisitAccumulator],
    simulated: bool,
    plan: dict[str, Any],
) -> tuple[TrackingSummary | None, PickingSummary | None]:
    tracking, picking = (groups.get((simulated, e)) for e in ("tracking", "picking"))
    return (
        None
        if tracking is None
        else summarize_tracking(tracking, plan.get("tracking") or {}),
        None
        if picking is None
        else summarize_picking(picking, plan.get("picking") or {}),
    )


def _digests(
    paths: list[Path], workers: int | None
) -> Iterable[Digest | ExcludedVisit]:
    """Yield digests in the order of the paths."""
    if workers == 1 or (workers is None and len(paths) < _MIN_PARALLEL):
        return map(digest_visit, paths)
    from joblib import Parallel, delayed

    done: Iterable[Digest | ExcludedVisit] = Parallel(
        n_jobs=workers or -1, return_as="generator"
    )(delayed(digest_visit)(path) for path in paths)
    return done


def _empty(folder: Path) -> list[ExcludedVisit]:
    """Name folders that are called like visits and hold none."""
    return [
        ExcludedVisit(path, f"{path}: this is no visit; visit.json is missing.")
        for path in empty_visits(folder)
    ]


def _plan(folder: Path) -> dict[str, Any]:
    """Read the declaration, and check that it agrees with the results."""
    if not (folder / FILE).exists():
        return {}
    study = read_study(folder)
    check_declaration(folder, study)
    return study.declared()
