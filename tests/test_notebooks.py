"""Every notebook runs from top to bottom and ends with what was learned."""

import os
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
RUN = Path(__file__).with_name("run_notebooks.py")


def code_cells(path: Path) -> list:
    cells = nbformat.read(path, as_version=4).cells
    return [cell for cell in cells if cell.cell_type == "code"]


@pytest.fixture(params=NOTEBOOKS, ids=lambda path: path.stem)
def notebook(request: pytest.FixtureRequest) -> Path:
    return request.param


def test_there_are_notebooks() -> None:
    assert NOTEBOOKS


def test_the_notebooks_run(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, RUN, tmp_path, *NOTEBOOKS],
        capture_output=True,
        text=True,
        # As in a clean clone: no real recordings but those next to the notebooks.
        env={k: v for k, v in os.environ.items() if k != "IKNS_TEST_DATA"},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for notebook in NOTEBOOKS:
        executed = code_cells(tmp_path / notebook.name)
        shown = [output for cell in executed for output in cell.outputs]
        assert any("image/png" in output.get("data", {}) for output in shown)
        # Warnings go there; a reader should meet none.
        assert not [output.text for output in shown if output.get("name") == "stderr"]


def test_a_notebook_has_its_point_and_its_lesson(notebook: Path) -> None:
    cells = nbformat.read(notebook, as_version=4).cells
    assert cells[0].source.startswith("# ")
    assert "**The point.**" in cells[0].source
    assert cells[-1].source.startswith("## What was learned")


def test_a_notebook_defines_nothing_reusable(notebook: Path) -> None:
    for cell in code_cells(notebook):
        assert not {"def", "class", "lambda"} & set(cell.source.split())


def test_a_notebook_shows_what_came_out_when_it_last_ran(notebook: Path) -> None:
    cells = code_cells(notebook)
    assert [c.execution_count for c in cells] == list(range(1, len(cells) + 1))
    assert not [o for c in cells for o in c.outputs if o.output_type == "error"]
