"""Who may use a web server of this package: whoever knows its token."""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from dataclasses import dataclass

from ikns.errors import InvalidInput

_ALL_ADDRESSES = ("0.0.0.0", "::")


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class WebAccess:
    """Which requests a web server accepts.

    Parameters
    ----------
    host : str
        Address that the server listens on.
    port : int
    token : str
        Secret that a browser must send, on loopback too: other users of this machine
        can connect there.

    Raises
    ------
    InvalidInput
        Without a token.

    Examples
    --------
    >>> access = WebAccess("127.0.0.1", 8000, "secret")
    >>> access.accepts_host("localhost:8000"), access.accepts_host("evil.example:8000")
    (True, False)
    >>> access.same_origin("http://localhost:8000", "localhost:8000")
    True
    >>> access.same_origin("http://evil.example", "localhost:8000")
    False
    """

    host: str
    port: int
    token: str

    def __post_init__(self) -> None:
        """Check that there is a token."""
        if not self.token:
            raise InvalidInput(
                f"expected a token for port {self.port} of {self.host}, found none."
            )

    @classmethod
    def at(cls, host: str, port: int) -> WebAccess:
        """Return the rule for an address, with a new token."""
        return cls(host, port, secrets.token_urlsafe(24))

    def accepts_host(self, header: str | None) -> bool:
        """Whether the ``Host`` header of a request names this server.

        This stops DNS rebinding: the name of a foreign page may resolve to this
        machine, but its browser still sends that name. A server that listens on all
        addresses relies on the token alone: a browser sends its cookie only to the name
        that set it.
        """
        if header is None:
            return False
        if self.host in _ALL_ADDRESSES:
            return True
        names = [f"[{self.host}]" if ":" in self.host else self.host]
        if _is_loopback(self.host):
            names.append("localhost")
        # Browsers leave out the default port of HTTP.
        known = {f"{name}:{self.port}" for name in names}
        return header in (known | set(names) if self.port == 80 else known)

    def same_origin(self, origin: str | None, host: str | None) -> bool:
        """Whether a script comes from a page of the host that it addresses."""
        return origin is not None and origin == f"http://{host}"

    def accepts_token(self, token: str | None) -> bool:
        """Whether this is the token, compared in constant time."""
        given = (token or "").encode("utf-8", "surrogatepass")
        return hmac.compare_digest(given, self.token.encode())

    @property
    def cookie(self) -> str:
        """Name of the cookie that holds the token, different for each server."""
        return f"ikns-{self.port}"
