"""The teleoperator ``ikns`` of lerobot."""

from __future__ import annotations

import logging
from typing import Any

from lerobot.teleoperators import Teleoperator
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError

from ikns.finger import Safety
from ikns.live.control.settings import ControlSettings
from ikns.live.lerobot.action import action, action_names, check_joints
from ikns.live.lerobot.config_teleoperator import IknsTeleoperatorConfig
from ikns.live.lerobot.signal import LiveSignal


class IknsTeleoperator(Teleoperator):
    """A person's arm as a teleoperator of lerobot.

    Parameters
    ----------
    config : IknsTeleoperatorConfig
    """

    config_class = IknsTeleoperatorConfig
    name = "ikns"

    def __init__(self, config: IknsTeleoperatorConfig) -> None:
        super().__init__(config)
        self.config = config
        check_joints(config.joints)
        self._signal = LiveSignal(
            config.subject,
            config.source,
            settings=ControlSettings(
                method=config.method,  # type: ignore[arg-type]
                hold_speed=config.hold_speed,
                max_uncertainty=config.max_uncertainty,
            ),
            safety=Safety(safe_state=config.safe_state),  # type: ignore[arg-type]
            tell=logging.getLogger(__name__).warning,
        )
        self._connected = False

    @property
    def action_features(self) -> dict[str, type]:
        """Names and types of an action."""
        return dict.fromkeys(action_names(self.config.joints), float)

    @property
    def feedback_features(self) -> dict[str, type]:
        """Nothing is fed back."""
        return {}

    @property
    def is_connected(self) -> bool:
        """Whether it was connected."""
        return self._connected

    @property
    def is_calibrated(self) -> bool:
        """Always: the subject is, by ``ikns calibrate``."""
        return True

    def connect(self, calibrate: bool = True) -> None:
        """Open the source and wait for a first frame that counts."""
        if self._connected:
            raise DeviceAlreadyConnectedError(f"{self} is already connected.")
        self._signal.start()
        self._connected = True

    def calibrate(self) -> None:
        """Do nothing: ``ikns calibrate`` does it."""

    def configure(self) -> None:
        """Do nothing."""

    def get_action(self) -> dict[str, float]:
        """Return the latest action.

        It stays as it is while frames do not count, in the safe state ``hold`` and
        after the source has ended; an error of the loop is raised here.
        """
        if not self._connected:
            raise DeviceNotConnectedError(f"{self} is not connected.")
        return action(*self._signal.latest(), self.config.joints)

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Do nothing."""

    def arm_again(self) -> None:
        """Leave the safe state, from the flexion it has and from rest."""
        self._signal.arm_again()

    def disconnect(self) -> None:
        """Close the source."""
        self._signal.stop()
        self._connected = False
