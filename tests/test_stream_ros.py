"""Markers from a ROS 2 topic: what is read, and what is refused, in one sentence."""

import threading
import time

import numpy as np
import pytest
import ros_graph
from hypothesis import given, settings
from hypothesis import strategies as st
from ros_graph import Graph, Peer

from ikns.errors import InvalidInput, StreamError
from ikns.finger.ros2.cdr import decode
from ikns.live.stream import open_source
from ikns.live.stream.ros_markers import MarkersReader

TYPE = "mocap4r2_msgs/msg/Markers"
LABELS = ("RSHO", "RELB", "RWRA")
POINTS = np.random.default_rng(3).normal(size=(60, 3, 3))
#: So many frames are looked at before a source is open.
FIRST = 20


def message(k, points, names=LABELS, *, index_only=False, rate=100, stamped=True):
    """A message as a driver of MOCAP4ROS2 makes it."""
    ns = 10**18 + k * round(1e9 / rate)
    return {
        "stamp.sec": ns // 10**9 * stamped,
        "stamp.nanosec": ns % 10**9 * stamped,
        "frame_id": "map",
        "frame_number": k,
        "markers": [
            {
                "id_type": int(index_only),
                "marker_index": i,
                "marker_name": "" if index_only else name,
                **dict(zip("xyz", point, strict=True)),
            }
            for i, (name, point) in enumerate(zip(names, points, strict=True))
        ],
    }


@pytest.fixture(scope="module")
def graph():
    with Graph() as made:
        yield made


@pytest.fixture
def peer(graph):
    made = Peer(graph.port)
    yield made
    made.close()


def address(graph, topic, more=""):
    return f"ros2:{topic}?router=127.0.0.1:{graph.port}&domain=0{more}"


class Sender:
    """Publishes messages from a thread while a source is being opened."""

    def __init__(self, peer, topic, messages, **about):
        put = peer.publisher(topic, TYPE, **about)

        def send():
            while not self.done.wait(0.005):
                put(next(self.messages))

        self.messages, self.done = messages, threading.Event()
        self.thread = threading.Thread(target=send)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.done.set()
        self.thread.join()


def endless(make):
    k = 0
    while True:
        yield make(k)
        k += 1


def read(source, n):
    frames = []
    while len(frames) < n:
        frame = source.read(10.0)
        assert frame is not None
        frames.append(frame)
    return frames


def test_frames_arrive_with_number_time_and_markers(graph, peer):
    hidden = POINTS.copy()
    hidden[::7, 1] = 0.0  # as Vicon's driver tells that it is not seen

    def make(k):
        points = hidden[k % 60]
        # In every fifth message the last marker is left out.
        last = 2 if k % 5 == 4 else 3
        return message(k, points[:last], LABELS[:last])

    with Sender(peer, "/markers", endless(make)):
        with open_source(address(graph, "/markers")) as source:
            assert source.labels == LABELS
            # 20 stamps at 100 Hz, in whole nanoseconds.
            assert source.rate == pytest.approx(100, rel=1e-6)
            frames = read(source, 70)
            assert source.continuity.counts.dropped == 0
    numbers = [frame.number for frame in frames]
    assert numbers == list(range(numbers[0], numbers[0] + 70))
    assert numbers[0] >= FIRST
    for frame in frames:
        k = frame.number
        expected = hidden[k % 60].copy()
        expected[(expected == 0).all(axis=1)] = np.nan
        if k % 5 == 4:
            expected[2] = np.nan
        np.testing.assert_array_equal(frame.markers, expected)
        # Seconds since the first frame's whole second; a nanosecond is lost in float64.
        assert frame.device_time == pytest.approx(k / 100, abs=1e-8)
        assert 0 <= time.monotonic() - frame.receive_time < 60


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda k: message(k, POINTS[k % 60], index_only=True),
            "expected markers with names, found 3 that have an index only",
        ),
        (
            lambda k: message(k, POINTS[k % 60], ("RSHO", "RSHO", "RWRA")),
            "found two markers named RSHO",
        ),
        (lambda k: message(k, POINTS[k % 60], stamped=False), "stamps that advance"),
        (lambda k: message(k, [], []), "expected labeled markers, found none"),
    ],
)
def test_what_cannot_be_used_is_refused(graph, peer, make, words):
    with Sender(peer, "/markers", endless(make)):
        with pytest.raises(StreamError, match=words):
            open_source(address(graph, "/markers"))


def test_what_is_wrong_with_a_topic_is_said(graph, peer):
    def refused(topic):
        with pytest.raises(StreamError) as refusal:
            open_source(address(graph, topic, "&timeout=0.3"))
        return str(refusal.value)

    peer.publisher("/states", "sensor_msgs/msg/JointState")
    assert "found one of sensor_msgs/msg/JointState." in refused("/states")
    assert "on this topic in domain 0, found none; start" in refused("/nothing")
    peer.publisher("/quiet", TYPE)
    assert "within 0.3 s, found none; start the capture" in refused("/quiet")
    assert "found none but on /quiet; " in refused("/nothing")
    peer.announce("MP", "/own", TYPE, hashed="RIHS01_" + "0" * 64)
    assert "with another definition" in refused("/own")
    put = peer.publisher("/slow", TYPE)
    timer = threading.Timer(0.1, lambda: put(message(0, POINTS[0])))
    timer.start()
    assert "found 1 frames" in refused("/slow")
    timer.join()


def test_no_router_is_said():
    port = ros_graph.free_port()
    with pytest.raises(StreamError, match="expected a zenoh router at 127.0.0.1:"):
        open_source(f"ros2:/markers?router=127.0.0.1:{port}")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("ros2:", "ros2:TOPIC"),
        ("ros2:/a b", "letters, digits"),
        ("ros2:/a?rate=x", "a number for rate"),
        ("ros2:/a?rate=0", "a rate above 0"),
        ("ros2:/a?router=7447", "router=HOST:PORT"),
        ("ros2:/a?host=x", "unknown option 'host'"),
    ],
)
def test_a_wrong_address_is_refused(text, words):
    with pytest.raises(InvalidInput, match=words):
        open_source(text)


def test_after_a_break_of_the_router_frames_come_again():
    port = ros_graph.free_port()
    messages = endless(lambda k: message(k, POINTS[k % 60]))
    with Graph(port=port) as first:
        peer = Peer(port)
        with Sender(peer, "/markers", messages):
            with open_source(address(first, "/markers")) as source:
                read(source, 3)
                first.kill()
                give_up = time.monotonic() + 20
                while source.read(0.3) is not None:
                    assert time.monotonic() < give_up
                with Graph(port=port):
                    while source.read(0.1) is None:
                        assert time.monotonic() < give_up
                    told = " ".join(event.text for event in source.events)
        peer.close()
    assert "the router went away" in told


def test_two_publishers_of_a_topic_are_refused(graph, peer):
    ours, theirs = (endless(lambda k: message(k, POINTS[k % 60])) for _ in range(2))
    with Sender(peer, "/both", ours), Sender(peer, "/both", theirs, node="stage"):
        with pytest.raises(StreamError) as error:
            open_source(address(graph, "/both"))
    assert "found frames of 2 (nodes stage and theirs); stop" in str(error.value)


def test_a_second_publisher_is_ignored_until_the_first_has_stopped(graph, peer):
    """Theirs has other places and numbers far ahead."""
    other = endless(lambda k: message(10**6 + k, POINTS[k % 60] + 9.0))
    with Sender(peer, "/taken", endless(lambda k: message(k, POINTS[k % 60]))) as first:
        with open_source(address(graph, "/taken")) as source:
            read(source, 3)
            with Sender(peer, "/taken", other):
                give_up = time.monotonic() + 20
                while not source.events:
                    assert (read(source, 1)[0].markers < 5.0).all()
                    assert time.monotonic() < give_up
                ours = read(source, 20)
                first.done.set()
                first.thread.join()
                while (new := read(source, 1)[0]).markers.max() < 5.0:
                    ours.append(new)
                assert time.monotonic() - ours[-1].receive_time > 0.9
                theirs = [new, *read(source, 20)]
            told = [event.text for event in source.events]
            counts = source.continuity.counts
    assert all((frame.markers < 5.0).all() for frame in ours)
    assert all((frame.markers > 5.0).all() for frame in theirs)
    assert [frame.number for frame in theirs] == [
        ours[-1].number + 1 + k for k in range(21)
    ]
    assert (counts.dropped, counts.repeated, counts.out_of_order) == (0, 0, 0)
    assert "frames of another publisher also arrive and are ignored" in told[0]
    assert any("another publisher is read, as frames of the first" in t for t in told)


def test_damaged_messages_are_told_and_left_out(graph, peer):
    with Sender(peer, "/markers", endless(lambda k: message(k, POINTS[k % 60]))) as s:
        with open_source(address(graph, "/markers")) as source:
            read(source, 3)
            s.done.set()
            while source.read(0.2):
                pass
            raw = peer.session.declare_publisher(ros_graph.key("/markers", TYPE))
            raw.put(ros_graph.write(TYPE, message(0, POINTS[0]))[:-5])
            assert source.read(0.2) is None
            peer.kept[-1].put(ros_graph.write(TYPE, message(7, POINTS[7])))
            assert read(source, 1)[0].number == 7
            told = [event.text for event in source.events]
    assert any("a frame is not read: the message ends too early" in t for t in told)


@settings(max_examples=60)
@given(data=st.data())
def test_the_quick_way_reads_what_the_fields_say(data):
    names = data.draw(st.lists(st.text("AbÄ_1", max_size=6), max_size=4))
    reader = MarkersReader()
    for k in range(3):
        points = data.draw(
            st.lists(st.tuples(*[st.floats(allow_nan=False)] * 3), min_size=len(names),
                     max_size=len(names))
        )  # fmt: skip
        sent = ros_graph.write(TYPE, message(k, points, names))
        found, fields = reader.read(sent), decode(TYPE, sent)
        assert found.number == fields["frame_number"] == k
        assert found.names == tuple(m["marker_name"] for m in fields["markers"])
        told = [list(m["translation"].values()) for m in fields["markers"]]
        np.testing.assert_array_equal(found.markers, np.reshape(told, (-1, 3)))
        names = data.draw(st.permutations(names))
    cut = data.draw(st.integers(0, len(sent) - 1))
    with pytest.raises(ValueError, match=r"too early|not a CDR"):
        reader.read(sent[:cut])
