"""Conduct a visit for ``ikns track`` and ``ikns pick`` and print its attempts."""

from __future__ import annotations

import os
import sys
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

import typer

import ikns
from ikns.cli.live_session import (
    check_participant,
    publishing,
    say_undriven,
    software,
)
from ikns.cli.output import show, table
from ikns.cli.stop_notice import watch_stops
from ikns.cli.visit_drivers import (
    PAGE,
    ArmOptions,
    PageOptions,
    arm_driver,
    arm_is_simulated,
    arm_subject,
    describe_input,
    driven_dofs,
    fingers_opener,
    open_arm_source,
    ring_finger,
)
from ikns.cli.visit_identity import VisitIdentity
from ikns.endings import signal_exit_code, stop_on_signals
from ikns.errors import DataLoss, InvalidInput

if TYPE_CHECKING:
    from ikns.experiments.conduct import (
        Conductor,
        Driver,
        Experiment,
        HeldInput,
        VisitLog,
    )
    from ikns.live.runtime import LoopStatus

#: A virtual operator begins after this long, s.
_VIRTUAL_WAIT = 2.0

Drivers = dict[str, Callable[[], AbstractContextManager["Driver"]]]


def conduct(
    identity: VisitIdentity,
    arm: ArmOptions,
    pages: PageOptions,
    *,
    conditions: Sequence[str],
    about: Mapping[str, Any],
    make_experiment: Callable[[Sequence[Mapping[str, Any]]], Experiment],
    rest: float,
    seed: int,
    as_json: bool,
) -> None:
    """Conduct a visit and print its attempts.

    Parameters
    ----------
    identity : VisitIdentity
    arm : ArmOptions
    pages : PageOptions
    conditions : sequence of str
    about : mapping
        Entries of ``visit.json`` that are particular to the experiment.
    make_experiment : callable
        Makes the experiment, given the attempts so far.
    rest : float
        Break between conditions, s.
    seed : int
        Of a virtual operator.
    as_json : bool
    """
    from ikns.experiments.cockpit import Cockpit
    from ikns.experiments.conduct import Conductor, HeldInput, run_visit
    from ikns.experiments.visits import visit_lock

    session = arm.session or identity.folder / "session"
    losses: list[str] = []
    with ExitStack() as stack:
        stack.enter_context(visit_lock(identity.folder))
        subject, simulated = _checked(identity, arm, pages, conditions)
        rate = 0.0
        stop = stack.enter_context(stop_on_signals())
        if subject is not None:
            # A source that does not answer is reported before anything is written.
            with open_arm_source(arm, subject) as source:
                ikns.warm_up()
                rate = source.rate * source.speed
            say_undriven(subject.null_space_map.n_dof, driven_dofs(arm, subject))
        shared = publishing(
            arm.publish or [],
            subject,
            rate=rate,
            simulated=simulated,
            timeline=arm.timeline,
        )
        publisher = stack.enter_context(shared)
        kept = _relative(session, identity.folder) if subject else None
        common = _about(identity, arm, pages, conditions, simulated=simulated)
        common |= {"seed": seed, "session": kept}
        log = _open_log(stack, identity, common | dict(about))
        experiment: Any = make_experiment(log.attempts)  # tracking's has a trial
        virtual = "virtual" in conditions
        conductor = Conductor(
            experiment,
            log,
            page_conditions={*PAGE, "ring"},
            rest=rest,
            auto=_VIRTUAL_WAIT if virtual else None,
            on_event=None if publisher is None else publisher.visit_event,
        )
        held = {name: HeldInput() for name in PAGE if name in conditions}
        drivers = _page_drivers(held)
        if virtual:
            drivers["virtual"] = lambda: _virtual_driver(
                experiment, rate=pages.rate, seed=[seed, identity.number]
            )
        address = ""
        if subject is not None:
            shown, address = _open_displays(
                stack, conductor, subject, arm, simulated=simulated
            )
            drivers["ikns"] = lambda: arm_driver(
                arm, subject, session, identity.participant, shown, losses, publisher
            )
        presses: SimpleQueue[None] = SimpleQueue()
        if "ring" in conditions:
            drivers["ring"] = _ring(presses, arm)
        shown_about = {
            "participant": identity.participant,
            "simulated": simulated,
            "stick": pages.stick,
            "view": address,
        }
        panel = Cockpit(
            conductor,
            held,
            on_press=lambda: presses.put(None),
            host=pages.host,
            port=pages.port,
            about=shown_about,
        )
        cockpit = stack.enter_context(panel)
        _announce(cockpit.url, cockpit.panel_url, browser=pages.browser)
        run_visit(conductor, drivers, stop=stop, rate=pages.rate)
    _show_attempts(identity, conductor, losses, as_json=as_json)
    _exit(losses)


def _open_displays(
    stack: ExitStack,
    conductor: Conductor,
    subject: ikns.Subject,
    arm: ArmOptions,
    *,
    simulated: bool,
) -> tuple[list[Callable[[LoopStatus], None]], str]:
    """Return what shows the live loop's status, and the address of the view, if any."""
    from ikns.experiments.conduct import Command

    stops = watch_stops(
        lambda: conductor.submit(Command("connect")),
        how="; the panel can connect it again",
    )
    shown, address = [stack.enter_context(stops)], ""
    if arm.view:
        from ikns.view.scene import body_view

        assert arm.subject is not None
        name, dofs = arm.subject.resolve().name, driven_dofs(arm, subject)
        view = body_view(subject, simulated=simulated, name=name, dofs=dofs)
        window, draw = stack.enter_context(view)
        shown.append(draw)
        address = window.url
    return shown, address


def _ring(
    presses: SimpleQueue[None], arm: ArmOptions
) -> Callable[[], AbstractContextManager[Driver]]:
    def driver() -> AbstractContextManager[Driver]:
        from ikns.experiments.conduct.ring import ring_driver

        return ring_driver(presses, ring_finger(arm))

    return driver


def _exit(losses: list[str]) -> None:
    """Say what must not be missed, and exit with its code."""
    if losses:
        raise DataLoss("; ".join(losses))
    if code := signal_exit_code():
        raise typer.Exit(code)


def _open_log(
    stack: ExitStack, identity: VisitIdentity, about: Mapping[str, Any]
) -> VisitLog:
    """Open the visit's log; a start that fails leaves none behind."""
    from ikns.experiments.conduct import VisitLog

    log = VisitLog(identity.folder, about)
    stack.push(lambda kind, *_: log.discard_unused() if kind else None)
    if identity.study is not None:
        from ikns.experiments.study import save_declaration

        save_declaration(identity.folder.parents[1], identity.study)
    return log


def _virtual_driver(
    experiment: Any, *, rate: float, seed: Sequence[int]
) -> AbstractContextManager[Driver]:
    from ikns.experiments.conduct.virtual import virtual_input

    return nullcontext(virtual_input(experiment.trial, rate=rate, seed=seed))


def _checked(
    identity: VisitIdentity,
    arm: ArmOptions,
    pages: PageOptions,
    conditions: Sequence[str],
) -> tuple[ikns.Subject | None, bool]:
    """Check everything that can be checked before the visit is opened.

    Returns
    -------
    subject : Subject or None
        Of the condition "ikns".
    simulated : bool
        Whether the visit is.
    """
    from ikns.experiments.cockpit import check_port

    virtual = "virtual" in conditions
    if virtual and len(conditions) > 1:
        raise InvalidInput(
            "expected people or the virtual operator in a visit, found "
            f"{', '.join(conditions)}."
        )
    subject = arm_subject(arm) if "ikns" in conditions else None
    n_dof = None if subject is None else subject.null_space_map.n_dof
    fingers_opener(arm, n_dof)
    if arm.publish:
        from ikns.live.publish import check_publish

        for address in arm.publish:
            check_publish(address)
    check_port(pages.host, pages.port)
    _check_session(arm.session, identity.participant)
    simulated = virtual or (subject is not None and arm_is_simulated(subject, arm))
    if identity.study is not None and identity.study.simulated != simulated:
        words = {True: "simulated", False: "with people"}
        raise InvalidInput(
            f"expected a visit that is {words[identity.study.simulated]}, as the study "
            f"declares, found one that is {words[simulated]}."
        )
    return subject, simulated


def _check_session(session: Path | None, participant: str) -> None:
    """Check that the live loop can keep its runs there."""
    if session is None:
        return
    if (session / "dataset_description.json").exists():
        check_participant(session, participant)
    if session.is_dir():
        return
    if session.exists() or not session.absolute().parent.is_dir():
        raise InvalidInput(
            f"{session}: expected a folder for --session, or a new one in an existing "
            "folder."
        )


def _about(
    identity: VisitIdentity,
    arm: ArmOptions,
    pages: PageOptions,
    conditions: Sequence[str],
    *,
    simulated: bool,
) -> dict[str, Any]:
    """Return the entries of ``visit.json`` that both experiments have."""
    return {
        "participant": identity.participant,
        "simulated": simulated,
        "study": "" if identity.study is None else identity.study.name,
        "variation": "",
        "variation_settings": {},
        "participant_number": identity.number,
        "seed": None,
        "input": {name: describe_input(name, arm, pages) for name in conditions},
        "session": None,
        "versions": software(),
    }


def _page_drivers(held: Mapping[str, HeldInput]) -> Drivers:
    """Return the drivers of the conditions that the participant's page provides."""

    def opener(one: HeldInput) -> Callable[[], AbstractContextManager[Driver]]:
        return lambda: nullcontext(one)

    return {name: opener(one) for name, one in held.items()}


def _announce(page: str, panel: str, *, browser: bool) -> None:
    sys.stderr.write(
        f"ikns: the participant's page is at {page}\n"
        f"ikns: the experimenter's panel is at {panel}\n"
    )
    sys.stderr.flush()
    if browser:
        webbrowser.open(panel)
        webbrowser.open(page)


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()


def _show_attempts(
    identity: VisitIdentity, conductor: Conductor, losses: list[str], *, as_json: bool
) -> None:
    results, left = conductor.results, conductor.shown["trials_left"]
    figures = "time" if identity.experiment == "picking" else "rmse"
    result = {
        "visit": identity.folder,
        "participant": identity.participant,
        "simulated": conductor.log.simulated,
        "left": left,
        "stopped": conductor.emergency.is_set(),
        "attempts": results,
        "losses": losses,
    }
    title = f"Visit of participant {identity.participant}"
    show(
        result,
        table(
            f"{title} (simulated)" if conductor.log.simulated else title,
            {
                "": "d",
                "step": "s",
                "outcome": "s",
                {"time": "time\ns", "rmse": "RMSE\nof 100"}[figures]: ".2f",
            },
            [[a["number"], a["step"], a["outcome"], a.get(figures)] for a in results],
        ),
        f"{left} trial{'s' * (left != 1)} left; the same command continues."
        if left
        else "All trials are done.",
        f"Wrote {identity.folder}",
        as_json=as_json,
    )
