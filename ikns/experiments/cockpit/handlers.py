"""Request handlers of the cockpit: access is checked, and pages load nothing else."""

from __future__ import annotations

from importlib.resources import files
from urllib.parse import urlsplit

from tornado.web import RequestHandler
from tornado.websocket import WebSocketHandler

from ikns.experiments.cockpit.hub import Hub

#: Path, file and content type of everything that is served.
FILES = {
    "/": ("participant.html", "text/html"),
    "/panel": ("panel.html", "text/html"),
    "/cockpit.css": ("cockpit.css", "text/css"),
    "/link.js": ("link.js", "text/javascript"),
    "/plot.js": ("plot.js", "text/javascript"),
    "/words.js": ("words.js", "text/javascript"),
    "/hands.js": ("hands.js", "text/javascript"),
    "/participant.js": ("participant.js", "text/javascript"),
    "/panel.js": ("panel.js", "text/javascript"),
}


class _CheckedHandler(RequestHandler):
    def initialize(self, cockpit: Hub) -> None:
        self.cockpit = cockpit

    def set_default_headers(self) -> None:
        self.clear_header("Server")
        for name, value in {
            "Cache-Control": "no-store",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            "X-Frame-Options": "DENY",
        }.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        access = self.cockpit.access
        if not access.accepts_host(self.request.headers.get("Host")):
            self._refuse("this address does not belong to a cockpit")
        elif not access.accepts_token(self.get_cookie(access.cookie)):
            self._refuse("open the address that the command printed")

    def in_address(self, name: str) -> str:
        """Return an argument in the address, whatever bytes it holds; else nothing."""
        found = self.request.query_arguments.get(name, [b""])
        return found[-1].decode("utf-8", "replace")

    def _refuse(self, reason: str) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"Refused: {reason}.\n")


class PageHandler(_CheckedHandler):
    """Serves the files of the cockpit."""

    def prepare(self) -> None:
        """Exchange a token in the address for a cookie, or check access."""
        access, token = self.cockpit.access, self.in_address("token")
        known = access.accepts_host(self.request.headers.get("Host"))
        if known and access.accepts_token(token):
            self.set_cookie(access.cookie, access.token, httponly=True, samesite="Lax")
            # The token leaves the address bar, and with it history and screenshots.
            self.redirect(self.request.path)
            return
        super().prepare()

    def get(self) -> None:
        """Send a file."""
        name, kind = FILES[self.request.path]
        view = urlsplit(str(self.cockpit.about["view"]))
        frames = f"{view.scheme}://{view.netloc}" if view.netloc else "'none'"
        self.set_header(
            "Content-Security-Policy",
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; "
            f"connect-src 'self'; frame-src {frames}; frame-ancestors 'none'; "
            "base-uri 'none'; form-action 'none'",
        )
        self.set_header("Content-Type", f"{kind}; charset=utf-8")
        self.finish(files("ikns.experiments.cockpit").joinpath(name).read_bytes())


class CheckedSocket(_CheckedHandler, WebSocketHandler):
    """A web socket that only the cockpit's own pages may open."""

    def prepare(self) -> None:
        """Check origin and access; a request without an origin is refused.

        Tornado checks the origin in some cases only, which differ by version.
        """
        if self.check_origin(self.request.headers.get("Origin")):
            super().prepare()
        else:
            self._refuse("only the cockpit's own pages may connect")

    def check_origin(self, origin: str | None) -> bool:
        """Whether a script of our own page asks."""
        return self.cockpit.access.same_origin(origin, self.request.headers.get("Host"))
