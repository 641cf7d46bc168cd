"""A zenoh router on this machine, to try things without ROS: python -m ikns.ros2.router.

A ROS 2 system has its own: ``ros2 run rmw_zenoh_cpp rmw_zenohd``.
"""

from __future__ import annotations

import importlib
import json
import sys
import threading
from contextlib import suppress

_ENDPOINT = "tcp/127.0.0.1:7447"


def main() -> int:
    """Route for programs of this machine until Ctrl-C."""
    zenoh = importlib.import_module("zenoh")
    configuration = zenoh.Config()
    for path, value in {
        "mode": "router",
        "listen/endpoints": [_ENDPOINT],
        "scouting/multicast/enabled": False,
    }.items():
        configuration.insert_json5(path, json.dumps(value))
    try:
        router = zenoh.open(configuration)
    except zenoh.ZError:
        sys.stderr.write(f"expected {_ENDPOINT} to be free, found it in use.\n")
        return 2
    with router, suppress(KeyboardInterrupt):
        sys.stderr.write(f"a zenoh router listens at {_ENDPOINT}; Ctrl-C ends it.\n")
        threading.Event().wait()
    return 0


if __name__ == "__main__":
    sys.exit(main())
