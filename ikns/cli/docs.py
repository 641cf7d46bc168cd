"""``ikns docs``: the documentation in the browser, and its pictures."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from ikns.cli.options import AsJson, Force
from ikns.cli.output import loading, progress, show
from ikns.errors import InvalidInput
from ikns.output.file import write_bytes
from ikns.output.folder import check_output_folder, output_folder

#: Where the documentation is built, below a copy of the repository.
_BUILT = Path("build") / "docs" / "index.html"


def docs(
    pictures: Annotated[
        Path | None,
        typer.Option(help="Draw the pictures of the pages into this folder instead."),
    ] = None,
    open_page: Annotated[
        bool, typer.Option("--open/--no-open", help="Show the pages in the browser.")
    ] = True,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Open the documentation, if it is built, or say how to build it."""
    if pictures is not None:
        _draw(pictures, force=force, as_json=as_json)
        return
    page = _page()
    if open_page:
        webbrowser.open(page.as_uri())
    show({"page": page}, f"The documentation: {page}", as_json=as_json)


def _page() -> Path:
    """Find the built pages here, or in the repository that is installed from."""
    for root in (Path.cwd(), Path(__file__).parents[2]):
        if (root / _BUILT).is_file():
            return (root / _BUILT).resolve()
    raise InvalidInput(
        f"{_BUILT}: the documentation is not built; in a copy of the repository, run "
        "pip install '.[docs]' and then sphinx-build -W notebooks build/docs."
    )


def _draw(folder: Path, *, force: bool, as_json: bool) -> None:
    loading()

    from ikns.view.gallery import PICTURES, gallery

    check_output_folder(folder, PICTURES, force=force)
    with output_folder(folder) as target, progress() as report:
        for name, picture in gallery(progress=report).items():
            write_bytes(target / name, picture)
    show(
        {"folder": folder, "pictures": PICTURES},
        f"Wrote {len(PICTURES)} pictures of a simulated person into {folder}",
        as_json=as_json,
    )
