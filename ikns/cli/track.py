"""``ikns track``: experiment 1 with a person, in a browser."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import typer

from ikns.cli.live_session import timeline_of
from ikns.cli.options import (
    AsJson,
    Fingers,
    LabelFile,
    Publish,
    Rename,
    Rerun,
    Rrd,
)
from ikns.cli.reading import label_names
from ikns.cli.visit import conduct
from ikns.cli.visit_drivers import ArmOptions, PageOptions
from ikns.cli.visit_identity import find_visit, resolve_design, split_names
from ikns.cli.visit_options import (
    Browser,
    ForIkns,
    FromStudy,
    Host,
    LiveMethod,
    MaxUncertainty,
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

_INPUTS = ("ikns", "gamepad", "keyboard", "mouse", "virtual")
#: Design of experiment 1 of the paper.
_DEFAULTS = {
    "conditions": ["ikns", "gamepad"],
    "profiles": ["T1", "T2", "T3"],
    "repeats": 3,
    "seed": 0,
    "seconds": 25.0,
    "training": 10,
    "rest": 120.0,
    "align": 5.0,
}


def track(
    visit: VisitFolder = None,
    study: FromStudy = None,
    participant: Participant = None,
    number: Number = None,
    conditions: Annotated[
        str | None,
        typer.Option(
            help="ikns, gamepad, keyboard, mouse, separated by commas; or virtual, a "
            "simulated operator.",
            show_default="ikns,gamepad",
        ),
    ] = None,
    profiles: Annotated[
        str | None,
        typer.Option(help="Reference trajectories.", show_default="T1,T2,T3"),
    ] = None,
    repeats: Annotated[
        int | None,
        typer.Option(
            help="Repetitions of each trajectory in each condition.",
            show_default="3",
            min=1,
            max=1000,
        ),
    ] = None,
    training: Annotated[
        int | None,
        typer.Option(
            help="Training trials before each condition.",
            show_default="10",
            min=0,
            max=1000,
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            help="Length of each trajectory, s.",
            show_default="25",
            min=12.0,
            max=3600.0,
        ),
    ] = None,
    align: Annotated[
        float | None,
        typer.Option(
            help="Time to reach the start of each trajectory, s.",
            show_default="5",
            min=0.0,
            max=3600.0,
        ),
    ] = None,
    rest: Rest = None,
    seed: Annotated[
        int | None,
        typer.Option(
            help="Seed of the trajectories.", show_default="0", min=0, max=2**32 - 1
        ),
    ] = None,
    subject: ForIkns = None,
    source: SourceAddress = None,
    rename: Rename = None,
    labels: LabelFile = None,
    finger: Fingers = None,
    session: SessionFolder = None,
    smooth: Annotated[
        bool,
        typer.Option("--smooth", help="Show the smoothed flexion instead of c."),
    ] = False,
    safe_state: SafeState = "limp",
    stick: Annotated[
        Literal["left", "trigger"],
        typer.Option(help="Gamepad input: left stick, up, or right trigger."),
    ] = "left",
    publish: Publish = None,
    rerun: Rerun = False,
    rrd: Rrd = None,
    view: View = True,
    method: LiveMethod = "paper",
    max_uncertainty: MaxUncertainty = 0.025,
    realtime: Realtime = False,
    rate: Annotated[
        float,
        typer.Option(
            help="Rate at which a page's control signal is recorded, Hz.",
            min=0.0,
            max=1000.0,
        ),
    ] = 100.0,
    host: Host = "127.0.0.1",
    port: Port = 0,
    browser: Browser = True,
    as_json: AsJson = False,
) -> None:
    """Follow trajectories with the arm's null space, a gamepad, keyboard or mouse.

    Two pages open: one for the participant, one for the experimenter. Every attempt is
    saved when it ends; after Ctrl-C the same command continues the visit.
    """
    identity = find_visit(
        visit, study, experiment="tracking", participant=participant, number=number
    )
    design = resolve_design(
        identity,
        {
            "conditions": None if conditions is None else split_names(conditions),
            "profiles": None if profiles is None else split_names(profiles),
            "repeats": repeats,
            "seed": seed,
            "seconds": seconds,
            "training": training,
            "rest": rest,
            "align": align,
        },
        _DEFAULTS,
        inputs=_INPUTS,
    )

    from ikns.experiments.conduct import Experiment, TrackingExperiment
    from ikns.experiments.tracking import draw_profile, schedule

    wait = float(design.pop("align"))
    if not 0 <= design["seed"] < 2**32:
        raise InvalidInput(
            f"expected a --seed from 0 to below 2**32, found {design['seed']}."
        )
    steps = schedule(identity.number, **design)
    for step in steps:  # an impossible profile is refused before anything is written
        if step.kind != "rest":
            draw_profile(step.profile, step.seed, seconds=step.seconds)
    if not (0 <= wait < math.inf and 0 <= design["rest"] < math.inf):
        raise InvalidInput(
            f"expected --align and --rest from 0 s, found {wait:g} and "
            f"{design['rest']:g}."
        )

    def make_experiment(rows: Sequence[Mapping[str, Any]]) -> Experiment:
        return TrackingExperiment(steps, rows, align=wait)

    conduct(
        identity,
        ArmOptions(
            subject,
            source,
            tuple(finger or ()),
            session,
            smooth=smooth,
            safe_state=safe_state,
            hold_speed=None,
            view=view,
            realtime=realtime,
            method=method,
            names=label_names(rename, labels, source),
            publish=publish,
            timeline=timeline_of(rerun=rerun, rrd=rrd),
            max_uncertainty=max_uncertainty,
        ),
        PageOptions(host, port, browser, rate, stick),
        conditions=design["conditions"],
        about={"experiment": "tracking", "design": design, "align": wait},
        make_experiment=make_experiment,
        rest=float(design["rest"]),
        seed=int(design["seed"]),
        as_json=as_json,
    )
