"""A task in a worker, with one thread for linear algebra."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

T = TypeVar("T")
R = TypeVar("R")

#: What a sentence about a failure ends with.
RESUMES = "finished visits are kept, and the same command continues from there"


def single_threaded(work: Callable[[T], R], task: T) -> R:
    """Run a task in a worker; the thread limit may stay, as the worker is ours."""
    threadpool_limits(limits=1)
    return work(task)
