"""Replay a run of a session and compare the results with the recorded ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ikns.calibration.subject import Subject
from ikns.errors import FileError
from ikns.live.control.controller import Controller
from ikns.live.control.frame import FrameSolver
from ikns.live.control.settings import ControlSettings
from ikns.live.session import Run
from ikns.live.session.channels import STATES


@dataclass(frozen=True, eq=False)
class Replayed:
    """What a replay computed, and where that differs from the recorded values.

    Parameters
    ----------
    c, flexion : (T,) array
        Raw control signal and commanded flexion.
    state : (T,) integer array
        State of the safety machine, an index into
        :data:`ikns.live.session.channels.STATES`.
    uncertainty : (T,) array
        Standard deviation of c.
    different : dict of str to int
        Number of frames that differ from the recorded values in any bit, by column.
    """

    c: NDArray[np.float64]
    flexion: NDArray[np.float64]
    state: NDArray[np.int64]
    uncertainty: NDArray[np.float64]
    different: dict[str, int]

    @property
    def same(self) -> bool:
        """Whether all values are as recorded, to the bit."""
        return not any(self.different.values())


def replay_run(run: Run) -> Replayed:
    """Compute c and the commands of a run again from its markers and times.

    Parameters
    ----------
    run : Run
        As from :func:`ikns.live.session.read_run`, with its subject and settings.

    Returns
    -------
    Replayed

    Raises
    ------
    FileError
        When the settings or the subject are missing or damaged.

    Examples
    --------
    A session of ``ikns run`` has all that a replay needs; this one has no subject:

    >>> import tempfile
    >>> from ikns.live.session import create_session, open_run, read_run
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     session = create_session(folder)
    ...     about = {"labels": ["C7"], "joint_names": [], "rate": 100.0}
    ...     open_run(session, configuration={}, **about).close()
    ...     replay_run(read_run(session))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ikns.errors.FileError: ...run-01/subject: expected a folder that ...
    """
    subject = Subject.load(run.subject_folder)
    try:
        # Sessions from before this limit keep the rule they were recorded with.
        given = {"max_uncertainty": None} | run.configuration["settings"]
        settings = ControlSettings(**given)
    except (LookupError, TypeError) as error:
        raise FileError(
            f"{run.session}: the configuration of run {run.number} has no settings: "
            f"{error}."
        ) from None
    solver = FrameSolver(
        subject.skeleton,
        subject.null_space_map,
        subject.chain,
        readout=subject.readout(settings.method),
        max_uncertainty=settings.max_uncertainty,
    )
    controller = Controller(solver, settings)
    machine = controller.machine
    rows = len(run.frame)
    c, flexion, uncertainty = np.empty((3, rows))
    state = np.empty(rows, dtype=np.int64)
    # The watchdog's transitions follow from the frames' times; what else stopped the
    # finger, and who armed it again, do not.
    acts = [
        (onset, what)
        for onset, _, what, words in run.events
        if what == "stop" or (what == "armed" and words.startswith("safe "))
    ]
    machine.arm(0.0)
    for i in range(rows):
        made = controller.frame(
            run.markers[i], float(run.device_time[i]), float(run.receive_time[i])
        )
        c[i], flexion[i] = made.solved.c[0], made.flexion
        uncertainty[i] = made.solved.uncertainty[0]
        state[i] = STATES.index(made.state)
        if made.valid and made.state == "armed":
            machine.activate(float(run.receive_time[i]))
        following = run.receive_time[i + 1] if i + 1 < rows else np.inf
        while acts and acts[0][0] < following:
            onset, what = acts.pop(0)
            machine.stop(onset, "recorded")  # its watchdog may have, without a frame
            if what == "armed":
                machine.arm_again(onset)
    first = "c" if "c" in run.model else "c1"
    recorded = {
        "c": (c, run.model[first]),
        "flexion_asked": (flexion, run.model["flexion_asked"]),
        "state": (state.astype(float), run.model["state"]),
    }
    if first + "_uncertainty" in run.model:
        recorded["uncertainty"] = uncertainty, run.model[first + "_uncertainty"]
    different = {
        name: int(np.sum(~((ours == theirs) | (np.isnan(ours) & np.isnan(theirs)))))
        for name, (ours, theirs) in recorded.items()
    }
    return Replayed(c, flexion, state, uncertainty, different)
