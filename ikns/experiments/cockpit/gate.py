"""Who may come in: this machine, or whoever knows the token; no foreign scripts."""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from dataclasses import dataclass

from ikns.errors import InvalidInput

__all__ = ["Gate"]

_ANY = ("0.0.0.0", "::")


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Gate:
    """The rule at the door.

    Parameters
    ----------
    host : str
        Address that is listened on.
    port : int
    token : str
        What a browser has to know; empty: nothing, on loopback addresses alone.

    Examples
    --------
    >>> gate = Gate("127.0.0.1", 8000)
    >>> gate.knows_host("localhost:8000"), gate.knows_host("evil.example:8000")
    (True, False)
    >>> gate.same_origin("http://localhost:8000", "localhost:8000")
    True
    >>> gate.same_origin("http://evil.example", "localhost:8000")
    False
    """

    host: str
    port: int
    token: str = ""

    def __post_init__(self) -> None:
        """Refuse an open door."""
        if not self.token and not _is_loopback(self.host):
            raise InvalidInput(
                f"expected a token for {self.host}, which others can reach, found none."
            )

    @classmethod
    def at(cls, host: str, port: int) -> Gate:
        """Return the rule for an address, with a new token where one is needed."""
        return cls(host, port, "" if _is_loopback(host) else secrets.token_urlsafe(24))

    def knows_host(self, named: str | None) -> bool:
        """Whether a browser that names this host means us.

        A foreign page may have its name lead here; its browser still says the name.
        Where any address is listened on the token alone decides: a browser gives it
        only to the name under which it got it.
        """
        if named is None:
            return False
        if self.host in _ANY:
            return True
        names = [f"[{self.host}]" if ":" in self.host else self.host]
        if _is_loopback(self.host):
            names.append("localhost")
        # Browsers leave the port of HTTP itself out.
        known = {f"{name}:{self.port}" for name in names}
        return named in (known | set(names) if self.port == 80 else known)

    def same_origin(self, origin: str | None, named: str | None) -> bool:
        """Whether the script that asks came from the page of the host that it names."""
        return origin is not None and origin == f"http://{named}"

    def knows_token(self, told: str | None) -> bool:
        """Whether this is the token; takes as long for any wrong one."""
        if not self.token:
            return True
        return hmac.compare_digest((told or "").encode(), self.token.encode())

    @property
    def cookie(self) -> str:
        """Name under which a browser keeps the token; two servers do not mix."""
        return f"ikns-{self.port}"
