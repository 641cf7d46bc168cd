"""``ikns pick``: experiment 2 with a person, clock and results in a browser."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

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

_INPUTS = ("ikns", "ring")
#: Design of experiment 2 of the paper.
_DEFAULTS = {
    "conditions": ["ikns", "ring"],
    "objects": "all",
    "repeats": 1,
    "seed": 0,
    "limit": 20.0,
    "training": 10,
    "rest": 120.0,
}
#: How often the control signal of a page is recorded, Hz.
_RATE = 100.0


def pick(
    visit: VisitFolder = None,
    study: FromStudy = None,
    participant: Participant = None,
    number: Number = None,
    conditions: Annotated[
        str | None,
        typer.Option(
            help="ikns, ring, separated by a comma.", show_default="ikns,ring"
        ),
    ] = None,
    objects: Annotated[
        str | None,
        typer.Option(
            help="Codes of objects in the paper's table, such as A,B, or all.",
            show_default="all",
        ),
    ] = None,
    repeats: Annotated[
        int | None,
        typer.Option(
            help="Repetitions of each object in each condition.",
            show_default="1",
            min=1,
            max=1000,
        ),
    ] = None,
    training: Annotated[
        int | None,
        typer.Option(
            help="Training objects before each condition.",
            show_default="10",
            min=0,
            max=1000,
        ),
    ] = None,
    limit: Annotated[
        float | None,
        typer.Option(
            help="Time limit for an object, s.", show_default="20", min=0.0, max=3600.0
        ),
    ] = None,
    rest: Rest = None,
    seed: Annotated[
        int | None,
        typer.Option(
            help="Seed of the order of objects.", show_default="0", min=0, max=2**32 - 1
        ),
    ] = None,
    subject: ForIkns = None,
    source: SourceAddress = None,
    rename: Rename = None,
    labels: LabelFile = None,
    finger: Fingers = None,
    session: SessionFolder = None,
    safe_state: SafeState = "limp",
    hold_speed: Annotated[
        float | None,
        typer.Option(
            help="For ikns: hold the finger while the hand is faster than this, m/s.",
            min=0.0,
            max=100.0,
        ),
    ] = None,
    publish: Publish = None,
    rerun: Rerun = False,
    rrd: Rrd = None,
    view: View = True,
    method: LiveMethod = "paper",
    max_uncertainty: MaxUncertainty = 0.025,
    realtime: Realtime = False,
    host: Host = "127.0.0.1",
    port: Port = 0,
    browser: Browser = True,
    as_json: AsJson = False,
) -> None:
    """Pick objects up and put them down with the robot finger, against the clock.

    Two pages open: one for the participant, one for the experimenter, who starts and
    stops the clock and records the outcome. The ring button is a key that types a space
    on the participant's page. Every attempt is saved when it ends; after Ctrl-C the
    same command continues the visit.
    """
    identity = find_visit(
        visit, study, experiment="picking", participant=participant, number=number
    )
    from ikns.experiments.picking import OBJECT_IDS, pick_schedule

    every = list(OBJECT_IDS)
    codes = every if objects == "all" else split_names(objects or "")
    design = resolve_design(
        identity,
        {
            "conditions": None if conditions is None else split_names(conditions),
            "objects": None if objects is None else codes,
            "repeats": repeats,
            "seed": seed,
            "limit": limit,
            "training": training,
            "rest": rest,
        },
        _DEFAULTS | {"objects": every},
        inputs=_INPUTS,
    )

    from ikns.experiments.conduct import Experiment, PickingExperiment

    steps = pick_schedule(identity.number, **design)

    def make_experiment(rows: Sequence[Mapping[str, Any]]) -> Experiment:
        return PickingExperiment(steps, rows)

    conduct(
        identity,
        ArmOptions(
            subject,
            source,
            tuple(finger or ("sim:",)),
            session,
            smooth=False,
            safe_state=safe_state,
            hold_speed=hold_speed,
            view=view,
            realtime=realtime,
            method=method,
            names=label_names(rename, labels, source),
            publish=publish,
            timeline=timeline_of(rerun=rerun, rrd=rrd),
            max_uncertainty=max_uncertainty,
        ),
        PageOptions(host, port, browser, _RATE),
        conditions=design["conditions"],
        about={"experiment": "picking", "design": design},
        make_experiment=make_experiment,
        rest=float(design["rest"]),
        seed=int(design["seed"]),
        as_json=as_json,
    )
