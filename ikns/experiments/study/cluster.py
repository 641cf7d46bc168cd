"""Runs tasks on a Dask cluster, whose workers may come, go and be killed.

The scheduler gives the tasks of a worker that disappears to another one. A task depends
on nothing but itself, so its result has the same bits wherever and however often it is
computed, and only the process that runs the study writes files.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from itertools import islice
from typing import Any, TypeVar

from ikns.errors import InvalidInput, StreamError
from ikns.experiments.study.single_thread import RESUMES, single_threaded
from ikns.experiments.study.versions import check_versions, library_versions

T = TypeVar("T")
R = TypeVar("R")

#: A scheduler must answer within this time, s.
_CONNECT_TIMEOUT = 10.0
#: How often the number of workers is looked up, s.
_POLL_INTERVAL = 1.0
#: Tasks at the cluster: so many per worker, and at least so many in all, by which a
#: cluster that adapts to its load sees that more workers are of use.
_PER_WORKER, _AT_LEAST = 2, 32
#: A worker with several threads does one task at a time: most of it is Python, which
#: threads cannot do in parallel, and what libraries keep in memory is not made for it.
_ONE_AT_A_TIME = threading.Lock()


def compute_on_cluster(
    work: Callable[[T], R],
    tasks: Iterable[T],
    scheduler: str,
    *,
    worker_timeout: float,
    on_workers: Callable[[int], None],
) -> Iterator[R]:
    """Yield results as they finish; see :func:`ikns.experiments.study.workers.compute`.

    Raises
    ------
    InvalidInput
        Without Dask here, or when a worker has other versions of the libraries.
    StreamError
        When the scheduler does not answer, has no worker for too long, or gives up a
        task that several workers did not survive.
    """
    try:
        from distributed import Client, KilledWorker, wait
    except ImportError:
        raise InvalidInput(
            "a cluster is reached with Dask, found none; install it with "
            "pip install 'ikns[cluster]'."
        ) from None
    try:
        client = Client(scheduler, timeout=_CONNECT_TIMEOUT)
    except (OSError, ValueError) as error:
        raise StreamError(
            f"{scheduler}: no Dask scheduler answers ({_first_line(error)})."
        ) from None
    versions = library_versions()
    waiting, running = iter(tasks), set[Any]()
    workers = _Workers(client, scheduler, worker_timeout, on_workers)
    with client:
        try:
            while True:
                room = max(_PER_WORKER * workers.number(), _AT_LEAST) - len(running)
                for task in islice(waiting, max(room, 0)):
                    running.add(
                        client.submit(_on_worker, work, task, versions, pure=False)
                    )
                if not running:
                    return
                try:
                    done = wait(
                        list(running),
                        timeout=_POLL_INTERVAL,
                        return_when="FIRST_COMPLETED",
                    ).done
                except TimeoutError:
                    continue
                for future in done:
                    running.remove(future)
                    result = future.result()
                    future.release()
                    yield result
        except StreamError:  # which is an OSError
            raise
        except KilledWorker as error:
            dead = getattr(error, "allowed_failures", 3) + 1
            raise StreamError(
                f"{scheduler}: {dead} workers died with the same task, perhaps out of "
                f"memory; {RESUMES}."
            ) from None
        except (CancelledError, OSError) as error:
            raise StreamError(
                f"{scheduler}: the Dask cluster failed ({_first_line(error)}); "
                f"{RESUMES}."
            ) from None


class _Workers:
    """Counts the workers of a scheduler now and then."""

    def __init__(
        self,
        client: Any,
        scheduler: str,
        timeout: float,
        on_change: Callable[[int], None],
    ) -> None:
        self._client, self._scheduler, self._timeout = client, scheduler, timeout
        self._on_change, self._n = on_change, -1
        self._looked, self._seen = float("-inf"), time.monotonic()

    def number(self) -> int:
        """Return their number, at most so old as they are looked up again.

        Raises
        ------
        StreamError
            When there was none for too long.
        """
        now = time.monotonic()
        if now - self._looked < _POLL_INTERVAL:
            return self._n
        found = len(self._client.nthreads())
        if found != self._n:
            self._on_change(found)
        self._n = found
        self._looked = now
        if found:
            self._seen = now
        elif now - self._seen >= self._timeout:
            raise StreamError(
                f"{self._scheduler}: the Dask scheduler had no workers for "
                f"{self._timeout:g} s; {RESUMES}."
            )
        return found


def _on_worker(work: Callable[[T], R], task: T, versions: dict[str, str]) -> R:
    """Run a task on a worker, if that would give the bits that it gives elsewhere."""
    check_versions(versions)
    with _ONE_AT_A_TIME:
        return single_threaded(work, task)


def _first_line(error: BaseException) -> str:
    return (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
