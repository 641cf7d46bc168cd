"""Output files: whole or not at all, and never over another unasked."""

import csv
import errno
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.output import file as module
from ikns.output.file import create_bytes, refuse_overwriting, write_bytes, write_csv


def test_a_table_has_nine_digits_and_empty_cells(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    write_csv(path, ["a", "b"], [[1 / 3, float("nan")], [2.0, -1.0]])
    assert path.read_text() == "a,b\n0.333333333,\n2,-1\n"


@given(
    table=st.integers(1, 3).flatmap(
        lambda n: st.lists(st.lists(st.floats(), min_size=n, max_size=n), min_size=1)
    )
)
def test_every_cell_is_read_back_to_nine_digits(
    tmp_path_factory: pytest.TempPathFactory, table: list[list[float]]
) -> None:
    path = tmp_path_factory.getbasetemp() / "read-back.csv"
    write_csv(path, [f"column {k}" for k in range(len(table[0]))], np.array(table))
    with path.open(newline="") as file:
        _, *rows = csv.reader(file)
    found = [[float(cell or "nan") for cell in row] for row in rows]
    # The ninth digit may be off by half, 5e-9 of the first.
    np.testing.assert_allclose(found, table, rtol=5e-9, atol=5e-324)


def test_a_write_that_fails_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    with pytest.raises(OSError, match="directory"):
        write_bytes(tmp_path / "taken", b"content")
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_what_may_not_be_written_is_refused_with_its_reason(tmp_path: Path) -> None:
    old = tmp_path / "old.csv"
    old.write_text("kept")
    refuse_overwriting(old, force=True, inputs=[])
    refuse_overwriting(tmp_path / "new.csv", force=False, inputs=[])
    for path, reason in (
        (old, "use --force"),
        (tmp_path, "found a folder"),
        (tmp_path / "none" / "new.csv", "does not exist"),
        (Path("/dev/null"), "found a device"),
    ):
        with pytest.raises(InvalidInput, match=reason):
            refuse_overwriting(path, force=path != old, inputs=[])


def test_a_link_to_nothing_is_not_replaced_unasked(tmp_path: Path) -> None:
    link = tmp_path / "out.csv"
    link.symlink_to(tmp_path / "elsewhere.csv")
    with pytest.raises(InvalidInput, match="use --force"):
        refuse_overwriting(link, force=False, inputs=[])
    with pytest.raises(InvalidInput, match="another program has written it"):
        write_bytes(link, b"new", force=False)
    assert [path.name for path in tmp_path.iterdir()] == ["out.csv"]


def test_a_file_that_came_meanwhile_is_not_replaced_unasked(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    refuse_overwriting(path, force=False, inputs=[])
    path.write_text("of another program")
    with pytest.raises(
        InvalidInput, match="another program has written it in the meantime"
    ):
        write_csv(path, ["a"], [[1.0]], force=False)
    assert path.read_text() == "of another program"
    write_csv(path, ["a"], [[1.0]], force=True)
    assert path.read_text() == "a\n1\n"
    assert [each.name for each in tmp_path.iterdir()] == ["table.csv"]


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
@pytest.mark.parametrize("force", [True, False])
def test_a_disk_that_refuses_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int, force: bool
) -> None:
    path = tmp_path / "table.csv"
    if force:
        path.write_text("old")

    def refuse(descriptor: int) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(module.os, "fsync", refuse)
    with pytest.raises(OSError, match=os.strerror(code)) as refused:
        write_bytes(path, b"new", force=force)
    assert refused.value.filename == str(path)  # not the part's
    assert [each.read_text() for each in tmp_path.iterdir()] == ["old"] * force


@pytest.mark.parametrize("linked", [True, False])
def test_of_several_writers_one_succeeds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, linked: bool
) -> None:
    def no_links(source: Path, target: Path) -> None:
        raise OSError(errno.EPERM, "no hard links on this file system")

    if not linked:
        monkeypatch.setattr(module.os, "link", no_links)
    path = tmp_path / "attempt"
    assert create_bytes(path, b"first")
    assert not create_bytes(path, b"second")
    assert [each.read_bytes() for each in tmp_path.iterdir()] == [b"first"]


CREATES = """
import sys
from pathlib import Path
from ikns.output.file import create_bytes
sys.stdin.readline()  # all begin together
who = sys.argv[1]
for k in range(100):
    if create_bytes(Path(f"{k}"), who.encode()):
        print(k)
"""


def test_processes_never_share_a_file(tmp_path: Path) -> None:
    running = [
        subprocess.Popen(
            [sys.executable, "-c", CREATES, str(who)],
            cwd=tmp_path,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for who in range(3)
    ]
    for process in running:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    told = {}
    for who, process in enumerate(running):
        out, _ = process.communicate(timeout=120)
        assert process.returncode == 0
        for number in out.split():
            assert number not in told
            told[number] = str(who)
    # Each was told to one writer, and it is that writer's content that is there.
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == told
    assert len(told) == 100
