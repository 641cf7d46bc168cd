"""A file is recognized by what it is, not by its name."""

import os
from pathlib import Path

import pytest

from ikns.errors import InvalidInput
from ikns.output.inputs import refuse_input, refuse_input_folder


def test_other_files_may_be_written(tmp_path: Path) -> None:
    for name in ("read", "written"):
        (tmp_path / name).write_text("the same content")
    refuse_input(tmp_path / "written", [tmp_path / "read", None])
    refuse_input(tmp_path / "new", [tmp_path / "read"])
    refuse_input(tmp_path / "written", [tmp_path / "missing", "oxford24", "a\0b"])


@pytest.mark.parametrize("make", [os.symlink, os.link])
def test_one_file_under_two_names_is_one_file(tmp_path: Path, make) -> None:
    (tmp_path / "folder").mkdir()
    source = tmp_path / "folder" / "read"
    source.write_text("kept")
    make(source, tmp_path / "written")
    for given in (source, tmp_path / "folder", str(source)):
        with pytest.raises(InvalidInput, match="this file is also an input, "):
            refuse_input(tmp_path / "written", [given])


def test_a_folder_around_an_input_or_with_a_link_to_it_is_refused(
    tmp_path: Path,
) -> None:
    out, apart = tmp_path / "out", tmp_path / "apart"
    (out / "deep").mkdir(parents=True)
    apart.mkdir()
    for path in (out / "deep" / "a", apart / "b"):
        path.write_text("kept")
    refuse_input_folder(out, [apart / "b", apart, None])
    os.link(apart / "b", out / "b")
    for source in (out, out / "deep", out / "deep" / "a", apart / "b"):
        with pytest.raises(InvalidInput, match="an input; give the output"):
            refuse_input_folder(out, [source])
    # A folder within one that is read may be written: a report in its study.
    refuse_input_folder(out / "deep", [out])
    refuse_input_folder(tmp_path / "new", [apart])
