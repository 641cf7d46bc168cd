"""Options of the teleoperator ``ikns``; lerobot finds the class by this file's name."""

from __future__ import annotations

from dataclasses import dataclass, field

from lerobot.teleoperators import TeleoperatorConfig

from ikns.live.control.settings import ControlSettings


@TeleoperatorConfig.register_subclass("ikns")
@dataclass(kw_only=True)
class IknsTeleoperatorConfig(TeleoperatorConfig):
    """Options ``--teleop.NAME`` of the teleoperator ``ikns``.

    Parameters
    ----------
    subject : str
        Folder of a calibrated subject.
    source : str
        As in ``ikns run --source``.
    joints : dict
        Values of each joint of the robot at flexion 0 and 1, in its units, as in
        ``{gripper.pos: [100, 0]}``. Without it an action is ``c`` and ``flexion``.
    safe_state : {"hold", "open"}
        What flexion does when poses stop coming.
    method, hold_speed, max_uncertainty
        As in ``ikns run``.
    """

    subject: str
    source: str
    joints: dict[str, list[float]] = field(default_factory=dict)
    safe_state: str = "hold"
    method: str = "paper"
    hold_speed: float | None = None
    max_uncertainty: float | None = ControlSettings.max_uncertainty
