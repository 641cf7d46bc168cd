"""The live view shows the newest posture, to this machine alone, and leaves nothing."""

import json
import socket
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any
from urllib.parse import urlsplit

import numpy as np
import pytest
import small_person

from ikns.errors import FileError, InvalidInput
from ikns.view.scene import LiveView, Scene, body_view, map_scene
from ikns.view.scene.body import drawn_links
from ikns.view.scene.commands import ROOT


def scene() -> Scene:
    person = small_person.subject()
    return map_scene(
        person.skeleton, person.null_space_map, person.chain, simulated=True
    )


@pytest.fixture(name="live")
def _live() -> Iterator[LiveView]:
    with LiveView(scene(), small_person.subject().skeleton) as view:
        yield view


def port(view: LiveView) -> int:
    return int(urlsplit(view.url).port or 0)


def browser() -> urllib.request.OpenerDirector:
    """Return what keeps cookies, as a browser does."""
    return urllib.request.build_opener(urllib.request.HTTPCookieProcessor())


def frames(view: LiveView) -> IO[bytes]:
    asked = view.url.replace("/?", "/frames?")
    return urllib.request.urlopen(asked, timeout=10)


def next_frame(stream: IO[bytes]) -> dict[str, Any]:
    for line in stream:
        if line.startswith(b"data: "):
            return dict(json.loads(line[6:]))
    raise AssertionError("the stream ended")


def test_the_page_of_a_person_is_titled_after_the_subject() -> None:
    person = small_person.subject()
    with body_view(person, simulated=True, name="ann & bo") as (view, _):
        page = browser().open(view.url).read().decode()
    assert "<title>ann &amp; bo, live (simulated)</title>" in page


def test_a_posture_reaches_the_page(live: LiveView) -> None:
    body = small_person.subject().skeleton
    q = np.random.default_rng(1).uniform(body.lower, body.upper)
    with frames(live) as stream:
        live.show(q, time=1.5, c=0.25)
        frame = next_frame(stream)
    assert (frame["time"], frame["c"]) == (1.5, [0.25])
    moved = {c["path"]: np.reshape(c["matrix"], (4, 4)).T for c in frame["commands"]}
    for link in drawn_links(body):
        position, rotation = body.link_in_thorax(q, link)
        pose = moved[f"{ROOT}/body/{link}"]
        # Six digits are sent.
        np.testing.assert_allclose(pose[:3, 3], position, atol=1e-6)
        np.testing.assert_allclose(pose[:3, :3], rotation, atol=1e-6)


def test_a_slow_page_gets_the_newest_posture(live: LiveView) -> None:
    body = small_person.subject().skeleton
    for k in range(100):
        live.show(body.neutral(), time=float(k))
    with frames(live) as stream:
        assert next_frame(stream)["time"] == 99


def test_an_unknown_posture_moves_nothing(live: LiveView) -> None:
    with frames(live) as stream:
        live.show(np.full(25, np.nan), c=np.nan)
        frame = next_frame(stream)
    assert frame == {"commands": [], "time": None, "c": [None]}


def test_the_page_listens_to_its_own_server_only(live: LiveView) -> None:
    with browser().open(live.url, timeout=10) as answer:
        page = answer.read().decode()
        assert "token" not in answer.url
    assert "connect-src 'self'" in page
    assert '"live":"/frames?' in page
    assert "set_animation" not in page.split("</script>")[0]
    assert "Simulated subject" in page


def test_the_server_binds_to_loopback_alone(live: LiveView) -> None:
    """The kernel's own list of sockets: one listens on our port, on 127.0.0.1."""
    listening = []
    for table in ("tcp", "tcp6"):
        path = Path("/proc/net") / table
        rows = path.read_text().splitlines()[1:] if path.exists() else []
        for row in rows:
            _, local, _, state, *_ = row.split()
            address, number = local.split(":")
            if state == "0A" and int(number, 16) == port(live):
                listening.append(address)
    assert listening == ["0100007F"]
    with socket.create_connection(("127.0.0.1", port(live)), timeout=5):
        pass
    for entry in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET):
        address = entry[4][0]
        if not str(address).startswith("127."):
            with pytest.raises(OSError, match="refused"):
                socket.create_connection((address, port(live)), timeout=5)


@pytest.mark.parametrize(
    ("path", "host", "code"),
    [("", "evil.example", 403), ("frames", "evil.example", 403), ("other", None, 404)],
)
def test_a_foreign_name_and_an_unknown_path_are_refused(
    live: LiveView, path: str, host: str | None, code: int
) -> None:
    request = urllib.request.Request(live.url.replace("/?", f"/{path}?"))
    if host is not None:
        request.add_header("Host", host)
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(request, timeout=10)
    refused.value.close()
    assert refused.value.code == code


@pytest.mark.parametrize("path", ["/", "/frames", "/other"])
@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Cookie": "ikns-{port}=wrong"},
        {"Cookie": "ikns-{port}="},
        {"Cookie": '="; ikns-{port}=\\'},
        {"Sec-Fetch-Dest": "iframe"},
    ],
)
@pytest.mark.parametrize("query", ["", "?token=", "?token=wrong", "?token=%ff&token"])
def test_no_one_gets_in_without_the_token(
    live: LiveView, path: str, headers: dict[str, str], query: str
) -> None:
    place = f"http://127.0.0.1:{port(live)}"
    request = urllib.request.Request(place + path + query)
    for name, value in headers.items():
        request.add_header(name, value.format(port=port(live)))
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(request, timeout=10)
    token = urlsplit(live.url).query.removeprefix("token=")
    assert refused.value.code == 403
    assert token.encode() not in refused.value.read()
    refused.value.close()


def test_a_frame_of_the_panel_needs_no_cookie(live: LiveView) -> None:
    """Where the panel has another name, browsers keep no cookies in its frames."""
    request = urllib.request.Request(live.url, headers={"Sec-Fetch-Dest": "iframe"})
    with urllib.request.urlopen(request, timeout=10) as answer:
        assert b"Simulated subject" in answer.read()
        assert answer.headers["Referrer-Policy"] == "no-referrer"


def test_closing_ends_the_stream_the_server_and_its_thread() -> None:
    before = set(threading.enumerate())
    with LiveView(scene(), small_person.subject().skeleton) as view:
        stream = frames(view)
        number = port(view)
    with stream:
        assert stream.read().replace(b":\n\n", b"") == b""
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", number), timeout=5)
    view.close()
    with pytest.raises(InvalidInput, match="closed"):
        view.show(np.zeros(25))
    # Other tests may have left threads that never end.
    for thread in set(threading.enumerate()) - before:
        thread.join(timeout=5)
    assert set(threading.enumerate()) <= before


def test_bad_arguments_are_refused(live: LiveView) -> None:
    with pytest.raises(InvalidInput, match=r"one posture"):
        live.show(np.zeros((2, 25)))
    with pytest.raises(InvalidInput, match="joint angles"):
        live.show(np.zeros(7))
    with pytest.raises(
        InvalidInput, match="control signals as the scene has, 1, found 2"
    ):
        live.show(np.zeros(25), c=[0.5, 0.5])
    with pytest.raises(InvalidInput, match="flexions as the scene has, 0, found 1"):
        live.show(np.zeros(25), flexion=0.5)
    with pytest.raises(FileError, match=f"port {port(live)}"):
        LiveView(scene(), small_person.subject().skeleton, port=port(live))
