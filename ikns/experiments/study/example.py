"""The example study: the paper's two experiments with virtual participants."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from ikns.experiments.study.declaration import FILE
from ikns.output.folder import check_output_folder, output_folder


def init_study(folder: str | Path, *, force: bool = False) -> Path:
    """Write a study folder with a commented example file.

    Parameters
    ----------
    folder : str or Path
        New; its parent must exist.
    force : bool
        Whether to replace an existing study file. A folder with results is never
        replaced.

    Returns
    -------
    Path
        Path of the file.

    Raises
    ------
    InvalidInput
        When the folder exists and may not be replaced.
    """
    text = files("ikns.experiments.study").joinpath("example.toml").read_bytes()
    check_output_folder(folder, (FILE,), force=force)
    with output_folder(folder) as part:
        (part / FILE).write_bytes(text)
    return Path(folder) / FILE
