"""What ``ikns track`` and ``ikns pick`` share: whose visit it is, what drives it."""

from __future__ import annotations

import dataclasses
import sys
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Literal

import ikns
from ikns.cli.live_session import live_session, software, stopped_by_signals
from ikns.cli.output import show, table
from ikns.cli.simulated import is_simulated
from ikns.errors import InvalidInput

if TYPE_CHECKING:
    from ikns.experiments.conduct import Conductor, Desk, Driver
    from ikns.finger import Finger
    from ikns.runtime import Status
    from ikns.session import RunWriter
    from ikns.stream import Source

__all__ = ["Arm", "Screens", "Whose", "chosen", "conduct", "names", "whose"]

#: What a page can drive, and how the visit names it.
_PAGE = {
    "gamepad": "gamepad at the participant's page",
    "keyboard": "keyboard at the participant's page, 0.5 per second",
    "mouse": "mouse at the participant's page",
}
_RING = "button that types a space at the participant's page"
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


@dataclass(frozen=True)
class Arm:
    """What the condition "ikns" needs.

    Parameters
    ----------
    subject : Path or None
    source, finger : str or None
        Addresses; without a finger nothing moves.
    session : Path or None
        Where its runs go; by default into the visit's folder.
    smooth : bool
    safe_state : str
    hold_speed : float or None
    view : bool
        Whether the panel shows the body.
    """

    subject: Path | None
    source: str | None
    finger: str | None
    session: Path | None
    smooth: bool
    safe_state: Literal["limp", "hold", "open"]
    hold_speed: float | None
    view: bool


@dataclass(frozen=True)
class Screens:
    """Where the pages are served."""

    host: str
    port: int
    browser: bool
    rate: float
    stick: str = "left"

    def __post_init__(self) -> None:
        """Refuse a rate that is none."""
        if not 0 < self.rate <= 1000:
            raise InvalidInput(
                f"expected a --rate above 0 and up to 1000 Hz, found {self.rate:g}."
            )


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
        from ikns.experiments.study import check_declared, read_study

        declared = read_study(study)
        check_declared(study, declared)
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
    make_desk: Callable[[Sequence[Mapping[str, Any]]], Desk],
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
    make_desk : callable
        Makes the experiment of the attempts that are there already.
    rest : float
        Of a break, s.
    seed : int
        Of a virtual operator.
    as_json : bool
    """
    from ikns.experiments.conduct import Conductor, HeldInput, VisitBook, carry_out
    from ikns.experiments.conduct.ring import ring_driver
    from ikns.view.cockpit import Cockpit, check_port

    virtual = "virtual" in conditions
    if virtual and len(conditions) > 1:
        raise InvalidInput(
            "expected people or the virtual operator in a visit, found "
            f"{', '.join(conditions)}."
        )
    subject = _subject(arm) if "ikns" in conditions else None
    _finger(arm)
    check_port(screens.host, screens.port)
    simulated = virtual or (subject is not None and _simulated(subject, arm))
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
            with _open_source(arm, subject):
                ikns.warm_up()
        book = VisitBook(
            who.folder,
            {
                "participant": who.participant,
                "simulated": simulated,
                "study": "" if who.study is None else who.study.name,
                "variation": "",
                "variation_settings": {},
                "participant_number": who.number,
                "seed": seed,
                "input": {name: _said(name, arm, screens) for name in conditions},
                "session": _relative(session, who.folder) if subject else None,
                "versions": software(),
            }
            | dict(about),
        )
        if who.study is not None:
            from ikns.experiments.study import keep_declared

            keep_declared(who.folder.parents[1], who.study)
        desk = make_desk(book.attempts)
        conductor = Conductor(
            desk,
            book,
            borne={*_PAGE, "ring"},
            rest=rest,
            auto=_VIRTUAL_WAIT if virtual else None,
        )
        held = {name: HeldInput() for name in _PAGE if name in conditions}
        drivers: Drivers = {}
        for name, one in held.items():
            drivers[name] = lambda one=one: nullcontext(one)  # type: ignore[misc]
        if virtual:
            drivers["virtual"] = lambda: nullcontext(
                _operator(desk, screens, who, seed)
            )
        if subject is not None:
            if arm.view:
                from ikns.view.scene import body_view

                window, take = stack.enter_context(
                    body_view(subject, simulated=simulated)
                )
                address = window.url
                shown.append(take)
            drivers["ikns"] = lambda: _live(arm, subject, session, who, shown)
        presses: SimpleQueue[None] = SimpleQueue()
        if "ring" in conditions:
            drivers["ring"] = lambda: ring_driver(presses, _finger(arm))
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
        carry_out(conductor, drivers, stop=stop, rate=screens.rate)
    _tell(who, conductor, as_json=as_json)


def _subject(arm: Arm) -> ikns.Subject:
    for name, value in (("--subject", arm.subject), ("--source", arm.source)):
        if value is None:
            raise InvalidInput(
                f"the condition ikns needs {name}, found none; other --conditions need "
                "nothing but a browser."
            )
    assert arm.subject is not None
    return ikns.Subject.load(arm.subject)


def _simulated(subject: ikns.Subject, arm: Arm) -> bool:
    assert arm.subject is not None
    assert arm.source is not None
    scheme, _, rest = arm.source.partition(":")
    played = [Path(rest.partition("?")[0])] if scheme == "replay" else []
    return is_simulated(subject, arm.subject, played)


def _open_source(arm: Arm, subject: ikns.Subject) -> AbstractContextManager[Source]:
    from ikns.stream import open_source

    assert arm.source is not None
    return open_source(arm.source, needs=subject.skeleton.marker_set)


def _live(
    arm: Arm,
    subject: ikns.Subject,
    session: Path,
    who: Whose,
    shown: Sequence[Callable[[Status], None]],
) -> AbstractContextManager[Driver]:
    from ikns.control.controller import Settings
    from ikns.experiments.conduct.live import live_driver

    settings = Settings(hold_speed=arm.hold_speed)

    def open_session(source: Source) -> AbstractContextManager[RunWriter]:
        assert arm.subject is not None
        return live_session(
            session,
            subject,
            arm.subject,
            {
                **software(),
                "source": arm.source,
                "source_labels": list(source.labels),
                "finger": arm.finger,
                "safe_state": arm.safe_state,
                "settings": dataclasses.asdict(settings),
            },
            rate=source.rate,
            participant=who.participant,
            resume=(session / "dataset_description.json").exists(),
        )

    def tell(status: Status) -> None:
        for one in shown:
            one(status)

    return live_driver(
        lambda: _open_source(arm, subject),
        subject,
        finger=_finger(arm),
        open_session=open_session,
        settings=settings,
        smooth=arm.smooth,
        on_status=tell if shown else None,
    )


def _finger(arm: Arm) -> Callable[[], Finger] | None:
    from ikns.finger import Safety, open_finger

    if arm.finger is None:
        return None
    address, safety = arm.finger, Safety(safe_state=arm.safe_state)
    open_finger(address, safety=safety)  # an address that is none is told now
    return lambda: open_finger(address, safety=safety)


def _operator(desk: Any, screens: Screens, who: Whose, seed: int) -> Driver:
    """Make a virtual operator with a stick, practised."""
    import numpy as np

    from ikns.experiments.conduct import VirtualInput
    from ikns.simulation.operator import Delay, Operator, typical

    rng = np.random.default_rng([seed, who.number])
    operator = Operator(typical("gamepad").practised(9), rate=screens.rate, seed=rng)
    return VirtualInput(operator, Delay(0.05, rate=screens.rate), desk.trial)


def _said(condition: str, arm: Arm, screens: Screens) -> str:
    """Say what drives a condition, for those who read the visit later."""
    if condition == "ikns":
        smooth = ", smoothed" if arm.smooth else ""
        return f"{arm.source}{smooth}"
    if condition == "gamepad":
        stick = "right trigger" if screens.stick == "trigger" else "left stick, up"
        return f"{_PAGE[condition]}, {stick}"
    if condition == "ring":
        return _RING
    return _PAGE.get(condition, f"{condition} operator")


def _relative(path: Path, folder: Path) -> str:
    import os.path

    return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()


def _tell(who: Whose, conductor: Conductor, *, as_json: bool) -> None:
    from ikns.experiments.statistics.wording import counted

    results, left = conductor.results, conductor.shown["left"]
    figures = "time" if conductor.desk.experiment == "picking" else "rmse"
    result = {
        "visit": who.folder,
        "participant": who.participant,
        "simulated": conductor.book.simulated,
        "left": left,
        "stopped": conductor.emergency.is_set(),
        "attempts": results,
    }
    title = f"Visit of participant {who.participant}"
    show(
        result,
        table(
            f"{title} (simulated)" if conductor.book.simulated else title,
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
