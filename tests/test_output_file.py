"""Output files: whole or not at all, and never over another unasked."""

from pathlib import Path

import pytest

from ikns.errors import InvalidInput
from ikns.output.file import refuse_overwriting, write_bytes, write_csv


def test_a_table_has_nine_digits_and_empty_cells(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    write_csv(path, ["a", "b"], [[1 / 3, float("nan")], [2.0, -1.0]])
    assert path.read_text() == "a,b\n0.333333333,\n2,-1\n"


def test_a_write_that_fails_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    with pytest.raises(OSError, match="directory"):
        write_bytes(tmp_path / "taken", b"content")
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_what_may_not_be_written_is_refused_with_its_reason(tmp_path: Path) -> None:
    old = tmp_path / "old.csv"
    old.write_text("kept")
    refuse_overwriting(old, force=True)
    refuse_overwriting(tmp_path / "new.csv", force=False)
    for path, reason in (
        (old, "use --force"),
        (tmp_path, "found a folder"),
        (tmp_path / "none" / "new.csv", "existing folder"),
    ):
        with pytest.raises(InvalidInput, match=reason):
            refuse_overwriting(path, force=path != old)
