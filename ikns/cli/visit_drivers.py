"""What drives a visit: the arm, a page, a ring button or a virtual operator."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import ikns
from ikns.cli.live_session import live_session, software
from ikns.cli.simulated import is_simulated
from ikns.errors import InvalidInput

if TYPE_CHECKING:
    from ikns.experiments.conduct import Driver
    from ikns.finger import Finger
    from ikns.live.runtime import Status
    from ikns.live.session import RunWriter
    from ikns.live.stream import Source

__all__ = [
    "PAGE",
    "Arm",
    "Screens",
    "arm_driver",
    "arm_is_simulated",
    "arm_subject",
    "finger_opener",
    "input_said",
    "open_arm_source",
    "virtual_driver",
]

#: What a page can drive, and how the visit names it.
PAGE = {
    "gamepad": "gamepad at the participant's page",
    "keyboard": "keyboard at the participant's page, 0.5 per second",
    "mouse": "mouse at the participant's page",
}
_RING = "button that types a space at the participant's page"


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
    realtime : bool
        Whether its loop runs before other programs.
    """

    subject: Path | None
    source: str | None
    finger: str | None
    session: Path | None
    smooth: bool
    safe_state: Literal["limp", "hold", "open"]
    hold_speed: float | None
    view: bool
    realtime: bool


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


def arm_subject(arm: Arm) -> ikns.Subject:
    """Load whose arm it is.

    Raises
    ------
    InvalidInput
        Without a subject or a source, or when the system does not allow real time.
    """
    from ikns.live.runtime import check_realtime

    for name, value in (("--subject", arm.subject), ("--source", arm.source)):
        if value is None:
            raise InvalidInput(
                f"the condition ikns needs {name}, found none; other --conditions need "
                "nothing but a browser."
            )
    assert arm.subject is not None
    if arm.realtime:
        check_realtime()
    return ikns.Subject.load(arm.subject)


def arm_is_simulated(subject: ikns.Subject, arm: Arm) -> bool:
    """Whether the subject, or the recording that is played, is simulated."""
    assert arm.subject is not None
    assert arm.source is not None
    scheme, _, rest = arm.source.partition(":")
    played = [Path(rest.partition("?")[0])] if scheme == "replay" else []
    return is_simulated(subject, arm.subject, played)


def open_arm_source(arm: Arm, subject: ikns.Subject) -> AbstractContextManager[Source]:
    """Connect to where markers come from; all that the subject has must be there."""
    from ikns.live.stream import open_source

    assert arm.source is not None
    return open_source(arm.source, needs=subject.skeleton.marker_set)


def arm_driver(
    arm: Arm,
    subject: ikns.Subject,
    session: Path,
    participant: str,
    shown: Sequence[Callable[[Status], None]],
) -> AbstractContextManager[Driver]:
    """Make the live loop drive, with a session of its own; every status is shown."""
    from ikns.experiments.conduct.live import live_driver
    from ikns.live.control.settings import Settings

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
            participant=participant,
            resume=(session / "dataset_description.json").exists(),
        )

    def tell(status: Status) -> None:
        for one in shown:
            one(status)

    return live_driver(
        lambda: open_arm_source(arm, subject),
        subject,
        finger=finger_opener(arm),
        open_session=open_session,
        settings=settings,
        smooth=arm.smooth,
        on_status=tell if shown else None,
        realtime=arm.realtime,
    )


def finger_opener(arm: Arm) -> Callable[[], Finger] | None:
    """Return what makes the finger, if there is one; nothing is connected yet."""
    from ikns.finger import Safety, open_finger

    if arm.finger is None:
        return None
    address, safety = arm.finger, Safety(safe_state=arm.safe_state)
    open_finger(address, safety=safety)  # an address that is none is told now
    return lambda: open_finger(address, safety=safety)


def virtual_driver(experiment: Any, *, rate: float, seed: Sequence[int]) -> Driver:
    """Make a virtual operator with a stick, practised."""
    import numpy as np

    from ikns.experiments.conduct import VirtualInput
    from ikns.simulation.operator import Delay, Operator, typical

    rng = np.random.default_rng(seed)
    operator = Operator(typical("gamepad").practised(9), rate=rate, seed=rng)
    return VirtualInput(operator, Delay(0.05, rate=rate), experiment.trial)


def input_said(condition: str, arm: Arm, screens: Screens) -> str:
    """Say what drives a condition, for those who read the visit later."""
    if condition == "ikns":
        smooth = ", smoothed" if arm.smooth else ""
        return f"{arm.source}{smooth}"
    if condition == "gamepad":
        stick = "right trigger" if screens.stick == "trigger" else "left stick, up"
        return f"{PAGE[condition]}, {stick}"
    if condition == "ring":
        return _RING
    return PAGE.get(condition, f"{condition} operator")
