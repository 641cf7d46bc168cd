"""Intrinsic kinematic null space: learned from a person, driving a wearable robot.

The names below load on first use, so importing the package costs next to nothing.
Their one list is the stub beside this file.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
