"""Publish what the live loop decides, without ever delaying it.

`publisher` has the queue and the thread, `lsl` the streams, `ros` the topics of ROS 2,
`address` opens them, and `several` makes several of them one.
"""

from ikns.live.publish.address import check_publish, open_publisher
from ikns.live.publish.publisher import PublishedFrame, Publisher, Sink
from ikns.live.publish.ros import joint_places
from ikns.live.publish.several import Publishers

__all__ = [
    "Publisher",
    "Publishers",
    "PublishedFrame",
    "Sink",
    "check_publish",
    "joint_places",
    "open_publisher",
]
