"""What ``ikns track`` and ``ikns pick`` share: whose visit it is, how it goes."""

from __future__ import annotations

import sys
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

import ikns
from ikns.cli.live_session import software, stopped_by_signals
from ikns.cli.output import show, table
from ikns.cli.visit_drivers import (
    PAGE,
    Arm,
    Screens,
    arm_driver,
    arm_is_simulated,
    arm_subject,
    finger_opener,
    input_said,
    open_arm_source,
    virtual_driver,
)
from ikns.errors import InvalidInput

if TYPE_CHECKING:
    from ikns.experiments.conduct import Conductor, Driver, Experiment
    from ikns.live.runtime import Status

__all__ = ["Whose", "chosen", "conduct", "names", "whose"]

#: A virtual operator begins after this long, s.
_VIRTUAL_WAIT = 2.0

Drivers = dict[str, Callable[[], AbstractContextManager["Driver"]]]


@dataclass(frozen=True)
class Whose:
    """Whose visit it is, and of which study.

    Parameters
    ----------
    folder : Path
    participant : str
    number : int
        Of the participant, from 0: the order of everything depends on it.
    stored : dict
        ``visit.json`` of a visit that goes on; empty of a new one.
    study : Study or None
    """

    folder: Path
    participant: str
    number: int
    stored: dict[str, Any]
    study: Any = None


def names(text: str) -> list[str]:
    """Split a list of names at its commas.

    >>> names("ikns, gamepad")
    ['ikns', 'gamepad']
    """
    return [name.strip() for name in text.split(",") if name.strip()]


def chosen(given: Any, before: Mapping[str, Any], name: str, default: Any) -> Any:
    """Return what was given, else what the visit was begun with, else the default."""
    return before.get(name, default) if given is None else given


def whose(
    visit: Path | None,
    study: Path | None,
    *,
    experiment: str,
    participant: str | None,
    number: int | None,
) -> Whose:
    """Find the visit's folder and what it was begun with.

    Raises
    ------
    InvalidInput
        When both or neither of visit and study are named.
    """
    if (visit is None) == (study is None):
        raise InvalidInput(
            "expected the folder of a visit or --study, found "
            f"{'neither' if visit is None else 'both'}."
        )
    declared = None
    if study is not None:
        from ikns.experiments.study import check_declaration, read_study

        declared = read_study(study)
        check_declaration(study, declared)
        if participant is None:
            raise InvalidInput("--study needs the --participant whose visit it is.")
        visit = study / "visits" / f"sub-{participant}_{experiment}"
    assert visit is not None
    stored: dict[str, Any] = {}
    if (visit / "visit.json").exists():
        from ikns.experiments.visits import read_visit

        stored = read_visit(visit, experiment=experiment).about
    who = str(chosen(participant, stored, "participant", "01"))
    if not (who.isascii() and who.isalnum()):
        raise InvalidInput(
            f"expected a participant of letters and digits, found '{who}'."
        )
    place = chosen(number, stored, "participant_number", None)
    if place is None:
        if not who.isdigit() or int(who) < 1:
            raise InvalidInput(
                f"expected --number, from 0, for participant '{who}', found none."
            )
        place = int(who) - 1
    return Whose(visit, who, int(place), stored, declared)


def conduct(
    who: Whose,
    arm: Arm,
    screens: Screens,
    *,
    conditions: Sequence[str],
    about: Mapping[str, Any],
    make_experiment: Callable[[Sequence[Mapping[str, Any]]], Experiment],
    rest: float,
    seed: int,
    as_json: bool,
) -> None:
    """Go through a visit and say how it went.

    Parameters
    ----------
    who : Whose
    arm : Arm
    screens : Screens
    conditions : sequence of str
    about : mapping
        What of ``visit.json`` is particular to the experiment.
    make_experiment : callable
        Makes the experiment from the attempts that are there already.
    rest : float
        Of a break, s.
    seed : int
        Of a virtual operator.
    as_json : bool
    """
    from ikns.experiments.cockpit import Cockpit, check_port
    from ikns.experiments.conduct import Conductor, HeldInput, VisitLog, run_visit
    from ikns.experiments.conduct.ring import ring_driver

    virtual = "virtual" in conditions
    if virtual and len(conditions) > 1:
        raise InvalidInput(
            "expected people or the virtual operator in a visit, found "
            f"{', '.join(conditions)}."
        )
    subject = arm_subject(arm) if "ikns" in conditions else None
    finger_opener(arm)
    check_port(screens.host, screens.port)
    simulated = virtual or (subject is not None and arm_is_simulated(subject, arm))
    if who.study is not None and who.study.simulated != simulated:
        words = {True: "simulated", False: "with people"}
        raise InvalidInput(
            f"expected a visit that is {words[who.study.simulated]}, as the study "
            f"declares, found one that is {words[simulated]}."
        )
    session = arm.session or who.folder / "session"
    with ExitStack() as stack:
        stop = stack.enter_context(stopped_by_signals())
        shown: list[Callable[[Status], None]] = []
        address = ""
        if subject is not None:
            # Sources that do not answer are told before anything is written.
            with open_arm_source(arm, subject):
                ikns.warm_up()
        log = VisitLog(
            who.folder,
            {
                "participant": who.participant,
                "simulated": simulated,
                "study": "" if who.study is None else who.study.name,
                "variation": "",
                "variation_settings": {},
                "participant_number": who.number,
                "seed": seed,
                "input": {name: input_said(name, arm, screens) for name in conditions},
                "session": _relative(session, who.folder) if subject else None,
                "versions": software(),
            }
            | dict(about),
        )
        if who.study is not None:
            from ikns.experiments.study import save_declaration

            save_declaration(who.folder.parents[1], who.study)
        experiment = make_experiment(log.attempts)
        conductor = Conductor(
            experiment,
            log,
            page_conditions={*PAGE, "ring"},
            rest=rest,
            auto=_VIRTUAL_WAIT if virtual else None,
        )
        held = {name: HeldInput() for name in PAGE if name in conditions}
        drivers: Drivers = {}
        for name, one in held.items():
            drivers[name] = lambda one=one: nullcontext(one)  # type: ignore[misc]
        if virtual:
            drivers["virtual"] = lambda: nullcontext(
                virtual_driver(experiment, rate=screens.rate, seed=[seed, who.number])
            )
        if subject is not None:
            if arm.view:
                from ikns.view.scene import body_view

                window, take = stack.enter_context(
                    body_view(subject, simulated=simulated)
                )
                address = window.url
                shown.append(take)
            drivers["ikns"] = lambda: arm_driver(
                arm, subject, session, who.participant, shown
            )
        presses: SimpleQueue[None] = SimpleQueue()
        if "ring" in conditions:
            drivers["ring"] = lambda: ring_driver(presses, finger_opener(arm))
        cockpit = stack.enter_context(
            Cockpit(
                conductor,
                held,
                on_press=lambda: presses.put(None),
                host=screens.host,
                port=screens.port,
                about={
                    "participant": who.participant,
                    "simulated": simulated,
                    "stick": screens.stick,
                    "view": address,
                },
            )
        )
        sys.stderr.write(
            f"ikns: the participant's page is at {cockpit.url}\n"
            f"ikns: the experimenter's panel is at {cockpit.panel_url}\n"
        )
        sys.stderr.flush()
        if screens.browser:
            webbrowser.open(cockpit.panel_url)
            webbrowser.open(cockpit.url)
        run_visit(conductor, drivers, stop=stop, rate=screens.rate)
    _tell(who, conductor, as_json=as_json)


def _relative(path: Path, folder: Path) -> str:
    import os.path

    return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()


def _tell(who: Whose, conductor: Conductor, *, as_json: bool) -> None:
    from ikns.statistics.wording import counted

    results, left = conductor.results, conductor.shown["trials_left"]
    figures = "time" if conductor.experiment.name == "picking" else "rmse"
    result = {
        "visit": who.folder,
        "participant": who.participant,
        "simulated": conductor.log.simulated,
        "left": left,
        "stopped": conductor.emergency.is_set(),
        "attempts": results,
    }
    title = f"Visit of participant {who.participant}"
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
            [
                [a["number"], a["key"].replace("/", " "), a["outcome"], a.get(figures)]
                for a in results
            ],
        ),
        f"{counted(left, 'trial')} left; the same command goes on."
        if left
        else "All trials are done.",
        f"Wrote {who.folder}",
        as_json=as_json,
    )
