"""ROS 2 without ROS: messages over zenoh, as ROS's own rmw_zenoh sends them.

`definitions` has the messages and their type hashes, `cdr` their bytes, `keys` the
names under which a ROS graph finds them, `address` reads what a user types, and `node`
is the connection to a router.
"""

from ikns.finger.ros2.address import RosAddress, ros_address
from ikns.finger.ros2.node import RosNode, RosPublisher

__all__ = ["RosAddress", "RosNode", "RosPublisher", "ros_address"]
