"""A ROS 2 graph of the tests' own: a router, and a peer that uses nothing of ours.

Keys, tokens and CDR are written down here from rmw_zenoh's design document and the OMG
standard; hashes are those that ROS's own code generator printed into the C sources of
the packages (``*__description.c``).
"""

import itertools
import json
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import uuid

import zenoh

#: Type hashes by ROS's code generator.
HASHES = {
    "std_msgs/msg/String":
    "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    "std_msgs/msg/Float64":
    "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a",
    "std_msgs/msg/Float64MultiArray":
    "RIHS01_1025ddc6b9552d191f89ef1a8d2f60f3d373e28b283d8891ddcc974e8c55397f",
    "std_msgs/msg/Header":
    "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
    "sensor_msgs/msg/JointState":
    "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
    "diagnostic_msgs/msg/DiagnosticArray":
    "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    "diagnostic_msgs/msg/DiagnosticStatus":
    "RIHS01_b0e3e692ea2d54a8af2f4ef1930e81556a2db55216b771f8a7d2724ed47bf0e4",
    "trajectory_msgs/msg/JointTrajectory":
    "RIHS01_179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e",
    "mocap4r2_msgs/msg/Marker":
    "RIHS01_0cadb14b00eb93dfd5d1b774f04f13efc0c2e08a3bee1abbaef9f67f6b10b943",
    "mocap4r2_msgs/msg/Markers":
    "RIHS01_36a59e85fa0dcebed1f0a91d748ca17e259b187f779e725af5c6701e8a03054a",
}  # fmt: skip
HEADER = [("stamp.sec", "i"), ("stamp.nanosec", "I"), ("frame_id", "s")]
#: Fields in the order of the bytes: i, I, b, d as in `struct`, s a string, [...] any
#: number of what follows.
LAYOUTS = {
    "std_msgs/msg/String": [("data", "s")],
    "std_msgs/msg/Float64": [("data", "d")],
    "std_msgs/msg/Float64MultiArray": [
        ("dim", [("label", "s"), ("size", "I"), ("stride", "I")]),
        ("data_offset", "I"),
        ("data", ["d"]),
    ],
    "sensor_msgs/msg/JointState": [
        *HEADER,
        ("name", ["s"]),
        ("position", ["d"]),
        ("velocity", ["d"]),
        ("effort", ["d"]),
    ],
    "diagnostic_msgs/msg/DiagnosticArray": [
        *HEADER,
        (
            "status",
            [
                ("level", "b"),
                ("name", "s"),
                ("message", "s"),
                ("hardware_id", "s"),
                ("values", [("key", "s"), ("value", "s")]),
            ],
        ),
    ],
    "trajectory_msgs/msg/JointTrajectory": [
        *HEADER,
        ("joint_names", ["s"]),
        (
            "points",
            [
                ("positions", ["d"]),
                ("velocities", ["d"]),
                ("accelerations", ["d"]),
                ("effort", ["d"]),
                ("sec", "i"),
                ("nanosec", "I"),
            ],
        ),
    ],
    "mocap4r2_msgs/msg/Markers": [
        *HEADER,
        ("frame_number", "I"),
        (
            "markers",
            [
                ("id_type", "b"),
                ("marker_index", "i"),
                ("marker_name", "s"),
                ("x", "d"),
                ("y", "d"),
                ("z", "d"),
            ],
        ),
    ],
}


class Bytes:
    """Walks over the bytes of a message, to read or to write them."""

    def __init__(self, data=b""):
        self.data, self.at = bytearray(data[4:]), 0

    def pad(self, size):
        while self.at % size:
            self.at += 1

    def get(self, kind):
        if isinstance(kind, list):
            count = self.get("I")
            inner = kind[0] if isinstance(kind[0], str) else kind
            return [self.get(inner) if isinstance(inner, str) else self.record(inner)
                    for _ in range(count)]  # fmt: skip
        if kind == "s":
            count = self.get("I")
            self.at += count
            assert self.data[self.at - 1] == 0
            return bytes(self.data[self.at - count : self.at - 1]).decode()
        size = struct.calcsize(kind)
        self.pad(size)
        self.at += size
        return struct.unpack("<" + kind, self.data[self.at - size : self.at])[0]

    def record(self, layout):
        return {name: self.get(kind) for name, kind in layout}

    def put(self, kind, value):
        if isinstance(kind, list):
            self.put("I", len(value))
            for each in value:
                if isinstance(kind[0], str):
                    self.put(kind[0], each)
                else:
                    self.put_record(kind, each)
        elif kind == "s":
            self.put("I", len(value.encode()) + 1)
            self.data += value.encode() + b"\0"
        else:
            self.data += bytes(-len(self.data) % struct.calcsize(kind))
            self.data += struct.pack("<" + kind, value)

    def put_record(self, layout, values):
        for name, kind in layout:
            self.put(kind, values[name])


def read(type_name, data):
    """Decode a message, to its last byte."""
    assert data[:4] == b"\0\1\0\0"
    walk = Bytes(data)
    message = walk.record(LAYOUTS[type_name])
    assert walk.at == len(walk.data)
    return message


def write(type_name, message):
    walk = Bytes()
    walk.put_record(LAYOUTS[type_name], message)
    return b"\0\1\0\0" + bytes(walk.data)


def dds(type_name):
    package, kind, name = type_name.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def key(topic, type_name, domain=0):
    return f"{domain}{topic}/{dds(type_name)}/{HASHES[type_name]}"


def token(session, kind, topic, type_name, *, domain=0, node="theirs", hashed=None):
    mangled = topic.replace("/", "%")
    return (
        f"@ros2_lv/{domain}/{session.info.zid()}/0/7/{kind}/%/%/{node}/{mangled}/"
        f"{dds(type_name)}/{hashed or HASHES[type_name]}/::,10:,:,:,,"
    )


def session(mode, port):
    """Open a zenoh session: a router that listens on loopback, or its client."""
    configuration = zenoh.Config()
    ends = json.dumps([f"tcp/127.0.0.1:{port}"])
    for path, value in {
        "mode": json.dumps(mode),
        "listen/endpoints": ends if mode == "router" else "[]",
        "connect/endpoints": "[]" if mode == "router" else ends,
        "scouting/multicast/enabled": "false",
        "scouting/gossip/enabled": "false",
    }.items():
        configuration.insert_json5(path, value)
    return zenoh.open(configuration)


class Peer:
    """A client of the router that speaks as a ROS node does."""

    def __init__(self, port):
        self.session = session("client", port)
        self.kept = []

    def listen(self, topic, type_name):
        """Return a list that grows by (time, message, attachment)."""
        heard = []

        def take(sample):
            at = time.monotonic()
            message = read(type_name, sample.payload.to_bytes())
            heard.append((at, message, sample.attachment.to_bytes().hex()))

        handler = zenoh.handlers.Callback(take, indirect=False)
        where = key(topic, type_name)
        self.kept.append(self.session.declare_subscriber(where, handler))
        self.announce("MS", topic, type_name)
        return heard

    def publisher(self, topic, type_name, **about):
        self.announce("MP", topic, type_name, **about)
        # It waits, as the tests count what arrives on a machine that is busy.
        made = self.session.declare_publisher(
            key(topic, type_name),
            express=True,
            congestion_control=zenoh.CongestionControl.BLOCK,
        )
        self.kept.append(made)
        own, count = uuid.uuid4().bytes, itertools.count(1)

        def put(message):
            about = struct.pack("<qqB", next(count), time.time_ns(), len(own)) + own
            made.put(write(type_name, message), attachment=about)

        return put

    def announce(self, kind, topic, type_name, **about):
        where = token(self.session, kind, topic, type_name, **about)
        self.kept.append(self.session.liveliness().declare_token(where))

    def tokens(self, under):
        return [
            str(reply.ok.key_expr) for reply in self.session.liveliness().get(under)
        ]

    def close(self):
        self.session.close()


class Robot(Peer):
    """A robot with a joint that goes where it is told, and stays there in silence.

    A trajectory is followed as joint_trajectory_controller does: a straight line to its
    one point.

    Attributes
    ----------
    goals : list of (time, position)
    position : float
        Of its joint "finger".
    """

    def __init__(self, port, *, command="joint_trajectory", position=0.0, joints=None):
        super().__init__(port)
        self.position, self.goals = position, []
        self._names = joints or ["wrist", "finger"]
        self._goal, self._reach = position, 0.01
        self.quiet, self._end = threading.Event(), threading.Event()
        kinds = {
            "joint_trajectory": "trajectory_msgs/msg/JointTrajectory",
            "position": "std_msgs/msg/Float64MultiArray",
        }
        handler = zenoh.handlers.Callback(self._obey, indirect=False)
        self._kind = kinds[command]
        where = key("/finger/commands", self._kind)
        self.controller = self.session.declare_subscriber(where, handler)
        self.announce("MS", "/finger/commands", self._kind)
        self._tell = self.publisher("/joint_states", "sensor_msgs/msg/JointState")
        self._thread = threading.Thread(target=self._live)
        self._thread.start()

    def _obey(self, sample):
        message = read(self._kind, sample.payload.to_bytes())
        if "points" in message:
            assert message["joint_names"] == ["finger"]
            assert message["stamp.sec"] == message["stamp.nanosec"] == 0
            (point,) = message["points"]
            (self._goal,) = point["positions"]
            self._reach = point["sec"] + 1e-9 * point["nanosec"]
        else:
            (self._goal,) = message["data"]
            assert (message["dim"], message["data_offset"]) == ([], 0)
        self.goals.append((time.monotonic(), self._goal))

    def _live(self):
        before = time.monotonic()
        while not self._end.wait(0.005):
            now = time.monotonic()
            share = min((now - before) / max(self._reach, 1e-3), 1)
            self.position += share * (self._goal - self.position)
            before = now
            if not self.quiet.is_set():
                places = [0.7 if n == "wrist" else self.position for n in self._names]
                self._tell(
                    {
                        "stamp.sec": 1,
                        "stamp.nanosec": 0,
                        "frame_id": "",
                        "name": self._names,
                        "position": places,
                        "velocity": [],
                        "effort": [],
                    }
                )

    def close(self):
        self._end.set()
        self._thread.join()
        super().close()


class Graph:
    """A router in a process of its own, with a node that keeps what topics say.

    Parameters
    ----------
    topics : dict of str
        Types by topic.
    """

    def __init__(self, topics=None, *, port=None):
        self.port = port or free_port()
        pairs = [word for pair in (topics or {}).items() for word in pair]
        self.process = subprocess.Popen(
            [sys.executable, __file__, str(self.port), *pairs],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout.readline() == "ready\n"
        self.heard = {}

    def end(self):
        """End it in order; return messages by topic, as (time, message, attachment)."""
        if self.process.poll() is None:
            self.heard = json.loads(self.process.communicate()[0])
        return self.heard

    def kill(self):
        self.process.kill()
        self.process.wait()

    def pause(self):
        self.process.send_signal(signal.SIGSTOP)

    def go_on(self):
        self.process.send_signal(signal.SIGCONT)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()
        self.process.stdin.close()
        self.process.stdout.close()


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def attached(about):
    """Number, source time in ns, and identity of who sent, of an attachment."""
    data = bytes.fromhex(about)
    number, at, length = struct.unpack_from("<qqB", data)
    assert len(data) == 17 + length == 33
    return number, at, data[17:]


def main():
    """Be a router on loopback, and a node that listens, until standard input ends."""
    port, *words = sys.argv[1:]
    opened = session("router", int(port))
    peer = Peer(int(port))
    pairs = zip(words[::2], words[1::2], strict=True)
    heard = {topic: peer.listen(topic, kind) for topic, kind in pairs}
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    sys.stdin.read()
    json.dump(heard, sys.stdout)
    peer.close()
    opened.close()


if __name__ == "__main__":
    main()
