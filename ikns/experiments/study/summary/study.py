"""A study folder, or one visit, from its files to tables and statistics."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ikns.errors import FileError
from ikns.experiments.study import check_declaration, read_study
from ikns.experiments.study.declaration import FILE
from ikns.experiments.study.summary.accumulate import Gathered
from ikns.experiments.study.summary.digest import Digest, LeftOut, digest_visit
from ikns.experiments.study.summary.picking import PickingSummary, summarize_picking
from ikns.experiments.study.summary.tracking import TrackingSummary, summarize_tracking
from ikns.experiments.visits import list_visits

__all__ = ["Group", "StudySummary", "summarize"]

#: With fewer visits, starting more processes takes longer than it spares.
_FEW = 40


@dataclass(frozen=True, eq=False)
class Group:
    """People, or simulated participants: never both.

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
    """Everything that a report says.

    Parameters
    ----------
    folder : Path
    name : str
    plan : dict
        As :meth:`ikns.experiments.study.Study.declared` tells it; empty where there is
        no study file.
    groups : tuple of Group
        People first.
    left_out : tuple of LeftOut
        Visits that could not be used, and why.
    visits : int
        That were used.
    """

    folder: Path
    name: str
    plan: dict[str, Any]
    groups: tuple[Group, ...]
    left_out: tuple[LeftOut, ...]
    visits: int


def summarize(
    folder: str | Path,
    *,
    workers: int | None = None,
    progress: Callable[[str, int, int], None] = lambda step, done, total: None,
) -> StudySummary:
    """Compute everything again from the attempts on disk, visit by visit.

    Parameters
    ----------
    folder : str or Path
        A study, or a single visit.
    workers : int, optional
        Processes that read visits, -1: one a core; by default one for few visits, else
        one a core. The result does not depend on it.
    progress : callable
        Told (step, done, total).

    Raises
    ------
    FileError
        When there is no visit, or none that can be read.
    InvalidInput
        When the study file is faulty, or was changed after the first result.
    """
    top = Path(folder)
    single = (top / "visit.json").is_file()
    paths = [top] if single else list_visits(top)
    plan = {} if single else _plan(top)
    if not paths:
        raise FileError(
            f"{top}: expected a study with visits, or a visit, found none; "
            "`ikns study run` simulates them, `ikns track` and `ikns pick` make them."
        )
    groups: dict[tuple[bool, str], Gathered] = {}
    left_out: list[LeftOut] = []
    used = 0
    for done, digest in enumerate(_digests(paths, workers), start=1):
        progress("reading visits", done, len(paths))
        if isinstance(digest, LeftOut):
            left_out.append(digest)
            continue
        simulated = bool(digest.about["simulated"])
        kind = (simulated, digest.experiment)
        if kind not in groups:
            groups[kind] = Gathered(digest.experiment, simulated=simulated)
        fault = groups[kind].add(digest)
        if fault:
            left_out.append(LeftOut(digest.folder, f"{digest.folder}: {fault}."))
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
    groups: dict[tuple[bool, str], Gathered], simulated: bool, plan: dict[str, Any]
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


def _digests(paths: list[Path], workers: int | None) -> Iterable[Digest | LeftOut]:
    """In the order of the paths, a few at a time, whatever their number."""
    if workers == 1 or (workers is None and len(paths) < _FEW):
        return map(digest_visit, paths)
    from joblib import Parallel, delayed

    done: Iterable[Digest | LeftOut] = Parallel(
        n_jobs=workers or -1, return_as="generator"
    )(delayed(digest_visit)(path) for path in paths)
    return done


def _plan(folder: Path) -> dict[str, Any]:
    """Read what was declared, the same as when the first result was there."""
    if not (folder / FILE).exists():
        return {}
    study = read_study(folder)
    check_declaration(folder, study)
    return study.declared()
