"""The teleoperator ``ikns`` of lerobot, which finds it by this module's name."""

from ikns.live.lerobot.config_teleoperator import IknsTeleoperatorConfig
from ikns.live.lerobot.teleoperator import IknsTeleoperator

__all__ = ["IknsTeleoperator", "IknsTeleoperatorConfig"]
