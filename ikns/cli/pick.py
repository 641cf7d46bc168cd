"""``ikns pick``: experiment 2 with a person, its clock and its table in a browser."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from ikns.cli.options import AsJson
from ikns.cli.visit_drivers import Arm, Screens
from ikns.cli.visit_run import chosen, conduct, names, whose
from ikns.errors import InvalidInput

__all__ = ["pick"]

_INPUTS = ("ikns", "ring")


def pick(
    visit: Annotated[
        Path | None,
        typer.Argument(help="Folder of the visit; one that exists goes on."),
    ] = None,
    study: Annotated[
        Path | None,
        typer.Option(help="Study folder: design and place of the visit are its."),
    ] = None,
    participant: Annotated[
        str | None, typer.Option(help="Pseudonym, letters and digits [default: 01].")
    ] = None,
    number: Annotated[
        int | None,
        typer.Option(help="Participant's number from 0, which sets the order."),
    ] = None,
    conditions: Annotated[
        str | None, typer.Option(help="ikns, ring [default: ikns,ring].")
    ] = None,
    objects: Annotated[
        str | None,
        typer.Option(help="Codes of the paper's table, such as A,B, or all [default]."),
    ] = None,
    repeats: Annotated[
        int | None, typer.Option(help="Of each object in each condition [default: 1].")
    ] = None,
    training: Annotated[
        int | None, typer.Option(help="Objects before each condition [default: 10].")
    ] = None,
    limit: Annotated[
        float | None, typer.Option(help="Seconds for an object [default: 20].")
    ] = None,
    rest: Annotated[
        float | None, typer.Option(help="Seconds between conditions [default: 120].")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Of the orders [default: 0].")
    ] = None,
    subject: Annotated[
        Path | None, typer.Option(help="For ikns: folder that `ikns calibrate` wrote.")
    ] = None,
    source: Annotated[
        str | None,
        typer.Option(
            help="For ikns: replay:FILE, lsl:NAME, qualisys:HOST or vicon:HOST."
        ),
    ] = None,
    finger: Annotated[
        str, typer.Option(help="sim: or dynamixel:/dev/ttyUSB0.")
    ] = "sim:",
    session: Annotated[
        Path | None,
        typer.Option(help="For ikns: where its runs go [default: in the visit]."),
    ] = None,
    safe_state: Annotated[
        Literal["limp", "hold", "open"],
        typer.Option(help="What the finger does when poses fail to come."),
    ] = "limp",
    hold_speed: Annotated[
        float | None,
        typer.Option(help="For ikns: hold the finger while the hand is faster, m/s."),
    ] = None,
    view: Annotated[
        bool, typer.Option("--view/--no-view", help="Show the body on the panel.")
    ] = True,
    realtime: Annotated[
        bool,
        typer.Option(
            "--realtime",
            help="For ikns: before other programs, where the system allows it.",
        ),
    ] = False,
    host: Annotated[
        str,
        typer.Option(
            help="Address to serve the pages at; any but this machine's own needs the "
            "token in the address that is printed, and is not encrypted."
        ),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="0 takes a free one.")] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the pages.")
    ] = True,
    as_json: AsJson = False,
) -> None:
    """Pick objects up and put them down with the robot finger, against the clock.

    Two pages open: one for the participant, one for the experimenter, who starts and
    stops the clock and says how it went. The ring button is a key: one that types a
    space on the participant's page. Every attempt is on disk when it ends; Ctrl-C
    breaks off, and the same command goes on.
    """
    from ikns.experiments.conduct import Desk, PickingDesk
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

    def make_desk(rows: Sequence[Mapping[str, Any]]) -> Desk:
        return PickingDesk(steps, rows)

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
        make_desk=make_desk,
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
