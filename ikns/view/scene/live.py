"""One posture after another in an open browser, as they come.

MeshCat's own server listens on every network interface and lives in a process of its
own. This one listens on the loopback interface alone, in a thread, and only sends: the
page reads server-sent events. A token keeps other users of the machine out.
"""

from __future__ import annotations

import math
import threading
import webbrowser
from dataclasses import replace
from http.cookies import CookieError, SimpleCookie
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Self
from urllib.parse import parse_qs, urlsplit

import numpy as np
from numpy.typing import ArrayLike

from ikns.body.skeleton import Skeleton
from ikns.errors import FileError, InvalidInput
from ikns.live.web_access import WebAccess
from ikns.view.scene.body import drawn_links, pose_commands
from ikns.view.scene.commands import ROOT
from ikns.view.scene.finger import flexion_commands
from ikns.view.scene.page import packed_json, scene_html
from ikns.view.scene.scene import Scene

_LOOPBACK = "127.0.0.1"
_FRAMES = "/frames"
#: Layers of :func:`ikns.view.scene.map_scene` at one PCA point; hidden at first.
_AT_POINT = {f"{ROOT}/ghosts", f"{ROOT}/sweep"}
#: A quiet view sends a comment after this many seconds, to notice who has left.
_HEARTBEAT = 1.0


class LiveView:
    """A scene in the browser whose body follows :meth:`show`.

    Use it as a context manager; leaving it stops the server. :meth:`show` only leaves
    the newest posture for the browser and never waits for it, so a slow browser skips
    frames and a control loop does not.

    Parameters
    ----------
    scene : Scene
        From :func:`ikns.view.scene.map_scene`.
    skeleton : Skeleton
        That of the scene.
    port : int
        0 takes a free one.

    Raises
    ------
    FileError
        When the port cannot be opened.

    Examples
    --------
    >>> from ikns.nullspace.map import NullSpaceMap
    >>> from ikns.view.scene.map_scene import map_scene
    >>> body = Skeleton.load()
    >>> corners = 0.3 + 0.1 * np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    >>> zero = NullSpaceMap.from_arrays(corners, np.zeros((8, 7)), [0.0] * 8, [0.0] * 8)
    >>> scene = map_scene(body, zero, "right_arm", simulated=True)
    >>> with LiveView(scene, body) as live:
    ...     live.show(body.neutral(), c=0.5)
    ...     live.url.startswith("http://127.0.0.1:")
    True
    """

    def __init__(self, scene: Scene, skeleton: Skeleton, *, port: int = 0) -> None:
        self._skeleton, self._links = skeleton, drawn_links(skeleton)
        self._fingers, self._signals = scene.fingers, len(scene.signals)
        self._changed = threading.Condition()
        self._frame: bytes | None = None
        self._count = 0
        self._closed = False
        try:
            self._server = _Server((_LOOPBACK, port), self)
        except (OSError, OverflowError) as error:
            raise FileError(
                f"port {port} of {_LOOPBACK} cannot be opened: {error}."
            ) from None
        frames = f"{_FRAMES}?token={self._server.access.token}"
        # What belongs to one point stays there while the body moves.
        layers = [
            replace(layer, shown=False) if set(layer.paths) & _AT_POINT else layer
            for layer in scene.layers
        ]
        still = replace(
            scene,
            layers=layers,
            caption="Live, seen from the thorax.",
            commands=[c for c in scene.commands if c["type"] != "set_animation"],
            times=np.zeros(0),
            c=np.zeros((0, len(scene.signals))),
            speed=np.zeros(0),
            start=0.0,
        )
        self._page = scene_html(still, live=frames).encode()
        self._thread = threading.Thread(
            target=self._server.serve_forever,
            kwargs={"poll_interval": 0.05},
            name="ikns live view",
            daemon=True,
        )
        self._thread.start()

    @property
    def url(self) -> str:
        """Address of the page, with its token, on this machine only."""
        access = self._server.access
        return f"http://{_LOOPBACK}:{access.port}/?token={access.token}"

    def open(self) -> None:
        """Show the page in the user's browser."""
        webbrowser.open(self.url)

    def show(
        self,
        q: ArrayLike,
        *,
        time: float | None = None,
        c: ArrayLike | None = None,
        flexion: ArrayLike | None = None,
    ) -> None:
        """Move the body; call it at any rate, from one thread.

        Parameters
        ----------
        q : (25,) or (18,) array
            Posture; one that is not finite leaves the body where it was.
        time : float, optional
            s, as text on the page.
        c : float or (d,) array, optional
            Control signals of the scene, as text and as bars; NaN says that one is
            unknown.
        flexion : float or (d,) array, optional
            Of the fingers that :func:`ikns.view.scene.with_finger` drew; one stays as
            it is where this is not finite.

        Raises
        ------
        InvalidInput
            When the posture has another shape, the scene has another number of signals
            or fingers, or the view is closed.
        """
        posture = np.asarray(q, dtype=np.float64)
        if posture.ndim != 1:
            raise InvalidInput(f"expected one posture (25,), found {posture.shape}.")
        if self._closed:
            raise InvalidInput("the live view is closed.")
        moves = pose_commands(f"{ROOT}/body", self._skeleton, posture, self._links)
        if not np.isfinite(posture).all():
            moves = []
        bent = _each(flexion, len(self._fingers), "flexions")
        for path, value in zip(self._fingers, bent, strict=True):
            if np.isfinite(value):
                moves += flexion_commands(path, value)
        signals = _each(c, self._signals, "control signals")
        frame = {
            # A micrometer cannot be seen.
            "commands": [m | {"matrix": m["matrix"].round(6)} for m in moves],
            "time": time,
            "c": [value if np.isfinite(value) else None for value in signals],
        }
        message = f"data: {packed_json(frame)}\n\n".encode()
        with self._changed:
            self._frame = message
            self._count += 1
            self._changed.notify_all()

    def close(self) -> None:
        """Stop the server; calling it again does nothing."""
        with self._changed:
            if self._closed:
                return
            self._closed = True
            self._changed.notify_all()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def __enter__(self) -> Self:
        """Return the view itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the server."""
        self.close()

    def _next(self, last: int) -> tuple[int, bytes] | None:
        """Frame after number `last`, a comment if none comes, None at the end."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._closed or self._count > last, timeout=_HEARTBEAT
            )
            if self._closed:
                return None
            if self._frame is None or self._count == last:
                return last, b":\n\n"
            return self._count, self._frame


def _each(given: ArrayLike | None, count: int, what: str) -> list[float]:
    """Return a value for each, NaN where none are given."""
    values = [math.nan] * count if given is None else np.ravel(given).tolist()
    if len(values) != count:
        raise InvalidInput(
            f"expected as many {what} as the scene has, {count}, found {len(values)}."
        )
    return values


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False

    def __init__(self, address: tuple[str, int], view: LiveView) -> None:
        self.view = view
        super().__init__(address, _Handler)
        self.access = WebAccess.at(address[0], self.server_address[1])


class _Handler(BaseHTTPRequestHandler):
    server: _Server

    def do_GET(self) -> None:
        access, path = self.server.access, urlsplit(self.path).path
        in_address = access.accepts_token(self._token_in_address())
        if not access.accepts_host(self.headers.get("Host")) or not (
            in_address or access.accepts_token(self._token_in_cookie())
        ):
            self.send_error(403, "open the address that the command printed")
        elif path == "/" and in_address and not self._embedded():
            # The token leaves the address bar, and with it history and screenshots.
            self.send_response(302)
            self.send_header("Location", "/")
            cookie = f"{access.cookie}={access.token}; Path=/; HttpOnly; SameSite=Lax"
            self.send_header("Set-Cookie", cookie)
            self.send_header("Content-Length", "0")
            self.end_headers()
        elif path == "/":
            page = self.server.view._page
            self._head("text/html; charset=utf-8", len(page))
            self.wfile.write(page)
        elif path == _FRAMES:
            self._head("text/event-stream")
            self._send_frames()
        else:
            self.send_error(404)

    def _embedded(self) -> bool:
        """Whether the panel asks: its frame has no address bar, and cookies may fail.

        A browser keeps no cookie in a frame when the panel is served at another name.
        """
        return self.headers.get("Sec-Fetch-Dest") == "iframe"

    def _token_in_address(self) -> str | None:
        return parse_qs(urlsplit(self.path).query).get("token", [None])[-1]

    def _token_in_cookie(self) -> str | None:
        try:
            cookies = SimpleCookie(self.headers.get("Cookie", ""))
        except CookieError:
            return None
        found = cookies.get(self.server.access.cookie)
        return None if found is None else found.value

    def _head(self, kind: str, length: int | None = None) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        if length is not None:
            self.send_header("Content-Length", str(length))
        self.end_headers()

    def _send_frames(self) -> None:
        last = 0
        try:
            while (found := self.server.view._next(last)) is not None:
                last, message = found
                self.wfile.write(message)
        except OSError:
            return  # the browser has gone

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: stdout and stderr belong to the command."""
