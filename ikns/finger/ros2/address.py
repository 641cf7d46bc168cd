"""What an address such as ``ros2:/markers?router=10.0.0.5:7447`` says."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import NamedTuple

from ikns.errors import InvalidInput

#: Options of every address of this kind.
OPTIONS = ("router", "domain")
#: Where zenoh's routers listen.
_ROUTER = ("127.0.0.1", 7447)
#: A ROS name: words of letters, digits and underscores, see the design article on names
#: at https://design.ros2.org/articles/topic_and_service_names.html.
_NAME = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
#: Largest ROS_DOMAIN_ID that is allowed on every system.
_LAST_DOMAIN = 101


class RosAddress(NamedTuple):
    """A topic or namespace, and where its router is.

    Parameters
    ----------
    name : str
        With a slash in front.
    host : str
    port : int
    domain : int
    """

    name: str
    host: str
    port: int
    domain: int

    @property
    def router(self) -> str:
        """Host and port."""
        return f"{self.host}:{self.port}"


def ros_name(text: str, what: str = "a ROS name") -> str:
    """Check a name and return it with a slash in front.

    Examples
    --------
    >>> ros_name("arm/left")
    '/arm/left'
    """
    if not _NAME.fullmatch(text):
        raise InvalidInput(
            f"expected {what} of letters, digits, underscores and slashes, such as "
            f"/arm, found '{text}'."
        )
    return "/" + text.lstrip("/")


def ros_address(name: str, options: Mapping[str, str]) -> RosAddress:
    """Check the name and the options ``router`` and ``domain``.

    Parameters
    ----------
    name : str
        Of a topic or namespace.
    options : mapping
        ``router=HOST:PORT``, 127.0.0.1:7447 by default, and ``domain=NUMBER``, by
        default what the variable ROS_DOMAIN_ID says, or 0. Others are ignored.

    Raises
    ------
    InvalidInput
        When one of them is wrong.

    Examples
    --------
    >>> ros_address("/arm", {"router": "10.0.0.5:7448", "domain": "3"})
    RosAddress(name='/arm', host='10.0.0.5', port=7448, domain=3)
    """
    host, port = _ROUTER
    if "router" in options:
        text = options["router"]
        host, colon, number = text.rpartition(":")
        right = number.isascii() and number.isdigit() and 0 < int(number) < 65536
        if not (colon and right and re.fullmatch(r"[\w.:\[\]-]+", host)):
            raise InvalidInput(
                f"expected router=HOST:PORT, such as 10.0.0.5:7447, found '{text}'."
            )
        host, port = host.strip("[]"), int(number)
    said = options.get("domain", os.environ.get("ROS_DOMAIN_ID", "").strip() or "0")
    if not (said.isascii() and said.isdigit() and int(said) <= _LAST_DOMAIN):
        where = "domain" if "domain" in options else "ROS_DOMAIN_ID"
        raise InvalidInput(
            f"expected {where} to be a number from 0 to {_LAST_DOMAIN}, found '{said}'."
        )
    return RosAddress(ros_name(name), host, port, int(said))
