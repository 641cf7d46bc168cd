"""What provides the control signal of a visit: the arm, a page or a ring button."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import ikns
from ikns.cli.live_session import Timeline, live_session, software, written
from ikns.errors import InvalidInput

if TYPE_CHECKING:
    from ikns.experiments.conduct import Driver
    from ikns.finger import Finger, FingerGroup
    from ikns.live.publish import Publishers
    from ikns.live.runtime import LoopStatus
    from ikns.live.session import RunWriter
    from ikns.live.stream import Source

#: Inputs that come from the participant's page, and their descriptions.
PAGE = {
    "gamepad": "gamepad at the participant's page",
    "keyboard": "keyboard at the participant's page, 0.5 per second",
    "mouse": "mouse at the participant's page",
}
_RING = "button that types a space at the participant's page"


@dataclass(frozen=True)
class ArmOptions:
    """Options of the condition "ikns".

    Parameters
    ----------
    subject : Path or None
    source : str or None
    fingers : tuple of str
        Addresses; without a finger nothing moves.
    session : Path or None
        Folder of its runs; by default in the visit's folder.
    smooth : bool
    safe_state : str
    hold_speed : float or None
    view : bool
        Whether the panel shows the body.
    realtime : bool
        Whether the control loop has real-time priority.
    method : {"paper", "proximal", "intent"}
        What reads c off the posture.
    names : dict
        Other labels for markers of the source, new by old.
    publish : list of str or None
        Where signals and events are published.
    timeline : Timeline or None
        Where they are logged for Rerun.
    max_uncertainty : float
        Largest standard deviation of c with which the finger moves.
    """

    subject: Path | None
    source: str | None
    fingers: tuple[str, ...]
    session: Path | None
    smooth: bool
    safe_state: Literal["limp", "hold", "open"]
    hold_speed: float | None
    view: bool
    realtime: bool
    method: Literal["paper", "proximal", "intent"]
    names: dict[str, str]
    max_uncertainty: float
    publish: list[str] | None = None
    timeline: Timeline | None = None


@dataclass(frozen=True)
class PageOptions:
    """Where and how the pages are served."""

    host: str
    port: int
    browser: bool
    rate: float
    stick: str = "left"

    def __post_init__(self) -> None:
        """Refuse a rate outside the range."""
        if not 0 < self.rate <= 1000:
            raise InvalidInput(
                f"expected a --rate above 0 and up to 1000 Hz, found {self.rate:g}."
            )


def arm_subject(arm: ArmOptions) -> ikns.Subject:
    """Load the subject.

    Raises
    ------
    InvalidInput
        Without a subject or a source, when the subject lacks the method, or when the
        system does not allow real time.
    """
    from ikns.live.runtime import check_realtime

    for name, value in (("--subject", arm.subject), ("--source", arm.source)):
        if value is None:
            raise InvalidInput(
                f"the condition ikns needs {name}; the other --conditions need only a "
                "browser."
            )
    assert arm.subject is not None
    if arm.realtime:
        check_realtime()
    subject = ikns.Subject.load(arm.subject)
    subject.readout(arm.method)  # before a source or a finger is opened
    return subject


def arm_is_simulated(subject: ikns.Subject, arm: ArmOptions) -> bool:
    """Whether the subject, or the recording that is played, is simulated."""
    from ikns.calibration.simulated import is_simulated, played_files

    assert arm.subject is not None
    assert arm.source is not None
    return is_simulated(subject, arm.subject, played_files(arm.source))


def open_arm_source(
    arm: ArmOptions, subject: ikns.Subject
) -> AbstractContextManager[Source]:
    """Connect to the source; its markers and their size must be the subject's."""
    from ikns.live.stream import open_source

    assert arm.source is not None
    return open_source(arm.source, subject=subject, names=arm.names)


def arm_driver(
    arm: ArmOptions,
    subject: ikns.Subject,
    session: Path,
    participant: str,
    shown: Sequence[Callable[[LoopStatus], None]],
    losses: list[str],
    publisher: Publishers | None = None,
) -> AbstractContextManager[Driver]:
    """Run the live loop as driver, with a session of its own.

    Every status goes to each callable in `shown`; what is missing on disk in the end is
    added to `losses`. A publisher hears of every frame and event.
    """
    from ikns.experiments.conduct.live import live_driver
    from ikns.live.control.settings import ControlSettings

    settings = ControlSettings(
        hold_speed=arm.hold_speed,
        method=arm.method,
        max_uncertainty=arm.max_uncertainty,
        dofs=driven_dofs(arm, subject),
    )

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
                "renamed": arm.names,
                "finger": written(arm.fingers),
                "safe_state": arm.safe_state,
                "publish": arm.publish,
                "settings": settings.table(),
            },
            rate=source.rate,
            participant=participant,
            resume=(session / "dataset_description.json").exists(),
            losses=losses,
        )

    def tell(status: LoopStatus) -> None:
        for one in shown:
            one(status)

    return live_driver(
        lambda: open_arm_source(arm, subject),
        subject,
        finger=fingers_opener(arm, subject.null_space_map.n_dof),
        open_session=open_session,
        settings=settings,
        smooth=arm.smooth,
        on_status=tell if shown else None,
        listener=publisher,
        realtime=arm.realtime,
    )


def fingers_opener(
    arm: ArmOptions, n_dof: int | None = None
) -> Callable[[], FingerGroup] | None:
    """Return a callable that opens the fingers, or None without any.

    Nothing is connected yet, but the addresses are checked, against the freedoms of a
    map where one is known.
    """
    from ikns.finger import Safety, open_fingers

    if not arm.fingers:
        return None
    safety = Safety(safe_state=arm.safe_state)
    open_fingers(arm.fingers, n_dof=n_dof, safety=safety)
    return lambda: open_fingers(arm.fingers, n_dof=n_dof, safety=safety)


def driven_dofs(arm: ArmOptions, subject: ikns.Subject) -> tuple[int, ...]:
    """Return which freedoms of the map are followed; the first where no finger is."""
    opener = fingers_opener(arm, subject.null_space_map.n_dof)
    return opener().dofs if opener else (1,)


def ring_finger(arm: ArmOptions) -> Callable[[], Finger] | None:
    """Return a callable that opens the finger of the ring button: the first."""
    opener = fingers_opener(arm)
    return None if opener is None else lambda: opener().fingers[0]


def describe_input(condition: str, arm: ArmOptions, pages: PageOptions) -> str:
    """Describe the input of a condition, for ``visit.json``."""
    if condition == "ikns":
        smooth = ", smoothed" if arm.smooth else ""
        method = f", {arm.method}" if arm.method != "paper" else ""
        return f"{arm.source}{smooth}{method}"
    if condition == "gamepad":
        stick = "right trigger" if pages.stick == "trigger" else "left stick, up"
        return f"{PAGE[condition]}, {stick}"
    if condition == "ring":
        return _RING
    return PAGE.get(condition, f"{condition} operator")
