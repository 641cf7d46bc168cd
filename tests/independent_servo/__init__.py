"""A Dynamixel servo that shares no line with the package, for tests of the package.

Written from ROBOTIS's e-Manual. It imports nothing from ``ikns`` and nothing of
ROBOTIS's SDK, and runs in a process of its own (:mod:`independent_servo.process`).
"""
