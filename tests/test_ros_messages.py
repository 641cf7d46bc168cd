"""ROS 2 messages: bytes, hashes and names against tables that share no code."""

import math
import signal
import subprocess
import sys

import pytest
import ros_graph
from hypothesis import given, settings
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.finger.ros2 import RosNode, ros_address
from ikns.finger.ros2.cdr import decode, encode
from ikns.finger.ros2.definitions import definitions, type_hash
from ikns.finger.ros2.keys import endpoint_token, read_token, topic_key

NUMBERS = {
    "int8": st.integers(-128, 127),
    "byte": st.integers(0, 127),
    "int32": st.integers(-(2**31), 2**31 - 1),
    "uint32": st.integers(0, 2**32 - 1),
    "float64": st.floats(allow_nan=False),
    "string": st.text(
        st.characters(exclude_characters="\0", codec="utf-8"), max_size=9
    ),
}


def messages(type_name):
    """Any message of a type."""
    parts = {}
    for name, kind, sequence in definitions()[type_name]:
        one = NUMBERS[kind] if kind in NUMBERS else messages(kind)
        parts[name] = st.lists(one, max_size=3) if sequence else one
    return st.fixed_dictionaries(parts)


def flat(layout, message):
    """The message in the form of the tests' own table."""
    left = dict(message)
    for name in ("header", "stamp", "layout", "time_from_start", "translation"):
        left |= left.pop(name, {})
    left |= left.pop("stamp", {})
    record = {}
    for name, kind in layout:
        value = left[name.removeprefix("stamp.")]
        inner = isinstance(kind, list) and not isinstance(kind[0], str)
        record[name] = [flat(kind, each) for each in value] if inner else value
    return record


@pytest.mark.parametrize("type_name", ros_graph.HASHES)
def test_a_hash_is_the_one_of_ros(type_name):
    assert type_hash(type_name) == ros_graph.HASHES[type_name]


@settings(max_examples=40)
@given(data=st.data(), type_name=st.sampled_from(list(ros_graph.LAYOUTS)))
def test_bytes_are_those_of_another_implementation(data, type_name):
    message = data.draw(messages(type_name))
    table = flat(ros_graph.LAYOUTS[type_name], message)
    sent = encode(type_name, message)
    assert sent == ros_graph.write(type_name, table)
    assert ros_graph.read(type_name, sent) == table
    back = decode(type_name, sent)
    assert encode(type_name, back) == sent


@given(
    type_name=st.sampled_from(list(ros_graph.LAYOUTS)),
    data=st.binary(max_size=200),
)
def test_any_bytes_are_a_message_or_are_refused(type_name, data):
    for header in (b"", b"\0\1\0\0", b"\0\0\0\0"):
        try:
            decode(type_name, header + data)
        except ValueError:
            continue


def test_big_endian_is_read_too():
    data = b"\0\0\0\0" + bytes.fromhex("3fe0000000000000")
    assert decode("std_msgs/msg/Float64", data) == {"data": 0.5}


@pytest.mark.parametrize("type_name", ros_graph.LAYOUTS)
def test_keys_are_those_of_rmw_zenoh(type_name):
    assert topic_key(0, "/a/b", type_name) == ros_graph.key("/a/b", type_name)
    token = endpoint_token(3, "5f", 1, "MP", "node", "/a/b", type_name)
    head, rest = token.split("/%a%b/")
    assert head == "@ros2_lv/3/5f/0/1/MP/%/%/node"
    hashed = ros_graph.HASHES[type_name]
    assert rest == f"{ros_graph.dds(type_name)}/{hashed}/::,10:,:,:,,"
    assert read_token(token) == ("node", "/a/b", type_name, hashed)


def test_a_domain_comes_from_the_address_or_from_the_environment(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    assert ros_address("a", {}) == ("/a", "127.0.0.1", 7447, 7)
    assert ros_address("a", {"domain": "2", "router": "[::1]:1"}) == ("/a", "::1", 1, 2)
    monkeypatch.setenv("ROS_DOMAIN_ID", "x")
    with pytest.raises(InvalidInput, match="ROS_DOMAIN_ID to be a number"):
        ros_address("a", {})


def test_a_router_for_trying_things_serves_this_machine_only():
    port = str(ros_graph.free_port())
    command = [sys.executable, "-m", "ikns.finger.ros2.router", port]
    router = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert "listens at tcp/127.0.0.1" in router.stderr.readline()
        RosNode(
            ros_address("/a", {"router": f"127.0.0.1:{port}"}), needed_by="a test"
        ).close()
        second = subprocess.run(command, capture_output=True, text=True, check=False)
        assert second.returncode == 2
        assert "to be a free port" in second.stderr
    finally:
        router.send_signal(signal.SIGINT)
        assert router.wait(10) == 0
        router.stderr.close()


def test_not_a_number_survives():
    back = decode(
        "std_msgs/msg/Float64", encode("std_msgs/msg/Float64", {"data": math.nan})
    )
    assert math.isnan(back["data"])
