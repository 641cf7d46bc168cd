"""A Dask cluster whose workers are killed: the same bits, or one sentence."""

import logging
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import tomli_w
from distributed import LocalCluster

from ikns.errors import InvalidInput, StreamError
from ikns.experiments.study import cluster, run_study, versions, workers
from ikns.experiments.visits import list_visits

#: One quick trial in each condition.
STUDY = {
    "study": {"name": "quick", "seed": 5},
    "cohort": {"participants": 2},
    "tracking": {
        "profiles": ["T1"],
        "repeats": 1,
        "training": 2,
        "seconds": 15,
        "align": 2.0,
    },
    "parameters": {"rate": 50, "point_seconds": 2},
}


@contextmanager
def dask(n: int, *, threads: int = 1) -> Iterator[Any]:
    """Run a cluster here; its workers complain of the scheduler's leaving."""
    with LocalCluster(
        n_workers=n,
        threads_per_worker=threads,
        dashboard_address=":0",
        silence_logs=logging.CRITICAL,
    ) as made:
        yield made


class Deadly(NamedTuple):
    """A task whose worker is killed at an instant, once."""

    number: int
    instant: str
    folder: Path

    def kill(self, instant: str) -> None:
        mark = self.folder / f"{self.number}-{instant}"
        if self.instant == instant and not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)


class Result:
    """A result whose worker may be killed while it sends it."""

    def __init__(self, task: Deadly, value: float) -> None:
        self.task, self.value = task, value

    def __reduce__(self) -> tuple[Any, ...]:
        self.task.kill("sending")
        return Result, (self.task, self.value)


def deadly(task: Deadly) -> Result:
    task.kill("begin")
    value = sum(1.0 / k for k in range(1, 1000 + task.number))
    task.kill("end")
    return Result(task, value)


def inside(task: int) -> tuple[int, bool]:
    """Whether no other thread of this process does a task meanwhile."""
    alone = _BUSY.acquire(blocking=False)
    threading.Event().wait(0.01)
    if alone:
        _BUSY.release()
    return task, alone


_BUSY = threading.Lock()


async def _nobody() -> None: ...


def test_two_workers_of_which_one_is_killed_make_the_bits_of_one_process(
    tmp_path: Path,
) -> None:
    studies = [tmp_path / "one", tmp_path / "dask"]
    for study in studies:
        study.mkdir()
        (study / "study.toml").write_text(tomli_w.dumps(STUDY))
    run_study(studies[0], n_jobs=1)
    killed: list[int] = []
    with dask(2) as made:

        def kill() -> None:
            """Kill the first worker that is seen to compute, which takes it seconds."""
            while not killed:
                for state in list(made.scheduler.workers.values()):
                    if state.processing and not killed:
                        killed.append(made.workers[state.name].pid)
                        os.kill(killed[0], signal.SIGKILL)
                time.sleep(0.01)

        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        run_study(studies[1], scheduler=made.scheduler_address)
        killer.join(10.0)
    assert killed
    one, other = (
        {
            p.relative_to(s).as_posix(): p.read_bytes()
            for p in s.rglob("*.*")
            if p.is_file()
        }
        for s in studies
    )
    assert one == other
    assert len(list_visits(studies[1])) == 2


def test_a_worker_killed_at_any_instant_is_replaced_and_the_last_one_is_missed(
    tmp_path: Path,
) -> None:
    instants = ["begin", "end", "sending", ""]
    tasks = [Deadly(k, instant, tmp_path) for k, instant in enumerate(instants)]
    seen: list[int] = []
    with dask(1, threads=2) as made:
        found = workers.compute(
            deadly, tasks, scheduler=made.scheduler_address, on_workers=seen.append
        )
        values = {result.task.number: result.value for result in found}
        assert {path.name for path in tmp_path.iterdir()} == {
            "0-begin",
            "1-end",
            "2-sending",
        }
        again = workers.compute(inside, range(8), scheduler=made.scheduler_address)
        assert sorted(again) == [(k, True) for k in range(8)]
        (last,) = made.workers.values()
        last.instantiate = _nobody  # its nanny starts no other one
        os.kill(last.pid, signal.SIGKILL)
        lost = workers.compute(
            abs, [1], scheduler=made.scheduler_address, worker_timeout=0.5
        )
        with pytest.raises(
            StreamError,
            match=r"^tcp://\S+: the Dask scheduler had no workers for 0.5 s; finished",
        ):
            list(lost)
    direct = workers.compute(deadly, tasks, n_jobs=1)  # they were killed once
    assert values == {result.task.number: result.value for result in direct}
    assert seen[0] == 1


def test_a_worker_with_other_libraries_is_refused() -> None:
    here = versions.library_versions()
    assert cluster._on_worker(abs, -1, here) == 1
    with pytest.raises(InvalidInput, match=r"has numpy \d.*, expected 1.0 as here"):
        cluster._on_worker(abs, -1, here | {"numpy": "1.0"})


def test_a_scheduler_that_is_not_there_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "_CONNECT_TIMEOUT", 0.2)
    (tmp_path / "study.toml").write_text(tomli_w.dumps(STUDY))
    with pytest.raises(StreamError, match="tcp://127.0.0.1:9: no Dask scheduler"):
        run_study(tmp_path, scheduler="tcp://127.0.0.1:9")
    with pytest.raises(StreamError, match="no Dask scheduler answers"):
        run_study(tmp_path, scheduler="nonsense://1")
    assert list_visits(tmp_path) == []
