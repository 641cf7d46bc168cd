"""The teleoperator ``ikns`` of lerobot, which finds it by this module's name."""

from ikns.live.lerobot.teleoperator import IknsTeleoperator, IknsTeleoperatorConfig

__all__ = ["IknsTeleoperator", "IknsTeleoperatorConfig"]
