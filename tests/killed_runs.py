"""Kill a run (SIGKILL) at every operation on its files, and in the middle of writing.

Run as a program: a process without threads can fork. It prints how often it killed.
"""

import os
import resource
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cheap_study import cheap_visits, contents, write_study

from ikns.experiments.study import run
from ikns.experiments.visits import list_visits, read_visit

#: What Python reports before it touches files.
_TOUCH = {"open", "os.link", "os.mkdir", "os.remove", "os.rename", "os.rmdir"}


def killed(study: Path, prepare: Callable[[], None]) -> bool:
    """Run the study in a child process; say whether it was killed."""
    child = os.fork()
    if not child:
        try:
            prepare()
            run.run_study(study, n_jobs=1)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert status <= 0, f"the run failed with {status}"
    return status < 0


def kill_at(operation: int, study: Path) -> Callable[[], None]:
    def prepare() -> None:
        count = 0

        def hook(event: str, touched: tuple[Any, ...]) -> None:
            nonlocal count
            if event in _TOUCH and str(study / "visits") in str(touched[0]):
                count += 1
                if count == operation:
                    os.kill(os.getpid(), signal.SIGKILL)

        sys.addaudithook(hook)

    return prepare


def kill_at_byte(size: int) -> Callable[[], None]:
    """The system kills it when a file gets longer: so many bytes are written."""

    def prepare() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return prepare


def check(study: Path, whole: dict[str, bytes]) -> None:
    """What is there to be read is whole; the next run completes it and tidies up."""
    for visit in list_visits(study):
        assert len(read_visit(visit).attempts) == 1
        for path in filter(Path.is_file, visit.rglob("*")):
            name = path.relative_to(study / "visits").as_posix()
            assert path.read_bytes() == whole[name], name
    run.run_study(study, n_jobs=1)
    assert contents(study) == whole


def main() -> None:
    top = Path(sys.argv[1])
    run.simulate = cheap_visits  # type: ignore[assignment]
    run.compiled_before = lambda: True  # no kernel is needed
    one = {"participants": 1}
    reference = write_study(top / "reference", cohort=one)
    run.run_study(reference, n_jobs=1)
    whole = contents(reference)
    operations = 0
    while True:
        study = write_study(top / f"operation-{operations}", cohort=one)
        if not killed(study, kill_at(operations + 1, study)):
            break
        check(study, whole)
        operations += 1
    cut = 0
    sizes = {len(content) // 2 for content in whole.values()}
    for size in sorted({1, *sizes}):
        study = write_study(top / f"bytes-{size}", cohort=one)
        if killed(study, kill_at_byte(size)):
            check(study, whole)
            cut += 1
    sys.stdout.write(f"{operations} {cut}\n")


if __name__ == "__main__":
    main()
