"""A folder of results appears whole or not at all, and nothing foreign is deleted."""

from pathlib import Path

import pytest

from ikns.errors import FileError, InvalidInput
from ikns.output.folder import check_output_folder, output_folder

FILES = ("a.txt", "deep/b.txt")


def fill(folder: Path, text: str) -> None:
    (folder / "deep").mkdir()
    for name in FILES:
        (folder / name).write_text(text)


def fail(folder: Path) -> None:
    fill(folder, "second")
    raise KeyError


def test_the_folder_appears_with_all_its_files(tmp_path: Path) -> None:
    with output_folder(tmp_path / "new") as part:
        fill(part, "first")
        assert not (tmp_path / "new").exists()
    assert (tmp_path / "new" / "deep" / "b.txt").read_text() == "first"
    assert [path.name for path in tmp_path.iterdir()] == ["new"]


def test_an_error_leaves_the_earlier_folder_and_nothing_else(tmp_path: Path) -> None:
    with output_folder(tmp_path / "new") as part:
        fill(part, "first")
    with pytest.raises(KeyError), output_folder(tmp_path / "new") as part:
        fail(part)
    assert (tmp_path / "new" / "a.txt").read_text() == "first"
    assert [path.name for path in tmp_path.iterdir()] == ["new"]


def test_the_earlier_folder_goes_when_the_new_one_is_complete(tmp_path: Path) -> None:
    for text in ("first", "second"):
        with output_folder(tmp_path / "new") as part:
            fill(part, text)
    assert (tmp_path / "new" / "a.txt").read_text() == "second"
    assert [path.name for path in tmp_path.iterdir()] == ["new"]


def test_a_link_to_a_folder_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    with output_folder(tmp_path / "link") as part:
        fill(part, "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real" / "a.txt").read_text() == "new"


def test_what_the_system_refuses_is_reported_by_name(tmp_path: Path) -> None:
    with (
        pytest.raises(FileError, match="new: cannot be written"),
        output_folder(tmp_path / "new") as part,
    ):
        (part / "nowhere" / "a.txt").write_text("x")


def test_an_empty_or_missing_folder_may_be_written(tmp_path: Path) -> None:
    check_output_folder(tmp_path / "new", FILES, force=False)
    (tmp_path / "empty").mkdir()
    check_output_folder(tmp_path / "empty", FILES, force=False)


def test_force_covers_our_files_only(tmp_path: Path) -> None:
    (tmp_path / "new").mkdir()
    fill(tmp_path / "new", "first")
    with pytest.raises(InvalidInput, match="--force"):
        check_output_folder(tmp_path / "new", FILES, force=False)
    check_output_folder(tmp_path / "new", FILES, force=True)
    (tmp_path / "new" / "deep" / "mine.txt").write_text("precious")
    with pytest.raises(InvalidInput, match=r"mine\.txt"):
        check_output_folder(tmp_path / "new", FILES, force=True)


@pytest.mark.parametrize("name", ["file", "file/inside", "no/such", "."])
def test_what_cannot_be_a_folder_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("x")
    with pytest.raises(InvalidInput):
        check_output_folder(name, FILES, force=True)
    assert (tmp_path / "file").read_text() == "x"


def test_a_disk_that_cannot_keep_the_new_folder_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(descriptor: int) -> None:
        raise OSError(5, "Input/output error")

    with output_folder(tmp_path / "new") as part:
        fill(part, "first")
    monkeypatch.setattr("ikns.output.file.os.fsync", refuse)
    with pytest.raises(FileError, match="new: cannot be written: input/output"):
        with output_folder(tmp_path / "new") as part:
            fill(part, "second")
    assert (tmp_path / "new" / "a.txt").read_text() == "first"
    assert [path.name for path in tmp_path.iterdir()] == ["new"]
