"""A page without a browser: talks with a cockpit while a command runs."""

import asyncio
import json
import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any, ClassVar
from urllib.parse import urlsplit

from tornado.httpclient import AsyncHTTPClient, HTTPRequest
from tornado.websocket import websocket_connect

__all__ = ["Page", "play"]


async def token_cookie(address: str) -> str:
    """Exchange the token in an address for a cookie, as a browser does."""
    answer = await AsyncHTTPClient().fetch(
        address, follow_redirects=False, raise_error=False
    )
    assert answer.code == 302, answer
    return answer.headers["Set-Cookie"].partition(";")[0]


class Page:
    """A participant's page, or the panel, as a script."""

    there: ClassVar[list["Page"]] = []

    def __init__(self, role: str) -> None:
        self.role = role
        self.hello: dict[str, Any] = {}
        self.shown: dict[str, Any] = {}
        self.link: Any = None

    async def come(self, address: str) -> None:
        origin = "{0.scheme}://{0.netloc}".format(urlsplit(address))
        url = f"{origin.replace('http', 'ws')}/link?role={self.role}"
        headers = {"Origin": origin, "Cookie": await token_cookie(address)}
        self.link = await websocket_connect(HTTPRequest(url, headers=headers))
        self.there.append(self)
        await self.wait(lambda shown: bool(shown))

    async def leave(self) -> None:
        """Close, and hear the server say so, too."""
        self.link.close()
        while await asyncio.wait_for(self.link.read_message(), 30) is not None:
            pass

    async def submit(self, name: str, text: str = "") -> None:
        await self.link.write_message(json.dumps({"command": name, "text": text}))

    async def wait(
        self, what: Callable[[dict[str, Any]], bool], seconds: float = 60.0
    ) -> None:
        """Wait until something holds of what is shown; answer as a page does."""
        end = time.monotonic() + seconds
        while True:
            words = await asyncio.wait_for(self.link.read_message(), seconds)
            assert words is not None, "the server has gone"
            message = json.loads(words)
            if message["kind"] == "hello":
                self.hello = message
            if message["kind"] == "now":
                self.shown = message
                await self.link.write_message(json.dumps({"n": message["n"]}))
                if what(message):
                    return
            assert time.monotonic() < end, self.shown

    async def until(self, *states: str) -> None:
        await self.wait(lambda shown: shown["state"] in states)


class play:
    """Stand in for ``webbrowser.open``: run a script with the pages of a command.

    The script gets the address of the server; what it raised is raised on leaving.
    """

    def __init__(self, script: Callable[[str], Any]) -> None:
        self._script, self._error = script, None
        self._thread: threading.Thread | None = None
        self.addresses: list[str] = []

    def __call__(self, address: str) -> bool:
        self.addresses.append(address)
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, args=(address,))
            self._thread.start()
        return True

    def done(self) -> None:
        assert self._thread is not None, "no page was opened"
        self._thread.join(60)
        if self._error is not None:
            raise self._error

    async def _play(self, address: str) -> None:
        try:
            await self._script(address)
        finally:
            for page in Page.there:
                await page.leave()
            Page.there.clear()

    def _run(self, address: str) -> None:
        try:
            asyncio.run(self._play(address))
        except BaseException as error:
            self._error = error
            # The command would wait for ever.
            os.kill(os.getpid(), signal.SIGTERM)
