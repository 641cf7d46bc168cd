"""What the live loop publishes to ROS 2, heard by a process without any of our code."""

import json
import time
from collections import Counter

import numpy as np
import pytest
import ros_graph
from command_line import check_refused
from ros_graph import Graph, attached
from test_publish import BODY, DECISION, MARKERS, moving, session_of
from test_publish import subject as subject  # a fixture

from ikns.cli import main
from ikns.finger import SimulatedFinger
from ikns.live.publish import Publishers, joint_places, open_publisher
from ikns.live.runtime import run
from ikns.live.session import read_run
from ikns.live.stream import Source
from ikns.live.stream.replay import Replay

TOPICS = {
    "/arm/c": "std_msgs/msg/Float64",
    "/arm/flexion": "std_msgs/msg/Float64",
    "/arm/events": "std_msgs/msg/String",
    "/arm/joint_states": "sensor_msgs/msg/JointState",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}


def opened(graph, **about):
    joints = joint_places(BODY, "right_arm")
    address = f"ros2:/arm?router=127.0.0.1:{graph.port}&domain=0"
    return open_publisher(address, rate=100.0, joints=joints, **about)


def numbers(heard):
    return [message["data"] for _, message, _ in heard]


def test_a_foreign_node_hears_what_the_session_has(subject, tmp_path):
    with Graph(TOPICS) as graph:
        with opened(graph, simulated=True) as publisher:
            with session_of(subject, tmp_path / "s") as session:
                with Source(Replay(moving(60), speed=2)) as source:
                    run(
                        source,
                        subject,
                        SimulatedFinger(),
                        session=session,
                        listener=Publishers([publisher]),
                    )
            # Here the queue is empty, yet all is still open.
            while publisher.sent < 60:
                time.sleep(0.01)
            peer = ros_graph.Peer(graph.port)
            tokens = peer.tokens("@ros2_lv/0/*/*/*/MP/**")
            peer.close()
        heard = graph.end()
    kept = read_run(tmp_path / "s")
    table = kept.model
    assert (publisher.dropped, publisher.fault) == (0, "")
    np.testing.assert_array_equal(numbers(heard["/arm/c"]), table["c"])
    np.testing.assert_array_equal(
        numbers(heard["/arm/flexion"]), table["flexion_asked"]
    )

    states = [message for _, message, _ in heard["/arm/joint_states"]]
    assert {tuple(s["name"]) for s in states} == {
        tuple(joint_places(BODY, "right_arm"))
    }
    names = states[0]["name"]
    expected = np.column_stack([table[name] for name in names])
    # The session's angles are in degrees, with six decimals.
    positions = np.degrees([s["position"] for s in states])
    np.testing.assert_allclose(positions, expected, rtol=0, atol=5.1e-7)

    # Stamps are the session's times of receipt, on the system's clock: to the
    # microsecond to which the session rounds, and a quarter for 1e9 s in float64.
    stamps = np.array(
        [s["stamp.sec"] + 1e-9 * s["stamp.nanosec"] for s in states], dtype=float
    )
    since = np.diff(stamps)
    np.testing.assert_allclose(since, np.diff(kept.receive_time), rtol=0, atol=2e-6)
    clocks = time.time() - time.monotonic()
    at = [at for at, _, _ in heard["/arm/joint_states"]]
    # A frame comes before it is heard of; an hour would be another clock.
    since_receipt = np.array(at) - (stamps - clocks)
    assert np.all((since_receipt > -0.01) & (since_receipt < 3600))

    # No message is missing, and each has the stamp as its source time.
    for topic in ("/arm/c", "/arm/joint_states"):
        sent = [attached(about) for _, _, about in heard[topic]]
        assert [number for number, _, _ in sent] == list(range(1, 61))
        assert len({identity for _, _, identity in sent}) == 1
        found = [ns for _, ns, _ in sent]
        whole = [s["stamp.sec"] * 10**9 + s["stamp.nanosec"] for s in states]
        assert found == whole

    said = numbers(heard["/arm/events"])
    assert said[0].startswith("start: ")
    assert said[1:] == [f"{kind}: {value}" for _, _, kind, value in kept.events]
    (first, *_) = (message["status"][0] for _, message, _ in heard["/diagnostics"])
    values = {each["key"]: each["value"] for each in first["values"]}
    assert (first["name"], first["level"]) == ("ros2:/arm: safety", 0)
    assert values["simulated"] == "yes"
    levels = Counter(m["status"][0]["level"] for _, m, _ in heard["/diagnostics"])
    assert set(levels) == {0}

    # `ros2 topic list -t` reads these.
    found = {tuple(token.split("/")[8:]) for token in tokens}
    for topic, kind in TOPICS.items():
        mangled, dds = topic.replace("/", "%"), ros_graph.dds(kind)
        tail = (mangled, dds, ros_graph.HASHES[kind], "::,10:,:,:,,")
        assert any(parts[1:] == tail for parts in found), topic


def test_a_router_that_goes_away_is_told_once_and_costs_nothing():
    told = []
    with Graph() as graph, opened(graph, on_fault=told.append) as publisher:
        publisher.event(1.0, "start", "now")
        while not publisher.sent:
            time.sleep(0.01)
        graph.kill()
        give_up = time.monotonic() + 10
        slowest = 0.0
        while not told and time.monotonic() < give_up:
            began = time.perf_counter()
            publisher.decision(1.0, DECISION, MARKERS)
            slowest = max(slowest, time.perf_counter() - began)
            time.sleep(0.01)
        publisher.event(2.0, "safe", "no pose")
    assert slowest < 1  # a call that waited for the router would not come back
    (sentence,) = told
    assert sentence.endswith(
        f"no longer published (the router at 127.0.0.1:{graph.port} went away)."
    )
    assert publisher.dropped >= 1


def test_a_router_that_hangs_is_told():
    told = []
    with Graph() as graph, opened(graph, on_fault=told.append) as publisher:
        publisher.event(1.0, "start", "now")
        graph.pause()
        give_up = time.monotonic() + 10
        while not told and time.monotonic() < give_up:
            publisher.event(1.0, "still", "here")
            time.sleep(0.02)
        graph.go_on()
    assert "does not answer" in told[0]


def test_a_pause_of_the_publisher_is_no_fault(monkeypatch):
    monkeypatch.setattr("ikns.live.publish.ros._SILENCE", 0.2)
    with Graph() as graph, opened(graph) as publisher:
        for k in range(3):
            time.sleep(0.4)
            publisher.event(float(k), "trial", str(k))
            while publisher.sent <= k and not publisher.fault:
                time.sleep(0.01)
        assert publisher.fault == ""


def test_commands_publish_to_several_places(files, tmp_path, capfd):
    with Graph({"/arm/c": "std_msgs/msg/Float64"}) as graph:
        argv = [
            *("run", "--subject", str(files / "person"), "--dry-run", "--json"),
            *("--source", f"replay:{files / 'free.c3d'}?speed=max"),
            *("--publish", f"ros2:arm?router=127.0.0.1:{graph.port}"),
            *("--publish", f"ros2:other?router=127.0.0.1:{graph.port}"),
        ]
        assert main(argv) == 0
        heard = graph.end()
    result = json.loads(capfd.readouterr().out)
    assert result["published"]["fault"] == ""
    assert result["published"]["sent"] >= 2 * (len(heard["/arm/c"]))
    assert heard["/arm/c"]


def test_no_router_is_one_sentence(files, capfd):
    port = ros_graph.free_port()
    argv = [
        *("run", "--subject", str(files / "person"), "--dry-run"),
        *("--source", f"replay:{files / 'free.c3d'}?speed=max"),
        *("--publish", f"ros2:arm?router=127.0.0.1:{port}"),
    ]
    said = check_refused(argv, files, capfd)
    assert f"expected a zenoh router at 127.0.0.1:{port}, found no answer" in said
    assert "rmw_zenohd" in said


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("ros2:a b", "of letters, digits, underscores"),
        ("ros2:/9", "of letters, digits, underscores"),
        ("ros2:/arm?router=x", "router=HOST:PORT"),
        ("ros2:/arm?router=x:0", "router=HOST:PORT"),
        ("ros2:/arm?domain=102", "0 to 101"),
        ("ros2:/arm?scope=network", "expected router or domain"),
    ],
)
def test_a_wrong_address_is_refused(address, words):
    with pytest.raises(ValueError, match=words) as refusal:
        open_publisher(address, rate=100.0)
    assert str(refusal.value).startswith(address)
