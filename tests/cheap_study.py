"""A study whose visits cost nothing: what happens to files does not depend on them."""

from functools import lru_cache
from pathlib import Path

import numpy as np
import tomli_w

from ikns.experiments.study.cells import SimulatedVisit, Task, visit_name
from ikns.experiments.visits import table_bytes

STUDY = {
    "study": {"name": "cheap", "seed": 3},
    "cohort": {"participants": 2},
    "tracking": {},
    "picking": {},
}


def write_study(folder: Path, **tables: dict) -> Path:
    """Declare a study in a new folder, by tables instead of the cheap ones."""
    folder.mkdir()
    (folder / "study.toml").write_text(tomli_w.dumps(STUDY | tables))
    return folder


def contents(study: Path) -> dict[str, bytes]:
    """Every file that a run leaves, by name."""
    visits = study / "visits"
    return {
        path.relative_to(visits).as_posix(): path.read_bytes()
        for path in sorted(visits.rglob("*"))
        if path.is_file()
    }


def cheap_visits(task: Task) -> list[SimulatedVisit]:
    """Stand in for :func:`ikns.experiments.study.cells.simulate`."""
    return [
        _visit(experiment, task.number, task.variation)
        for experiment in task.experiments
    ]


@lru_cache
def _visit(experiment: str, number: int, variation: str) -> SimulatedVisit:
    rng = np.random.default_rng([number, len(experiment), len(variation)])
    common = {"number": 1, "key": "a", "kind": "trial", "condition": "ikns"}
    common |= {"repeat": 0, "reason": "", "practised": 0}
    if experiment == "tracking":
        trial = {"trajectory": "T1", "profile_seed": 0, "seconds": 15.0, "align": 1.0}
        trial |= {"outcome": "done", "time": np.arange(400) / 50, "c": rng.random(400)}
    else:
        trial = {"object": "A", "outcome": "success", "time": 8.0, "limit": 20.0}
        trial |= {"comment": ""}
    about = {
        "experiment": experiment,
        "participant": f"{number + 1:02d}",
        "simulated": True,
        "variation": variation,
        "seed": 3,
        "reason": "",
    }
    return SimulatedVisit(
        visit_name(experiment, number, variation),
        about,
        table_bytes(experiment, [common | trial]),
        {"subject/map.json": b"{}"} if number == 0 else {},
        {experiment: 1.0},
    )
