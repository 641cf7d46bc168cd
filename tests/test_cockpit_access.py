"""Access to the cockpit: no foreign page, and no one without the token."""

import asyncio
import http.client
import json
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

from ikns.errors import FileError, InvalidInput
from ikns.experiments.cockpit import Cockpit
from ikns.experiments.cockpit.handlers import FILES
from ikns.experiments.conduct import Conductor, HeldInput, TrackingExperiment, VisitLog
from ikns.experiments.tracking import schedule
from ikns.live.web_access import WebAccess

ABOUT = {"experiment": "tracking", "participant": "01", "simulated": False}
PAGES = sorted(FILES)


def conductor(folder: Path) -> Conductor:
    steps = schedule(0, conditions=["keyboard"], training=0)
    made = Conductor(
        TrackingExperiment(steps),
        VisitLog(folder / "visit", ABOUT),
        page_conditions=["keyboard"],
    )
    made.update(0.0)
    return made


@contextmanager
def serving(folder: Path, **more: object) -> Iterator[Cockpit]:
    with Cockpit(conductor(folder), {"keyboard": HeldInput()}, **more) as cockpit:
        yield cockpit


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cockpit]:
    with serving(tmp_path_factory.mktemp("here")) as cockpit:
        yield cockpit


@pytest.fixture(scope="module")
def remote(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cockpit]:
    """Listens on every address, as asked."""
    with serving(tmp_path_factory.mktemp("remote"), host="0.0.0.0") as cockpit:
        yield cockpit


def cookie(cockpit: Cockpit) -> str:
    return f"{cockpit.access.cookie}={cockpit.access.token}"


def ask(
    cockpit: Cockpit, path: str, *, method: str = "GET", **headers: str
) -> tuple[int, dict[str, str], bytes]:
    line = http.client.HTTPConnection("127.0.0.1", cockpit.access.port, timeout=10)
    try:
        line.request(method, path, headers=headers)
        answer = line.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()
    finally:
        line.close()


def open_socket(
    cockpit: Cockpit,
    *,
    role: str = "panel",
    messages: tuple[str, ...] = (),
    known: bool = True,
    **headers: str,
) -> dict[str, object] | int:
    """Open a web socket; return the first message, or the status of the refusal."""
    if known:
        headers = {"Cookie": cookie(cockpit)} | headers

    async def connect() -> dict[str, object] | int:
        url = f"ws://127.0.0.1:{cockpit.access.port}/link?role={role}"
        try:
            link: WebSocketClientConnection = await websocket_connect(
                HTTPRequest(url, headers=headers)
            )
        except HTTPClientError as refusal:
            return refusal.code
        message = json.loads(await link.read_message() or "{}")
        for words in messages:
            await link.write_message(words)
            # A few frames were on their way; no more than 12 come unanswered.
            frames = 0
            while frames < 10 and (answer := await link.read_message()) is not None:
                frames += json.loads(answer)["kind"] == "now"
        closed = link.close_code
        link.close()
        if closed is not None:
            return {"closed": closed}
        # Our socket is closed only when the server has answered.
        while await link.read_message() is not None:
            pass
        return message

    return asyncio.run(asyncio.wait_for(connect(), 10))


def own(cockpit: Cockpit) -> str:
    return f"http://127.0.0.1:{cockpit.access.port}"


def test_by_default_only_this_machine_is_listened_to(here: Cockpit) -> None:
    assert {urlsplit(a).hostname for a in (here.url, here.panel_url)} == {"127.0.0.1"}
    assert here._socket.getsockname()[0] == "127.0.0.1"


@pytest.mark.parametrize("path", PAGES)
def test_pages_are_served_and_may_load_nothing_else(here: Cockpit, path: str) -> None:
    status, headers, body = ask(here, path, Cookie=cookie(here))
    assert status == 200
    assert body
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "unsafe" not in policy
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Cache-Control"] == "no-store"


@pytest.mark.parametrize("path", [*PAGES, "/link"])
@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", ""]
)
def test_a_foreign_host_name_is_refused(here: Cockpit, path: str, host: str) -> None:
    # DNS rebinding: the name of a foreign page resolves to this machine.
    named = host.format(port=here.access.port)
    status, _, body = ask(
        here, path, Host=named, Origin=f"http://{named}", Cookie=cookie(here)
    )
    assert status == 403
    assert b"<html" not in body


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "https://127.0.0.1:{port}",
        "http://127.0.0.1:1",
        "http://localhost:{port}",
        "null",
        "",
    ],
)
def test_a_socket_of_a_foreign_page_is_refused(here: Cockpit, origin: str) -> None:
    assert open_socket(here, Origin=origin.format(port=here.access.port)) == 403


def test_a_socket_without_an_origin_is_refused(here: Cockpit) -> None:
    assert open_socket(here) == 403


def test_our_own_page_is_accepted(here: Cockpit) -> None:
    message = open_socket(here, Origin=own(here))
    assert isinstance(message, dict)
    assert message["kind"] == "hello"
    assert message["role"] == "panel"


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "PATCH"])
def test_nothing_can_be_posted(here: Cockpit, method: str) -> None:
    for origin in (own(here), "http://evil.example"):
        status, headers, _ = ask(
            here, "/", method=method, Origin=origin, Cookie=cookie(here)
        )
        assert status == 405
        assert "Access-Control-Allow-Origin" not in headers


@pytest.mark.parametrize(
    "path", ["/../pyproject.toml", "/server.py", "/link/../x", "//"]
)
def test_no_other_file_is_served(here: Cockpit, path: str) -> None:
    assert ask(here, path)[0] == 404


@pytest.mark.parametrize(
    "words",
    ["no json", "[]", '{"n": "x"}', '{"c": "high"}', "1", "[" * 4000],
)
def test_a_malformed_message_closes_the_connection(here: Cockpit, words: str) -> None:
    answer = open_socket(here, role="participant", messages=(words,), Origin=own(here))
    assert answer == {"closed": 1003}


def test_a_message_that_is_too_long_closes_the_connection(here: Cockpit) -> None:
    answer = open_socket(
        here, messages=(json.dumps({"text": "x" * 5000}),), Origin=own(here)
    )
    assert answer == {"closed": 1009}


def test_a_participant_cannot_send_commands_of_the_experimenter(tmp_path: Path) -> None:
    with serving(tmp_path) as cockpit:
        for name in ("pause", "skip", "end", "page_disconnected"):
            says = json.dumps({"command": name})
            open_socket(
                cockpit, role="participant", messages=(says,), Origin=own(cockpit)
            )
            shown = cockpit.conductor.update(1.0)
            assert shown["state"] == "waiting"
            assert shown["step_index"] == 0
            assert not cockpit.conductor.over
        says = json.dumps({"command": "pause"})
        open_socket(cockpit, role="panel", messages=(says,), Origin=own(cockpit))
        assert cockpit.conductor.update(1.0)["state"] == "paused"


# --- the token ----------------------------------------------------------------------


@pytest.mark.parametrize("where", ["here", "remote"])
def test_no_one_gets_in_without_the_token(
    where: str, request: pytest.FixtureRequest
) -> None:
    """Neither another machine nor another user of this one."""
    cockpit: Cockpit = request.getfixturevalue(where)
    token = cockpit.access.token
    assert len(token) >= 32  # 24 bytes
    assert f"token={token}" in cockpit.url
    assert f"token={token}" in cockpit.panel_url
    wrong = token[:-1] + ("a" if token[-1] != "a" else "b")
    stale = f"{cockpit.access.cookie}={wrong}"
    for path in [*PAGES, f"/?token={wrong}", "/?token=", "/link"]:
        assert ask(cockpit, path)[0] == 403, path
        assert ask(cockpit, path, Cookie=stale)[0] == 403, path
        assert token.encode() not in ask(cockpit, path)[2]
    assert open_socket(cockpit, Origin=own(cockpit), known=False) == 403
    assert open_socket(cockpit, Origin=own(cockpit), Cookie=stale) == 403


@pytest.mark.parametrize("where", ["here", "remote"])
def test_the_token_is_exchanged_for_a_cookie_and_leaves_the_address(
    where: str, request: pytest.FixtureRequest
) -> None:
    cockpit: Cockpit = request.getfixturevalue(where)
    status, headers, _ = ask(cockpit, f"/panel?token={cockpit.access.token}")
    assert status == 302
    assert headers["Location"] == "/panel"
    given = headers["Set-Cookie"]
    assert "HttpOnly" in given
    assert "SameSite=Lax" in given
    mine = given.partition(";")[0]
    assert ask(cockpit, "/panel", Cookie=mine)[0] == 200
    message = open_socket(cockpit, Origin=own(cockpit), Cookie=mine)
    assert isinstance(message, dict)
    assert message["kind"] == "hello"
    # The token is of use to our own pages only.
    assert open_socket(cockpit, Origin="http://evil.example", Cookie=mine) == 403


def test_only_the_panel_learns_the_address_of_the_view(tmp_path: Path) -> None:
    view = "http://127.0.0.1:9/?token=secret"
    with serving(tmp_path, about={"view": view}) as cockpit:
        for role, told in (("panel", view), ("participant", ""), ("", "")):
            message = open_socket(cockpit, role=role, Origin=own(cockpit))
            assert isinstance(message, dict)
            assert message["view"] == told
        policy = ask(cockpit, "/panel", Cookie=cookie(cockpit))[1]
        assert "secret" not in policy["Content-Security-Policy"]


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1", "127.0.0.2", "::1", "0.0.0.0", "::", "192.168.1.7", "lab.example"],
)
def test_no_address_goes_without_a_token(host: str) -> None:
    with pytest.raises(InvalidInput, match="token"):
        WebAccess(host, 80, "")
    assert len(WebAccess.at(host, 80).token) >= 32
    assert WebAccess.at(host, 80).token != WebAccess.at(host, 80).token


@given(st.text(), st.text())
def test_only_the_token_itself_is_the_token(token: str, told: str) -> None:
    access = WebAccess("10.0.0.1", 80, "t" + token)
    assert access.accepts_token(told) == (told == "t" + token)
    assert not access.accepts_token(None)
    assert not access.accepts_token("\udc80")


@given(st.text())
def test_an_origin_is_ours_only_letter_by_letter(origin: str) -> None:
    access = WebAccess("127.0.0.1", 8000, "t")
    ours = origin == "http://127.0.0.1:8000"
    assert access.same_origin(origin, "127.0.0.1:8000") == ours


def test_a_port_that_is_taken_is_one_sentence(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(FileError, match=f"port {port} of 127.0.0.1") as told:
            Cockpit(conductor(tmp_path), {}, port=port)
    assert str(told.value).endswith(".")
