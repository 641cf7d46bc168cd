"""Three methods to read c off a motion: the paper's, proximal, and intent.

`coordinates` says what each reads, `intent` is the map that measures what a person
means, `readout` one interface to all; `ikns.calibration.readouts` fits them.
"""

from ikns.nullspace.readout.coordinates import METHODS, Method, readout_samples
from ikns.nullspace.readout.intent import IntentMap
from ikns.nullspace.readout.readout import Readout

__all__ = ["METHODS", "IntentMap", "Method", "Readout", "readout_samples"]
