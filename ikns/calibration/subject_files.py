"""Which files a subject folder has; to ask that loads nothing."""

from __future__ import annotations

from pathlib import Path

from ikns.errors import FileError
from ikns.output.inputs import no_such_folder

#: Files that every subject folder has.
NEEDED = ("skeleton.urdf", "markers.toml", "map.json", "calibration.json")
#: Methods next to the paper's, which ``map.json`` holds: one file each.
OTHERS = ("proximal", "intent")
#: Still samples of the calibration.
SAMPLES = "samples.csv"
#: All files of a subject folder; those after the first four are optional.
FILES = (*NEEDED, *(f"{method}.json" for method in OTHERS), SAMPLES)


def check_subject_folder(folder: str | Path) -> Path:
    """Refuse what is not a subject folder, before anything is loaded.

    Raises
    ------
    FileError
        When there is no folder, or it lacks files.
    """
    place, kind = Path(folder), "a subject folder"
    remedy = "one that `ikns calibrate` wrote"
    if not place.is_dir():
        raise FileError(no_such_folder(place, kind, remedy))
    missing = [name for name in NEEDED if not (place / name).is_file()]
    if missing:
        kind += f" ({', '.join(missing)} missing)"
        raise FileError(no_such_folder(place, kind, remedy))
    return place
