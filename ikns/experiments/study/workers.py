"""Where cells are computed: in this process, on all cores, or on a Dask cluster.

Workers compute and hand back; only the process that runs the study writes. So workers
need no common disk, and what happens to them leaves no trace.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError
from itertools import islice
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from ikns.errors import InvalidInput, StreamError

__all__ = ["compute", "processes"]

T = TypeVar("T")
R = TypeVar("R")

#: How long a scheduler may take to answer, s.
_PATIENCE = 10.0
#: How often a worker looks whether the run goes on, s.
_LOOK = 0.5
_GOES_ON = "what was finished is kept, and the same command goes on from there"


def compute(
    work: Callable[[T], R],
    tasks: Iterable[T],
    *,
    n_jobs: int = -1,
    scheduler: str | None = None,
) -> Iterator[R]:
    """Yield results as they come, in any order; tasks are taken as workers get free.

    Linear algebra uses one thread a worker, so that sums are added up in one order.

    Parameters
    ----------
    work : callable
    tasks : iterable
        Taken lazily: two for each worker at a time.
    n_jobs : int
        Processes; as in joblib, -1 is one for each core. 1 is this process.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``; instead of
        processes here.

    Raises
    ------
    InvalidInput
        With no workers, or without Dask.
    StreamError
        When the scheduler does not answer, or a worker dies.
    """
    if scheduler is not None:
        return _on_dask(work, tasks, scheduler)
    n = processes(n_jobs)
    return _here(work, tasks) if n == 1 else _on_cores(work, tasks, n)


def processes(n_jobs: int) -> int:
    """Return how many processes are meant; as in joblib, -1 is one for each core.

    Raises
    ------
    InvalidInput
        When that is none.
    """
    n = (os.cpu_count() or 1) + 1 + n_jobs if n_jobs < 0 else n_jobs
    if n < 1:
        raise InvalidInput(f"expected at least one process, found {n_jobs}.")
    return n


def _here(work: Callable[[T], R], tasks: Iterable[T]) -> Iterator[R]:
    for task in tasks:
        with threadpool_limits(limits=1):
            result = work(task)
        yield result


def _on_cores(work: Callable[[T], R], tasks: Iterable[T], n: int) -> Iterator[R]:
    from joblib import Parallel, delayed, parallel_config
    from joblib.externals.loky import get_reusable_executor

    begin = {"initializer": _leave_with, "initargs": (os.getpid(),)}
    try:
        with parallel_config("loky", n_jobs=n, inner_max_num_threads=1, **begin):
            yield from Parallel(return_as="generator_unordered", batch_size=1)(
                delayed(_alone)(work, task) for task in tasks
            )
    except BrokenExecutor:
        raise StreamError(
            f"a worker process died, perhaps for want of memory; {_GOES_ON}."
        ) from None
    finally:
        get_reusable_executor().shutdown(wait=True, kill_workers=True)


def _on_dask(work: Callable[[T], R], tasks: Iterable[T], scheduler: str) -> Iterator[R]:
    try:
        from distributed import Client, KilledWorker, as_completed
    except ImportError:
        raise InvalidInput(
            "a cluster is reached with Dask, found none; install it with "
            "pip install 'ikns[cluster]'."
        ) from None
    try:
        client = Client(scheduler, timeout=_PATIENCE)
    except (OSError, ValueError) as error:
        raise StreamError(
            f"{scheduler}: no Dask scheduler answers ({_first_line(error)})."
        ) from None
    with client:
        threads = sum(client.nthreads().values())
        if not threads:
            raise StreamError(f"{scheduler}: the Dask scheduler has no workers.")
        waiting = iter(tasks)

        def submit(task: T) -> Any:
            return client.submit(_alone, work, task, pure=False)

        running = as_completed([submit(t) for t in islice(waiting, 2 * threads)])
        for future in running:
            try:
                result = future.result()
            except (KilledWorker, CancelledError, OSError) as error:
                raise StreamError(
                    f"{scheduler}: the Dask cluster broke off ({_first_line(error)}); "
                    f"{_GOES_ON}."
                ) from None
            future.release()
            for task in islice(waiting, 1):
                running.add(submit(task))
            yield result


def _leave_with(parent: int) -> None:
    """Let this worker end when the process that started it does.

    Otherwise the workers of a killed run wait for work for minutes, or for ever where
    it was killed while it held their queue.
    """

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _alone(work: Callable[[T], R], task: T) -> R:
    """Do a task in a worker, which is ours: its threads need not be given back."""
    threadpool_limits(limits=1)
    return work(task)


def _first_line(error: Exception) -> str:
    return (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
