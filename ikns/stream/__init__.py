"""Live sources of markers: a recording, LSL, Qualisys or Vicon, all read alike.

A source is an iterator of frames and a context manager. What went wrong on the way is
counted (:class:`Continuity`) and told (``events``), never hidden.
"""

from ikns.stream.address import open_source
from ikns.stream.broadcast import Broadcast, broadcast
from ikns.stream.continuity import Continuity, Counts
from ikns.stream.faults import Faults, inject
from ikns.stream.frame import Event, Feed, Frame
from ikns.stream.lsl_outlet import LslOutlet
from ikns.stream.source import Source

__all__ = [
    "Broadcast",
    "Continuity",
    "Counts",
    "Event",
    "Faults",
    "Feed",
    "Frame",
    "LslOutlet",
    "Source",
    "broadcast",
    "inject",
    "open_source",
]
