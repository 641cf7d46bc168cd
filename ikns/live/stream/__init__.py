"""Live sources of markers: a recording, LSL, Qualisys or Vicon, with one interface.

A source is an iterator of frames and a context manager. It counts lost, late and
repeated frames (:class:`Continuity`) and reports breaks (``events``).
"""

from ikns.live.stream.address import open_source
from ikns.live.stream.broadcast import Broadcast, broadcast
from ikns.live.stream.continuity import Continuity, Counts
from ikns.live.stream.faults import Faults, inject
from ikns.live.stream.frame import Event, Feed, Frame
from ikns.live.stream.lsl_outlet import LslOutlet
from ikns.live.stream.source import Source

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
