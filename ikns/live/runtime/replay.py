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
from ikns.nullspace.signal_names import signal_names


@dataclass(frozen=True, eq=False)
class Replayed:
    """What a replay computed, and where that differs from the recorded values.

    Parameters
    ----------
    c, flexion : (T,) or (T, d) array
        Raw control signal and commanded flexion; by freedom where the map has several.
    state : (T,) integer array
        State of the safety machine, an index into
        :data:`ikns.live.session.channels.STATES`.
    uncertainty : (T,) or (T, d) array
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
        When the settings, the subject or a column are missing or damaged.

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
    ikns.errors.FileError: ...run-01/subject: no such folder; ...
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
    n_dof = len(controller.flexions)
    columns = _columns(run, n_dof)
    c, flexion, uncertainty = np.empty((3, rows, n_dof))
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
        c[i], flexion[i] = made.solved.c, made.flexions
        uncertainty[i] = made.solved.uncertainty
        state[i] = STATES.index(made.state)
        if made.valid and made.state == "armed":
            machine.activate(float(run.receive_time[i]))
        following = run.receive_time[i + 1] if i + 1 < rows else np.inf
        while acts and acts[0][0] < following:
            onset, what = acts.pop(0)
            machine.stop(onset, "recorded")  # its watchdog may have, without a frame
            if what == "armed":
                machine.arm_again(onset)
    computed = {"c": c, "flexion_asked": flexion, "uncertainty": uncertainty}
    recorded = {}
    for shown, kind, k, name in columns:
        ours = state.astype(float) if kind == "state" else computed[kind][:, k]
        recorded[shown] = ours, run.model[name]
    different = {
        name: int(np.sum(~((ours == theirs) | (np.isnan(ours) & np.isnan(theirs)))))
        for name, (ours, theirs) in recorded.items()
    }
    if n_dof == 1:
        c, flexion, uncertainty = c[:, 0], flexion[:, 0], uncertainty[:, 0]
    return Replayed(c, flexion, state, uncertainty, different)


def _columns(run: Run, n_dof: int) -> list[tuple[str, str, int, str]]:
    """Return what to compare: how to call it, its kind, the freedom, and the column.

    Raises
    ------
    FileError
        When the session lacks a column.
    """
    model = run.model
    signals, flexions = signal_names(n_dof), signal_names(n_dof, "flexion")
    if (
        "c1" in model
    ):  # from before several fingers: the first signal drove the only one
        signals, flexions = [f"c{k + 1}" for k in range(n_dof)], ["flexion"]
    found = [(name, "c", k, name) for k, name in enumerate(signals)]
    found += [
        (f"{name}_asked", "flexion_asked", k, f"{name}_asked")
        for k, name in enumerate(flexions)
    ]
    found.append(("state", "state", 0, "state"))
    found += [
        ("uncertainty" if n_dof == 1 else name, "uncertainty", k, name)
        for k, name in enumerate(f"{name}_uncertainty" for name in signals)
        if name in model  # older sessions lack it
    ]
    missing = [name for *_, name in found if name not in model]
    if missing:
        raise FileError(
            f"{run.session}: run {run.number} has no column '{missing[0]}'."
        )
    return found
