"""Robots of lerobot by type, with the options that their configuration has."""

from __future__ import annotations

import importlib
import pkgutil
from contextlib import suppress
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from ikns.errors import InvalidInput
from ikns.finger.errors import FingerError

if TYPE_CHECKING:
    from ikns.finger.lerobot_joint import RobotDevice


def make_robot(kind: str, options: dict[str, str]) -> RobotDevice:
    """Make a robot of lerobot, not connected.

    Parameters
    ----------
    kind : str
        Type of the robot, as in ``lerobot-teleoperate --robot.type``.
    options : dict of str
        Fields of its configuration, as on lerobot's command line, such as `port` and
        `id`.

    Raises
    ------
    FingerError
        When lerobot is not installed.
    InvalidInput
        When lerobot has no such robot, or its configuration no such field.
    """
    RobotConfig, make = _lerobot()
    known: dict[str, Any] = RobotConfig.get_known_choices()
    if kind not in known:
        raise InvalidInput(
            f"lerobot has no robot '{kind}', expected one of {', '.join(sorted(known))}"
            "; a plug-in of your own has to be installed."
        )
    names = [field.name for field in fields(known[kind])]
    for name in options:
        if name not in names:
            raise InvalidInput(
                f"the robot '{kind}' of lerobot has no option '{name}', expected "
                f"{', '.join(names)}."
            )
    import draccus
    import yaml  # type: ignore[import-untyped]

    try:
        values = {name: yaml.safe_load(text) for name, text in options.items()}
        config = draccus.decode(known[kind], values)
        robot: RobotDevice = make(config)
    # Configurations check themselves in their own ways.
    except Exception as error:
        lines = str(error).strip().splitlines() or [type(error).__name__]
        raise InvalidInput(
            f"lerobot refuses the robot '{kind}': "
            f"{lines[0].rstrip('.').replace('. ', '; ')}."
        ) from None
    return robot


def _lerobot() -> tuple[Any, Any]:
    """Import lerobot with all robots that can be imported; return config and maker."""
    try:
        from lerobot import robots
        from lerobot.utils.import_utils import register_third_party_plugins
    except ImportError as error:
        raise FingerError(
            "a finger lerobot:TYPE needs lerobot 0.4: pip install 'ikns[lerobot]' "
            f"({error})."
        ) from None
    for module in pkgutil.iter_modules(robots.__path__):
        if module.ispkg:
            with suppress(ImportError):  # some need a library of their own
                importlib.import_module(f"lerobot.robots.{module.name}")
    register_third_party_plugins()
    return robots.RobotConfig, robots.make_robot_from_config
