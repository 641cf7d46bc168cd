"""Nothing recorded is lost in silence: what is missing on disk is counted and said."""

import errno
import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from command_line import check_refused, contents
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ikns.cli import main
from ikns.finger.emulator import Servo, Wire
from ikns.live.session import create_session, open_run, read_run, runs
from ikns.live.session import row_file as module
from ikns.live.session.channels import Channel
from ikns.live.session.dataset import run_files
from ikns.live.session.row_file import RowFile

CHANNELS = [Channel("number", "MISC", "n/a", form="%d"), Channel("x", "MISC", "n/a")]
PROCESS = Path(__file__).with_name("session_process.py")
FAULTS = [errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.EFBIG]


def failed(code: int) -> OSError:
    return OSError(code, os.strerror(code))


def put(file: RowFile, number: int) -> None:
    for _ in range(number):
        file.put((float(file.rows), 0.25))


def expected(numbers: range) -> bytes:
    return "".join(f"{k}\t0.250000\n" for k in numbers).encode()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    place = tmp_path / "rows.tsv"
    place.write_bytes(b"")
    return place


class Disk:
    """A disk with so much room, whose sync fails on request and then loses rows."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.room, self.code, self.sync_fails = 1 << 40, errno.ENOSPC, False
        self._write, self._fsync = os.write, os.fsync
        self._synced = 0
        monkeypatch.setattr(module.os, "write", self.write)
        monkeypatch.setattr(module.os, "fsync", self.fsync)

    def write(self, descriptor: int, data: bytes) -> int:
        if not self.room:
            raise failed(self.code)
        done = self._write(descriptor, bytes(data[: self.room]))
        self.room -= done
        return done

    def fsync(self, descriptor: int) -> None:
        size = os.fstat(descriptor).st_size
        if self.sync_fails:
            # What was not synced is gone, and the system will not report it again.
            self.sync_fails = False
            os.ftruncate(descriptor, min(self._synced, size))
            os.ftruncate(descriptor, size)
            raise failed(errno.EIO)
        self._fsync(descriptor)
        self._synced = size


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("put"), st.integers(1, 30)),
        st.tuples(st.just("room"), st.integers(0, 300)),
        st.tuples(st.just("write"), st.booleans()),
        st.tuples(st.just("sync fails"), st.just(True)),
    ),
    max_size=30,
)


@given(steps=STEPS)
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_once_the_disk_works_again_every_row_is_there_once(
    steps: list[tuple[str, int]], tmp_path: Path
) -> None:
    path = tmp_path / "rows.tsv"
    path.write_bytes(b"")
    with pytest.MonkeyPatch.context() as patch:
        disk, file = Disk(patch), RowFile(path, CHANNELS)
        for what, value in steps:
            if what == "put":
                put(file, value)
            elif what == "room":
                disk.room = value
            elif what == "sync fails":
                disk.sync_fails = True
            else:
                file.write(sync=bool(value))
                size = path.stat().st_size
                assert size == 0 or path.read_bytes()[-1:] in (b"\n", b"\0")
        disk.room, disk.sync_fails = 1 << 40, False
        for _ in range(2):
            file.write(sync=True)
        file.close()
    assert path.read_bytes() == expected(range(file.rows))
    assert (file.fault, file.lost(), file.dropped) == ("", 0, 0)


@pytest.mark.parametrize("code", FAULTS)
def test_the_rows_that_fit_stay_and_the_rest_is_counted(
    path: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    disk, file = Disk(monkeypatch), RowFile(path, CHANNELS)
    disk.room, disk.code = 434 * 13 + 5, code  # the 435th row does not fit
    put(file, 801)
    for _ in range(3):
        file.write(sync=True)
    file.close()
    # Rows 0 to 9 have 11 bytes, to 99 12, the others 13.
    rows = path.read_bytes().count(b"\n")
    assert path.read_bytes() == expected(range(rows))
    assert rows == 434 + (2 * 10 + 90 + 5) // 13
    assert file.lost() == 801 - rows
    assert file.fault == f"cannot be written: {os.strerror(code).lower()}"


def test_a_sync_that_keeps_failing_is_said_once(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fsync(descriptor: int) -> None:
        raise failed(errno.EIO)

    monkeypatch.setattr(module.os, "fsync", fsync)
    file, faults = RowFile(path, CHANNELS), []
    for k in range(12):
        put(file, 10)
        file.write(sync=k % 4 == 0)
        faults.append(file.fault)
    file.close()
    assert faults == ["cannot be written: input/output error"] * 12
    # It may be there, and is; no one knows whether it is on the disk.
    assert path.read_bytes() == expected(range(120))
    assert file.lost() == 0


def cut(path: Path) -> None:
    os.truncate(path, 30)


def empty(path: Path) -> None:
    path.write_bytes(b"")


def replace(path: Path) -> None:
    other = path.with_name("other")
    other.write_bytes(b"0\t0.250000\n")
    other.replace(path)


def rename(path: Path) -> None:
    path.rename(path.with_name("moved"))


def rename_folder(path: Path) -> None:
    path.parent.rename(path.parent.with_name("moved"))


def delete(path: Path) -> None:
    path.unlink()


def scribble(path: Path) -> None:
    with path.open("ab") as file:
        file.write(b"half a row")


@pytest.mark.parametrize(
    ("change", "says", "left"),
    [
        (cut, "another program changed it, from 3790 to 30 bytes", 2),
        (empty, "another program changed it, from 3790 to 0 bytes", 0),
        (scribble, "another program changed it, from 3790 to 3800 bytes", 300),
        (replace, "another program moved or replaced it", 1),
        (rename, "another program moved or replaced it", 0),
        (rename_folder, "another program moved or replaced it", 0),
        (delete, "it has been deleted", 0),
    ],
)
def test_what_another_program_does_to_the_file_is_said_while_it_runs(
    tmp_path: Path, change: Callable[[Path], None], says: str, left: int
) -> None:
    folder = tmp_path / "session"
    folder.mkdir()
    path = folder / "rows.tsv"
    path.write_bytes(b"")
    file = RowFile(path, CHANNELS)
    put(file, 300)
    file.write(sync=True)
    assert file.fault == ""
    change(path)
    put(file, 200)
    file.write(sync=False)
    assert says in file.fault
    file.write(sync=True)
    file.close()
    # What came later is in the file, whole, where it still is the same file.
    later = 200 if change in (cut, empty, scribble) else 0
    assert file.lost() == 500 - left - later
    if later:
        rows = path.read_bytes().splitlines(keepends=True)
        assert rows[:left] == expected(range(left)).splitlines(keepends=True)
        assert rows[left:] == expected(range(300, 500)).splitlines(keepends=True)


def test_rows_that_wait_too_long_are_given_up_and_counted(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_WAITING", 100)
    disk, file = Disk(monkeypatch), RowFile(path, CHANNELS)
    disk.room = 0
    put(file, 250)
    file.write(sync=False)
    assert file.dropped == 150
    disk.room = 1 << 40
    file.write(sync=True)
    file.close()
    assert path.read_bytes() == expected(range(150, 250))
    assert file.lost() == 150


def test_a_quota_that_is_checked_at_the_end_is_said(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.close

    def close(descriptor: int) -> None:
        real(descriptor)
        raise failed(errno.EDQUOT)

    file = RowFile(path, CHANNELS)
    with monkeypatch.context() as patch:
        patch.setattr(module.os, "close", close)
        file.close()
    file.close()
    assert "quota" in file.fault


# --- a whole run ----------------------------------------------------------------------


@contextmanager
def files_up_to(size: int) -> Iterator[None]:
    """Let no file of this process grow beyond a size, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)


def run_argv(files: Path, session: Path, *more: str) -> list[str]:
    source = f"replay:{files / 'free.c3d'}?speed=max"
    base = ["run", "--subject", str(files / "person"), "--source", source]
    return [*base, "--session", str(session), *more]


def test_a_run_on_a_full_disk_counts_what_is_missing(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session = tmp_path / "session"
    # Enough for every sidecar and the subject, not for the rows of the model.
    size = max(p.stat().st_size for p in (files / "person").iterdir())
    with files_up_to(max(size, 10_000)):
        code = main(run_argv(files, session, "--dry-run", "--json"))
    out, err = capsys.readouterr()
    assert code == 1
    found = run_files(session, "01", 1)
    rows = {name: file.read_bytes().count(b"\n") for name, file in found.items()}
    missing = {name: 50 - rows[name] for name in ("markers", "model")}
    assert sum(missing.values()) > 0
    result = json.loads(out)
    assert result["lost_rows"] == sum(missing.values())
    for name, number in missing.items():
        said = f"{found[name]}: {number} of 50 rows are missing"
        assert (said in err) == any(said in each for each in result["losses"])
        assert (said in err) == (number > 0)
    assert len(read_run(session).frame) == min(rows["markers"], rows["model"])


def test_a_run_that_is_whole_says_nothing(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(run_argv(files, tmp_path / "s", "--dry-run", "--json")) == 0
    out, err = capfd.readouterr()
    result = json.loads(out)
    assert (result["lost_rows"], result["losses"], err) == (0, [], "")
    assert not (tmp_path / "s" / ".lock").exists()


@pytest.mark.parametrize("given", ["model", "baud", "unplugged"])
def test_a_start_that_fails_leaves_no_session(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], given: str
) -> None:
    session = tmp_path / "new" / "session"
    with Wire(Servo("xl430", baud=1_000_000)) as wire:
        address = {
            "model": f"dynamixel:{wire.port}?baud=1000000&model=xm430",
            "baud": f"dynamixel:{wire.port}?baud=57600&model=xl430",
            "unplugged": f"dynamixel:{tmp_path / 'none'}?model=xl430",
        }[given]
        argv = run_argv(files, session)
        check_refused([*argv, "--finger", address], tmp_path, capfd)
    assert not session.exists()
    # The next try is not in its way, nor is a failed one in that of a session's runs.
    assert main([*argv, "--dry-run"]) == 0
    capfd.readouterr()
    before = contents(session)
    bad = ["--resume", "--finger", f"dynamixel:{tmp_path / 'none'}?model=xl430"]
    check_refused([*argv, *bad], tmp_path, capfd)
    assert contents(session) == before
    assert main([*argv, "--dry-run", "--resume"]) == 0
    assert runs(session) == [1, 2]


@pytest.mark.parametrize("room", [0, 100, 1500])
def test_a_session_that_cannot_be_begun_is_not_begun(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], room: int
) -> None:
    session = tmp_path / "session"
    with files_up_to(room):
        assert main(run_argv(files, session, "--dry-run")) == 2
    assert "cannot be written: file too large" in capsys.readouterr().err
    assert not session.exists()


def test_a_session_is_recorded_by_one_process(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    session = create_session(tmp_path / "session")
    open_run(session, labels=["A"], joint_names=[], rate=100, configuration={}).close()
    lock = (
        "import sys\nfrom ikns.live.session import session_lock\n"
        "with session_lock(sys.argv[1]):\n print(flush=True)\n sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", lock, str(session)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as holder:
        assert holder.stdout is not None
        holder.stdout.readline()
        argv = run_argv(files, session, "--dry-run", "--resume")
        sentence = check_refused(argv, tmp_path, capfd)
        assert f"process {holder.pid} on" in sentence
        holder.kill()
    assert main(argv) == 0
    assert "has ended; the lock was taken over" in capfd.readouterr().err


def test_a_start_that_was_killed_does_not_stand_in_the_way(tmp_path: Path) -> None:
    session = create_session(tmp_path / "session")
    # What a kill between its files leaves.
    (session / "sourcedata" / "sub-01" / "run-01").mkdir(parents=True)
    for number in (2, 3):
        open_run(
            session, labels=["A"], joint_names=[], rate=100, configuration={}
        ).close()
        assert runs(session)[-1] == number


def test_rows_cut_off_while_a_process_records_are_said(tmp_path: Path) -> None:
    session = create_session(tmp_path / "session")
    said: list[str] = []
    writer = open_run(
        session,
        labels=["A"],
        joint_names=[],
        rate=100,
        configuration={},
        on_fault=said.append,
    )
    path = run_files(session, "01", 1)["markers"]
    with writer:
        for k in range(20):
            writer.row("markers", [k, 0, 0, 0, 0, 0])
        deadline = time.monotonic() + 20
        while path.read_bytes().count(b"\n") < 20 and time.monotonic() < deadline:
            time.sleep(0.02)
        size = path.stat().st_size
        os.truncate(path, 0)
        while not said and time.monotonic() < deadline:
            time.sleep(0.02)
        assert "another program changed it" in said[0]
        assert str(path) in said[0]
    assert writer.lost == 20
    assert writer.losses == [
        f"{path}: 20 of 20 rows are missing (another program changed it, from {size} "
        "to 0 bytes)."
    ]
