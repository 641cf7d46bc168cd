"""Names of topics and of liveliness tokens, as in rmw_zenoh.

Described in https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md.
"""

from __future__ import annotations

from typing import NamedTuple

from ikns.finger.ros2.definitions import type_hash

#: Quality of service in a token: reliable, volatile, the last ten kept, no deadline. An
#: empty place means rmw_zenoh's default, which all others are.
QUALITY = "::,10:,:,:,,"

_SPACE = "@ros2_lv"
_DELIMITER = "%"  # for the slashes of a name


class RosEndpoint(NamedTuple):
    """A publisher or subscriber that the ROS graph shows.

    Parameters
    ----------
    node, topic, type, hash : str
    """

    node: str
    topic: str
    type: str
    hash: str


def topic_key(domain: int, topic: str, type_name: str) -> str:
    """Return the key under which a topic's messages go.

    Examples
    --------
    >>> topic_key(0, "/arm/c", "std_msgs/msg/Float64")[:43]
    '0/arm/c/std_msgs::msg::dds_::Float64_/RIHS0'
    """
    return f"{domain}/{topic.strip('/')}/{_dds(type_name)}/{type_hash(type_name)}"


def node_token(domain: int, session: str, node: str) -> str:
    """Return the liveliness token of a node, whose number is 0."""
    return f"{_SPACE}/{domain}/{session}/0/0/NN/%/%/{node}"


def endpoint_token(
    domain: int, session: str, number: int, kind: str, node: str, topic: str, type_: str
) -> str:
    """Return the token of a publisher (MP) or subscriber (MS) of node 0.

    Examples
    --------
    >>> token = endpoint_token(0, "ab", 1, "MP", "ikns", "/c", "std_msgs/msg/Float64")
    >>> token.split("/RIHS01_")[0]
    '@ros2_lv/0/ab/0/1/MP/%/%/ikns/%c/std_msgs::msg::dds_::Float64_'
    """
    return (
        f"{_SPACE}/{domain}/{session}/0/{number}/{kind}/%/%/{node}/{_mangled(topic)}/"
        f"{_dds(type_)}/{type_hash(type_)}/{QUALITY}"
    )


def endpoints_key(domain: int, kind: str, topic: str = "") -> str:
    """Return a key for all tokens of a kind, of one topic or of any."""
    return f"{_SPACE}/{domain}/*/*/*/{kind}/*/*/*/{_mangled(topic) or '*'}/**"


def read_token(key: str) -> RosEndpoint | None:
    """Read the token of a publisher or subscriber; None for others.

    Examples
    --------
    >>> read_token("@ros2_lv/0/ab/0/1/MP/%/%/cam/%m/a::msg::dds_::B_/RIHS01_0/::,10:")
    RosEndpoint(node='cam', topic='/m', type='a/msg/B', hash='RIHS01_0')
    """
    parts = key.split("/")
    if len(parts) < 12:
        return None
    node, topic, type_name, hashed = parts[8:12]
    name = type_name.replace("::dds_::", "::").removesuffix("_").replace("::", "/")
    return RosEndpoint(node, topic.replace(_DELIMITER, "/"), name, hashed)


def _mangled(topic: str) -> str:
    return topic.replace("/", _DELIMITER)


def _dds(type_name: str) -> str:
    package, kind, name = type_name.split("/")
    return f"{package}::{kind}::dds_::{name}_"
