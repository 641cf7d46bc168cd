"""``ikns pick``: experiment 2 with a person, its clock and its table in a browser."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import typer

from ikns.cli.options import AsJson
from ikns.cli.visit import chosen, conduct, names, whose
from ikns.cli.visit_drivers import Arm, Screens
from ikns.cli.visit_options import (
    Browser,
    ForIkns,
    FromStudy,
    Host,
    Number,
    Participant,
    Port,
    Realtime,
    Rest,
    SafeState,
    SessionFolder,
    SourceAddress,
    View,
    VisitFolder,
)
from ikns.errors import InvalidInput

__all__ = ["pick"]

_INPUTS = ("ikns", "ring")


def pick(
    visit: VisitFolder = None,
    study: FromStudy = None,
    participant: Participant = None,
    number: Number = None,
    conditions: Annotated[
        str | None, typer.Option(help="ikns, ring.", show_default="ikns,ring")
    ] = None,
    objects: Annotated[
        str | None,
        typer.Option(
            help="Codes of the paper's table, such as A,B, or all.", show_default="all"
        ),
    ] = None,
    repeats: Annotated[
        int | None,
        typer.Option(help="Of each object in each condition.", show_default="1"),
    ] = None,
    training: Annotated[
        int | None,
        typer.Option(help="Objects before each condition.", show_default="10"),
    ] = None,
    limit: Annotated[
        float | None, typer.Option(help="Seconds for an object.", show_default="20")
    ] = None,
    rest: Rest = None,
    seed: Annotated[
        int | None, typer.Option(help="Of the orders.", show_default="0")
    ] = None,
    subject: ForIkns = None,
    source: SourceAddress = None,
    finger: Annotated[
        str, typer.Option(help="sim: or dynamixel:/dev/ttyUSB0.")
    ] = "sim:",
    session: SessionFolder = None,
    safe_state: SafeState = "limp",
    hold_speed: Annotated[
        float | None,
        typer.Option(help="For ikns: hold the finger while the hand is faster, m/s."),
    ] = None,
    view: View = True,
    realtime: Realtime = False,
    host: Host = "127.0.0.1",
    port: Port = 0,
    browser: Browser = True,
    as_json: AsJson = False,
) -> None:
    """Pick objects up and put them down with the robot finger, against the clock.

    Two pages open: one for the participant, one for the experimenter, who starts and
    stops the clock and says how it went. The ring button is a key: one that types a
    space on the participant's page. Every attempt is on disk when it ends; Ctrl-C
    breaks off, and the same command goes on.
    """
    from ikns.experiments.conduct import Experiment, PickingExperiment
    from ikns.experiments.picking import OBJECT_IDS, pick_schedule

    who = whose(
        visit, study, experiment="picking", participant=participant, number=number
    )
    codes = list(OBJECT_IDS) if objects == "all" else names(objects or "")
    given = {
        "conditions": None if conditions is None else names(conditions),
        "objects": None if objects is None else codes,
        "repeats": repeats,
        "seed": seed,
        "limit": limit,
        "training": training,
        "rest": rest,
    }
    before = who.stored.get("design", {})
    design = {
        name: chosen(given[name], before, name, default)
        for name, default in {
            "conditions": ["ikns", "ring"],
            "objects": list(OBJECT_IDS),
            "repeats": 1,
            "seed": 0,
            "limit": 20.0,
            "training": 10,
            "rest": 120.0,
        }.items()
    }
    if who.study is not None:
        design = _declared(who.study, given)
    strangers = [name for name in design["conditions"] if name not in _INPUTS]
    if strangers:
        raise InvalidInput(
            f"expected conditions of {', '.join(_INPUTS)}, found '{strangers[0]}'."
        )
    steps = pick_schedule(who.number, **design)

    def make_experiment(rows: Sequence[Mapping[str, Any]]) -> Experiment:
        return PickingExperiment(steps, rows)

    conduct(
        who,
        Arm(
            subject,
            source,
            finger,
            session,
            smooth=False,
            safe_state=safe_state,
            hold_speed=hold_speed,
            view=view,
            realtime=realtime,
        ),
        Screens(host, port, browser, 100.0),
        conditions=design["conditions"],
        about={"experiment": "picking", "design": design},
        make_experiment=make_experiment,
        rest=float(design["rest"]),
        seed=int(design["seed"]),
        as_json=as_json,
    )


def _declared(study: Any, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the design of a study; nothing of it is chosen on the day."""
    if study.picking is None:
        raise InvalidInput("expected a table [picking] in the study file, found none.")
    chosen_anew = [name for name, value in given.items() if value is not None]
    if chosen_anew:
        raise InvalidInput(
            f"the study declares everything; expected no --{chosen_anew[0]} with "
            "--study."
        )
    return dict(study.picking.arguments(seed=study.seed))
