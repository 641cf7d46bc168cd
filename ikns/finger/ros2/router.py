"""A zenoh router on this machine, to try things without ROS.

``python -m ikns.finger.ros2.router [PORT]``; without a port, 7447. A ROS 2 system has
its own: ``ros2 run rmw_zenoh_cpp rmw_zenohd``.
"""

from __future__ import annotations

import importlib
import json
import sys
import threading
from contextlib import suppress


def main(port: str = "7447") -> int:
    """Route for programs of this machine until Ctrl-C."""
    endpoint = f"tcp/127.0.0.1:{port}"
    zenoh = importlib.import_module("zenoh")
    configuration = zenoh.Config()
    for path, value in {
        "mode": "router",
        "listen/endpoints": [endpoint],
        "scouting/multicast/enabled": False,
    }.items():
        configuration.insert_json5(path, json.dumps(value))
    try:
        router = zenoh.open(configuration)
    except zenoh.ZError:
        sys.stderr.write(f"expected {endpoint} to be a free port, found it is not.\n")
        return 2
    with router, suppress(KeyboardInterrupt):
        sys.stderr.write(f"a zenoh router listens at {endpoint}; Ctrl-C ends it.\n")
        threading.Event().wait()
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:2]))
