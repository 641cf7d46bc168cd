"""One program at a time; who holds a lock is named, and the dead hold none."""

import errno
import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from ikns.errors import FileError, InvalidInput
from ikns.output import lock as module
from ikns.output.lock import hold_lock

COUNTS = """
import sys, time
from pathlib import Path
from ikns.errors import InvalidInput
from ikns.output.lock import hold_lock
count = Path("count")
sys.stdin.readline()  # all begin together
for _ in range(50):
    while True:
        try:
            with hold_lock(Path(".lock"), "to count"):
                count.write_text(str(int(count.read_text()) + 1))
            break
        except InvalidInput:
            time.sleep(0.001)
"""


def ended_process() -> int:
    with subprocess.Popen(["true"]) as process:
        pass
    return process.pid


def leave(path: Path, pid: int, host: str) -> None:
    path.write_text(json.dumps({"pid": pid, "host": host}))


def test_two_in_one_program_are_refused_too(tmp_path: Path) -> None:
    lock = tmp_path / ".lock"
    with hold_lock(lock, "to write"):
        with pytest.raises(InvalidInput, match=f"process {os.getpid()} on"):
            with hold_lock(lock, "to write"):
                pass
    assert list(tmp_path.iterdir()) == []


def test_no_two_processes_hold_a_lock(tmp_path: Path) -> None:
    (tmp_path / "count").write_text("0")
    running = [
        subprocess.Popen(
            [sys.executable, "-c", COUNTS], cwd=tmp_path, stdin=subprocess.PIPE
        )
        for _ in range(3)
    ]
    for process in running:
        assert process.stdin is not None
        process.stdin.write(b"\n")
        process.stdin.flush()
    for process in running:
        process.communicate(timeout=300)
        assert process.returncode == 0
    # Two at a time would have read the same number.
    assert (tmp_path / "count").read_text() == "150"
    assert [path.name for path in tmp_path.iterdir()] == ["count"]


def test_the_lock_of_a_dead_process_is_taken_over(tmp_path: Path) -> None:
    lock, said, pid = tmp_path / ".lock", [], ended_process()
    leave(lock, pid, socket.gethostname())
    with hold_lock(lock, "to write", on_takeover=said.append):
        assert json.loads(lock.read_text())["pid"] == os.getpid()
    assert said == [
        f"{tmp_path}: was still locked by process {pid}, which has ended; the lock was "
        "taken over."
    ]


def test_a_lock_of_another_computer_is_left_alone(tmp_path: Path) -> None:
    lock = tmp_path / ".lock"
    leave(lock, ended_process(), "elsewhere")
    with pytest.raises(InvalidInput, match=f"on elsewhere; .* remove {lock}"):
        with hold_lock(lock, "to write"):
            pass
    assert json.loads(lock.read_text())["host"] == "elsewhere"


@pytest.mark.parametrize("torn", ["", "{", "[]", '{"pid": "x"}', "\0\0\0"])
def test_a_lock_file_that_names_no_one_is_free(tmp_path: Path, torn: str) -> None:
    (tmp_path / ".lock").write_text(torn)
    with hold_lock(tmp_path / ".lock", "to write"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_without_locks_of_the_system_the_name_decides(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object) -> None:
        raise OSError(errno.ENOLCK, "no locks on this file system")

    monkeypatch.setattr(module.fcntl, "flock", none)
    lock, said = tmp_path / ".lock", []
    leave(lock, os.getppid(), socket.gethostname())
    with pytest.raises(InvalidInput, match=f"process {os.getppid()} on"):
        with hold_lock(lock, "to write"):
            pass
    leave(lock, ended_process(), socket.gethostname())
    with hold_lock(lock, "to write", on_takeover=said.append):
        pass
    assert len(said) == 1


def test_a_folder_that_is_missing_or_full_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(FileError, match="cannot be written: no such file"):
        with hold_lock(tmp_path / "none" / ".lock", "to write"):
            pass

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(module.os, "pwrite", full)
    with pytest.raises(FileError, match="cannot be written: no space"):
        with hold_lock(tmp_path / ".lock", "to write"):
            pass
    monkeypatch.undo()
    with hold_lock(tmp_path / ".lock", "to write"):
        pass
