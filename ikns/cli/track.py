"""``ikns track``: experiment 1 with a person, in a browser."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from ikns.cli.options import AsJson
from ikns.cli.visit_drivers import Arm, Screens
from ikns.cli.visit_run import chosen, conduct, names, whose
from ikns.errors import InvalidInput

__all__ = ["track"]

_INPUTS = ("ikns", "gamepad", "keyboard", "mouse", "virtual")


def track(
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
        str | None,
        typer.Option(
            help="ikns, gamepad, keyboard, mouse, or virtual: who plays by itself "
            "[default: ikns,gamepad]."
        ),
    ] = None,
    profiles: Annotated[
        str | None, typer.Option(help="Curves [default: T1,T2,T3].")
    ] = None,
    repeats: Annotated[
        int | None, typer.Option(help="Of each curve in each condition [default: 3].")
    ] = None,
    training: Annotated[
        int | None, typer.Option(help="Trials before each condition [default: 10].")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help="Of a curve [default: 25].")
    ] = None,
    align: Annotated[
        float | None, typer.Option(help="Seconds before a curve [default: 5].")
    ] = None,
    rest: Annotated[
        float | None, typer.Option(help="Seconds between conditions [default: 120].")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Of the curves [default: 0].")
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
        str | None, typer.Option(help="For ikns: sim: or dynamixel:/dev/ttyUSB0.")
    ] = None,
    session: Annotated[
        Path | None,
        typer.Option(help="For ikns: where its runs go [default: in the visit]."),
    ] = None,
    smooth: Annotated[
        bool,
        typer.Option(
            "--smooth", help="The pointer shows the smoothed flexion, not c itself."
        ),
    ] = False,
    safe_state: Annotated[
        Literal["limp", "hold", "open"],
        typer.Option(help="What the finger does when poses fail to come."),
    ] = "limp",
    stick: Annotated[
        Literal["left", "trigger"],
        typer.Option(help="Of the gamepad: left stick, up, or right trigger."),
    ] = "left",
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
    rate: Annotated[
        float, typer.Option(help="How often a page's signal is written down, Hz.")
    ] = 100.0,
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
    """Follow curves with the arm's null space, a gamepad, keyboard or mouse.

    Two pages open: one for the participant, one for the experimenter. Every attempt is
    on disk when it ends; Ctrl-C breaks off, and the same command goes on.
    """
    from ikns.experiments.conduct import Desk, TrackingDesk
    from ikns.experiments.tracking import draw_profile, schedule

    who = whose(
        visit, study, experiment="tracking", participant=participant, number=number
    )
    given = {
        "conditions": None if conditions is None else names(conditions),
        "profiles": None if profiles is None else names(profiles),
        "repeats": repeats,
        "seed": seed,
        "seconds": seconds,
        "training": training,
        "rest": rest,
        "align": align,
    }
    before = dict(who.stored.get("design", {}))
    if "align" in who.stored:
        before["align"] = who.stored["align"]
    design = {
        name: chosen(given[name], before, name, default)
        for name, default in {
            "conditions": ["ikns", "gamepad"],
            "profiles": ["T1", "T2", "T3"],
            "repeats": 3,
            "seed": 0,
            "seconds": 25.0,
            "training": 10,
            "rest": 120.0,
            "align": 5.0,
        }.items()
    }
    if who.study is not None:
        design = _declared(who.study, given)
    wait = float(design.pop("align"))
    strangers = [name for name in design["conditions"] if name not in _INPUTS]
    if strangers:
        raise InvalidInput(
            f"expected conditions of {', '.join(_INPUTS)}, found '{strangers[0]}'."
        )
    if not 0 <= design["seed"] < 2**32:
        raise InvalidInput(
            f"expected a --seed from 0 to below 2**32, found {design['seed']}."
        )
    steps = schedule(who.number, **design)
    for step in steps:  # whatever is impossible is told before anything is written
        if step.kind != "rest":
            draw_profile(step.profile, step.seed, seconds=step.seconds)
    if not (0 <= wait < math.inf and 0 <= design["rest"] < math.inf):
        raise InvalidInput(
            f"expected --align and --rest from 0 s, found {wait:g} and "
            f"{design['rest']:g}."
        )

    def make_desk(rows: Sequence[Mapping[str, Any]]) -> Desk:
        return TrackingDesk(steps, rows, align=wait)

    conduct(
        who,
        Arm(
            subject,
            source,
            finger,
            session,
            smooth=smooth,
            safe_state=safe_state,
            hold_speed=None,
            view=view,
            realtime=realtime,
        ),
        Screens(host, port, browser, rate, stick),
        conditions=design["conditions"],
        about={"experiment": "tracking", "design": design, "align": wait},
        make_desk=make_desk,
        rest=float(design["rest"]),
        seed=int(design["seed"]),
        as_json=as_json,
    )


def _declared(study: Any, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the design of a study; nothing of it is chosen on the day."""
    if study.tracking is None:
        raise InvalidInput("expected a table [tracking] in the study file, found none.")
    chosen_anew = [name for name, value in given.items() if value is not None]
    if chosen_anew:
        raise InvalidInput(
            f"the study declares everything; expected no --{chosen_anew[0]} with "
            "--study."
        )
    design = dict(study.tracking.arguments(seed=study.seed))
    return design | {"align": study.tracking.align}
