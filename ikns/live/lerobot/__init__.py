"""The control signal as a teleoperator of lerobot.

``teleoperator`` and ``config_teleoperator`` import lerobot; ``signal`` and ``action``
do the work without it. lerobot finds plug-ins by the name of an installed
*distribution* (``lerobot_teleoperator_...``), not of a module, so a second module in
the wheel of ikns would not be found. The folder ``plugin`` is such a distribution, of
one module that imports these. Without it, lerobot is told where the teleoperator is
with ``--teleop.discover_packages_path=ikns.live.lerobot``.
"""
