"""Runs tasks in this process, in several processes, or on a Dask cluster.

Workers only compute and return results; the process that runs the study writes them. So
workers need no shared disk, and a failed worker leaves no files behind.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor
from typing import TypeVar

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from ikns.errors import InvalidInput, StreamError
from ikns.experiments.study.cluster import compute_on_cluster
from ikns.experiments.study.single_thread import RESUMES, single_threaded

T = TypeVar("T")
R = TypeVar("R")

#: How often a worker checks that the run is alive, s.
_POLL_INTERVAL = 0.5


def compute(
    work: Callable[[T], R],
    tasks: Iterable[T],
    *,
    n_jobs: int = -1,
    scheduler: str | None = None,
    worker_timeout: float = 60.0,
    on_workers: Callable[[int], None] = lambda n: None,
) -> Iterator[R]:
    """Yield results as they finish, in any order.

    Linear algebra uses one thread per worker, so that the order of sums is fixed.

    Parameters
    ----------
    work : callable
    tasks : iterable
        Taken lazily, two per worker at a time.
    n_jobs : int
        Processes; as in joblib, -1 is one per core. 1 is this process.
    scheduler : str, optional
        Address of a Dask scheduler to use instead, such as ``tcp://10.0.0.1:8786``.
    worker_timeout : float
        Longest time that the Dask scheduler may be without any worker, s.
    on_workers : callable
        Called with the number of workers, again when it changes.

    Raises
    ------
    InvalidInput
        Without workers, or without Dask.
    StreamError
        When the scheduler does not answer or has no workers, a process dies, or several
        workers do with one task.
    """
    if scheduler is not None:
        return compute_on_cluster(
            work,
            tasks,
            scheduler,
            worker_timeout=worker_timeout,
            on_workers=on_workers,
        )
    n = processes(n_jobs)
    on_workers(n)
    if n == 1:
        return _in_this_process(work, tasks)
    return _in_processes(work, tasks, n)


def processes(n_jobs: int) -> int:
    """Return the number of processes; as in joblib, -1 is one per core.

    Raises
    ------
    InvalidInput
        When it is below 1.
    """
    n = (os.cpu_count() or 1) + 1 + n_jobs if n_jobs < 0 else n_jobs
    if n < 1:
        raise InvalidInput(f"expected at least one process, found {n_jobs}.")
    return n


def _in_this_process(work: Callable[[T], R], tasks: Iterable[T]) -> Iterator[R]:
    for task in tasks:
        with threadpool_limits(limits=1):
            result = work(task)
        yield result


def _in_processes(work: Callable[[T], R], tasks: Iterable[T], n: int) -> Iterator[R]:
    from joblib import Parallel, delayed, parallel_config
    from joblib.externals.loky import get_reusable_executor

    begin = {"initializer": _exit_with_parent, "initargs": (os.getpid(),)}
    try:
        with parallel_config("loky", n_jobs=n, inner_max_num_threads=1, **begin):
            yield from Parallel(return_as="generator_unordered", batch_size=1)(
                delayed(single_threaded)(work, task) for task in tasks
            )
    except BrokenExecutor:
        raise StreamError(
            f"a worker process died, perhaps out of memory; {RESUMES}."
        ) from None
    finally:
        get_reusable_executor().shutdown(wait=True, kill_workers=True)


def _exit_with_parent(parent: int) -> None:
    """Let this worker exit when the process that started it does.

    Otherwise the workers of a killed run would wait for minutes, or forever if it was
    killed while it held the lock of their queue.
    """

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_POLL_INTERVAL)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
