"""Whatever comes over the web socket, the server goes on and prints no traceback."""

import asyncio
import json
import logging
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from test_cockpit_access import cookie, own, serving
from tornado.httpclient import HTTPRequest
from tornado.websocket import WebSocketClosedError, websocket_connect

from ikns.experiments.cockpit import Cockpit
from ikns.experiments.cockpit.messages import Message, read_message

KEYS = st.sampled_from(["n", "command", "text", "condition", "c"])
NUMBERS = st.one_of(
    st.integers(),
    st.integers(min_value=-(10**400), max_value=10**400),
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([2**53, 2**63, 2**64, -1]),
)
TEXTS = st.one_of(
    st.text(st.characters(codec=None), max_size=80),
    st.sampled_from(["begin", "connect", "end\x00", "\ud800", "x" * 4000, "comment"]),
)
LEAVES = st.one_of(st.none(), st.booleans(), NUMBERS, TEXTS)
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS, inner),
    max_leaves=12,
)
OBJECTS = st.dictionaries(KEYS, VALUES) | st.dictionaries(KEYS | TEXTS, VALUES)
HOSTILE = [
    '{"n": 1e999}',
    '{"c": -1e999}',
    '{"n": NaN}',
    '{"c": Infinity}',
    '{"n": 1' + "0" * 4000 + "}",
    '{"c": 1' + "0" * 4000 + "}",
    "[" * 4000,
    '{"text": ' + "[" * 2000 + "]" * 2000 + "}",
    '{"a":' * 700 + "1" + "}" * 700,
    '{"text": "' + "x" * 4000 + '"}',
    '{"command": "' + "x" * 4000 + '"}',
    '{"command": ["begin"]}',
    '{"command": "begin", "text": "\\ud800"}',
    '{"n": true}',
    '{"n": 1.0}',
    '{"c": "0.5"}',
    "",
    "null",
]
WORDS = st.one_of(
    (OBJECTS | VALUES).map(json.dumps),  # NaN and Infinity are written as such
    st.text(max_size=60),
    st.sampled_from(HOSTILE),
)


@given(WORDS | st.binary(max_size=60))
@settings(max_examples=500, deadline=None)
def test_a_message_is_read_whole_or_refused(words: str | bytes) -> None:
    try:
        found = read_message(words)
    except ValueError:
        return
    assert 0 <= found.n < 2**53
    assert found.c is None or math.isnan(found.c) or abs(found.c) <= 1000
    for text in (found.command, found.text, found.condition):
        assert len(text.encode()) <= 4 * 500


def test_what_pages_send_is_read() -> None:
    assert read_message('{"n": 3}') == Message(n=3)
    assert read_message('{"command": "skip", "text": "late"}') == Message(
        command="skip", text="late"
    )
    told = read_message('{"condition": "gamepad", "c": null, "n": 9}')
    assert told.c is not None
    assert math.isnan(told.c)
    assert told._replace(c=None) == Message(n=9, condition="gamepad")
    assert read_message('{"text": "' + "x" * 500 + '"}').text == "x" * 500


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cockpit]:
    with serving(tmp_path_factory.mktemp("server")) as cockpit:
        yield cockpit


async def talk(cockpit: Cockpit, role: str, words: str | bytes) -> int | None:
    """Send a message; return the code with which the connection closed, if it did."""
    url = f"ws://127.0.0.1:{cockpit.access.port}/link?role={role}"
    headers = {"Origin": own(cockpit), "Cookie": cookie(cockpit)}
    link: Any = await websocket_connect(HTTPRequest(url, headers=headers))
    states, sent = 0, False
    try:
        while states <= 12:
            told = await link.read_message()
            if told is None:
                return int(link.close_code)
            states += json.loads(told)["kind"] == "now"
            if states == 1 and not sent:
                sent = True
                await link.write_message(words, binary=isinstance(words, bytes))
                # This answers the states so far. Twelve come unanswered: the thirteenth
                # only if it was read, and with it the message before.
                await link.write_message(json.dumps({"n": 10**6}))
    except WebSocketClosedError:
        return int(link.close_code)
    finally:
        link.close()
    while await link.read_message() is not None:
        pass
    return None


@given(WORDS | st.binary(max_size=60), st.sampled_from(["panel", "participant"]))
@settings(
    max_examples=25,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
def test_the_server_goes_on_whatever_comes(
    server: Cockpit, caplog: pytest.LogCaptureFixture, words: str | bytes, role: str
) -> None:
    try:
        if isinstance(words, str):
            words.encode()
    except UnicodeEncodeError:  # a web socket cannot send it
        return
    caplog.clear()
    with caplog.at_level(logging.WARNING):
        code = asyncio.run(asyncio.wait_for(talk(server, role, words), 20))
        assert code in (None, 1003, 1009)
        json.dumps(server.conductor.update(1.0))
        # A page that behaves is served as before.
        assert asyncio.run(asyncio.wait_for(talk(server, role, '{"n": 0}'), 20)) is None
    assert [r for r in caplog.records if r.exc_info or r.levelno >= logging.ERROR] == []
    assert server._thread.is_alive()


@pytest.mark.parametrize("role", ["%ff", "%00", "panel&role=%ff", "x" * 2000])
def test_a_role_that_no_page_has_only_watches(
    server: Cockpit, caplog: pytest.LogCaptureFixture, role: str
) -> None:
    with caplog.at_level(logging.WARNING):
        assert asyncio.run(asyncio.wait_for(talk(server, role, '{"n": 0}'), 20)) is None
    assert caplog.records == []


def test_a_comment_of_the_panel_is_written_as_it_was_sent(tmp_path: Path) -> None:
    with serving(tmp_path) as cockpit:
        words = json.dumps({"command": "pause", "text": "\x00 Käse \U0001f9c0"})
        assert asyncio.run(asyncio.wait_for(talk(cockpit, "panel", words), 20)) is None
        assert cockpit.conductor.update(1.0)["state"] == "paused"
        log = (tmp_path / "visit" / "log.jsonl").read_text().splitlines()
    assert "Käse \U0001f9c0" in json.loads(log[-1])["text"]
