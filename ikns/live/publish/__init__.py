"""Publish what the live loop decides, without ever delaying it.

`publisher` has the queue and the thread, `lsl` the streams, `address` opens them.
"""

from ikns.live.publish.address import check_publish, open_publisher
from ikns.live.publish.publisher import Publisher, Sink

__all__ = ["Publisher", "Sink", "check_publish", "open_publisher"]
