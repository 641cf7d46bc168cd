"""What does publishing cost the finger; what do streams take? Three tables.

1. A simulated body swings its arm at 100 Hz through the live loop to a simulated
   finger: without a publisher; with `--publish lsl:NAME` and `ros2:NAMESPACE`, without
   and with a listener in another process; with all of them and Rerun's file (where
   Rerun is installed) together; and with publishers that block for ever or die. In
   turns, a second at a time: from receipt to command (median of the percentiles of each
   second), and to the end of the iteration, when the sample is handed over (all
   frames).
2. 39 simulated markers from another process on this machine, from sending to receipt:
   LSL, as `ikns stream` sends them; the server of the tests, which speaks NatNet 4.1;
   and a ROS 2 node of the tests with `mocap4r2_msgs/msg/Markers`, through a zenoh
   router in a third process.
3. A finger under ROS 2, its robot simulated: from a fault to the safe state.

`--only publish`, `streams` or `finger` makes one of the tables.
"""

import argparse
import importlib.util
import json
import multiprocessing
import os
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

import ikns
from ikns.finger import open_finger
from ikns.live.publish import Publisher, Publishers, joint_places, open_publisher
from ikns.live.runtime import run
from ikns.live.runtime.listener import LoopListener
from ikns.live.stream import LslOutlet, Source, open_source
from ikns.live.stream.lsl_library import lsl
from ikns.live.stream.replay import Replay, wait_until
from ikns.recording.recording import Recording

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import ros_graph

RATE, MARKERS = 100.0, 39
CONTEXT = multiprocessing.get_context("spawn")
NOTHING, TOGETHER, BLOCKED, DYING = "nothing", "all together", "blocked", "dying"
LSL, LSL_HEARD = "LSL, no listener", "LSL, one listener"
ROS, ROS_HEARD = "ROS 2, no listener", "ROS 2, one listener"
KINDS = (NOTHING, LSL, LSL_HEARD, ROS, ROS_HEARD, TOGETHER, BLOCKED, DYING)
TOPICS = {
    "/heard/c": "std_msgs/msg/Float64",
    "/heard/flexion": "std_msgs/msg/Float64",
    "/heard/joint_states": "sensor_msgs/msg/JointState",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}


def swinging(frames: int) -> tuple[ikns.Subject, Recording]:
    """Return a body with a map that is written down, and its simulated markers."""
    body = ikns.Skeleton.load()
    points = 0.3 * np.array(list(np.ndindex(2, 2, 2))) - [0.1, 0.7, -0.1]
    learned = ikns.NullSpaceMap.from_arrays(
        points, np.eye(7)[[1] * 8], np.zeros(8), np.ones(8)
    )
    joint = 7 + body.joint_names.index("right_shoulder_flexion")
    time_s, q = np.arange(frames) / RATE, body.neutral()
    markers = []
    for t in time_s:
        swung = q.copy()
        swung[joint] += 0.2 * np.sin(2 * t)
        markers.append(body.markers_in_world(swung))
    recording = Recording(
        time_s, np.array(markers), body.marker_set.labels, "simulated"
    )
    return ikns.Subject(body, learned, "right_arm", {}), recording


def listen(name: str, ready: Connection) -> None:
    """Pull both streams until told to end."""
    pylsl = lsl("the benchmark", this_machine=True)
    inlets = []
    for each in (name, f"{name}-events"):
        (found,) = pylsl.resolve_byprop("name", each, 1, 30)
        inlets.append(pylsl.StreamInlet(found, recover=False))
        inlets[-1].open_stream(30)
    ready.send(True)
    pulled = 0
    while not ready.poll():
        pulled += inlets[0].pull_sample(0.05)[0] is not None
        inlets[1].pull_sample(0.0)
    ready.send(pulled)


class Stuck:
    """A sink whose first call never returns."""

    def sample(self, at: float, sample: object) -> None:
        """Wait for ever."""
        threading.Event().wait()

    def event(self, at: float, words: str) -> None:
        """Wait for ever."""
        threading.Event().wait()

    def close(self) -> None:
        """Do nothing."""


class Dying(Stuck):
    """A sink whose first call fails."""

    def sample(self, at: float, sample: object) -> None:
        """Fail."""
        raise OSError("the cable is out")

    def event(self, at: float, words: str) -> None:
        """Fail."""
        raise OSError("the cable is out")


def opened(
    stack: ExitStack, subject: ikns.Subject, own: str, port: int
) -> dict[str, list[Publisher]]:
    """Open the publishers of each kind."""
    joints = joint_places(subject.skeleton, subject.chain)

    def open_one(address: str) -> Publisher:
        return stack.enter_context(
            open_publisher(address, rate=RATE, joints=joints, simulated=True)
        )

    router = f"?router=127.0.0.1:{port}&domain=0"
    kinds = {
        NOTHING: [],
        LSL: [open_one(f"lsl:{own}-alone")],
        LSL_HEARD: [open_one(f"lsl:{own}-heard")],
        ROS: [open_one(f"ros2:alone{router}")],
        ROS_HEARD: [open_one(f"ros2:heard{router}")],
        BLOCKED: [stack.enter_context(Publisher("stuck", Stuck()))],
        DYING: [stack.enter_context(Publisher("dying", Dying()))],
    }
    kinds[TOGETHER] = kinds[LSL_HEARD] + kinds[ROS_HEARD]
    if importlib.util.find_spec("rerun"):
        from ikns.view.timeline import RerunLog, RerunSink

        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        sink = RerunSink(RerunLog(folder / "a.rrd", title="a"), subject.skeleton)
        kinds[TOGETHER].append(stack.enter_context(Publisher("rerun", sink)))
    return kinds


def published(seconds: float) -> dict[str, dict[str, float]]:
    """Percentiles of the loop in ms, by kind of publisher."""
    subject, recording = swinging(round(RATE * min(seconds, 1.0)))
    own = f"ikns-benchmark-{os.getpid()}"
    times: dict[str, tuple[list[list[float]], list[float]]] = {
        kind: ([], []) for kind in KINDS
    }
    ours, theirs = CONTEXT.Pipe()
    with ros_graph.Graph(TOPICS) as graph:
        with ExitStack() as stack:
            kinds = opened(stack, subject, own, graph.port)
            reader = CONTEXT.Process(target=listen, args=(f"{own}-heard", theirs))
            reader.start()
            ours.recv()
            for _ in range(max(1, round(seconds))):
                for kind in KINDS:
                    one(subject, recording, Publishers(kinds[kind]), times[kind])
            while any(each.sent + each.dropped < 1 for each in kinds[TOGETHER]):
                time.sleep(0.01)
            ours.send(None)
            pulled = ours.recv()
            reader.join()
        heard = graph.end()
    result = {}
    for kind, (command, end) in times.items():
        counts = Publishers(kinds[kind]).counts
        p50, p99 = 1e3 * np.median(command, axis=0)
        last50, last99 = 1e3 * np.percentile(end, [50, 99])
        result[kind] = {
            "command p50": p50,
            "p99": p99,
            "end p50": last50,
            "p99 ": last99,
            "sent": counts["sent"],
            "dropped": counts["dropped"],
        }
    result[LSL_HEARD]["pulled"] = pulled
    result[ROS_HEARD]["heard"] = len(heard["/heard/c"])
    result[TOGETHER]["added at p99"] = result[TOGETHER]["p99"] - result[NOTHING]["p99"]
    return result


def one(
    subject: ikns.Subject,
    recording: Recording,
    publisher: LoopListener,
    into: tuple[list[list[float]], list[float]],
) -> None:
    """Run the loop for a second."""
    command, end = into
    with Source(Replay(recording)) as source:
        report = run(
            source,
            subject,
            ikns.SimulatedFinger(),
            listener=publisher,
            on_decision=lambda received, *_: end.append(time.monotonic() - received),
        )
    total = report.stages["total"]
    command.append([total.percentile(50), total.percentile(99)])


def serve_natnet(frames: int, result: Connection) -> None:
    """Send simulated markers by NatNet, then report when each frame was sent."""
    from natnet_server import NatNetServer

    points = np.random.default_rng(0).normal(size=(MARKERS, 3))
    labels = [f"M{k}" for k in range(MARKERS)]
    sent = np.empty(frames)
    with NatNetServer({"simulated": labels}) as server:
        result.send(server.port)
        server.streaming.wait(60)
        start = time.monotonic()
        for k in range(frames):
            wait_until(start + k / RATE)
            sent[k] = time.monotonic()
            server.send(k, sent[k], points)
        result.recv()
        result.send(sent)


def over_natnet(seconds: float) -> dict[str, float]:
    """Latency of NatNet frames in ms, and what was lost."""
    frames = round(seconds * RATE)
    ours, theirs = CONTEXT.Pipe()
    sender = CONTEXT.Process(target=serve_natnet, args=(frames, theirs))
    sender.start()
    with open_source(f"natnet:127.0.0.1:{ours.recv()}?timeout=60") as source:
        return read_all(source, frames, ours)


def read_all(source: Source, frames: int, ours: Connection) -> dict[str, float]:
    """Read to the last frame; return percentiles of their latency in ms.

    Frames are known by their numbers, and when each was sent by what the sender says in
    the end, so that no clock but this machine's counts. Frames before the first that is
    read were sent before anyone listened.
    """
    received: dict[int, float] = {}
    number = -1
    while number < frames - 1:
        frame = next(source)
        number = frame.number
        received.setdefault(number, frame.receive_time)
    lost = source.continuity.counts.dropped
    ours.send(None)
    sent = ours.recv()
    late = np.array(list(received.values())) - sent[list(received)]
    p50, p99, most = 1e3 * np.percentile(late, [50, 99, 100])
    return {
        "frames": len(late), "p50": p50, "p99": p99, "max": most, "dropped": lost,
    }  # fmt: skip


def serve_ros(port: int, frames: int, result: Connection) -> None:
    """Publish simulated markers to ROS 2, then report when each frame was sent."""
    peer = ros_graph.Peer(port)
    put = peer.publisher("/markers", "mocap4r2_msgs/msg/Markers")
    points = np.random.default_rng(0).normal(size=(MARKERS, 3)).tolist()
    markers = [
        {
            "id_type": 0,
            "marker_index": k,
            "marker_name": f"M{k}",
            "x": x,
            "y": y,
            "z": z,
        }
        for k, (x, y, z) in enumerate(points)
    ]
    sent = np.empty(frames)
    start = time.monotonic() + 0.5
    for k in range(frames):
        wait_until(start + k / RATE)
        now = time.monotonic_ns()
        sent[k] = now / 1e9
        put(
            {
                "stamp.sec": now // 10**9,
                "stamp.nanosec": now % 10**9,
                "frame_id": "map",
                "frame_number": k,
                "markers": markers,
            }
        )
    result.recv()
    result.send(sent)
    peer.close()


def over_ros(seconds: float) -> dict[str, float]:
    """Latency of ROS 2 frames in ms, and what was lost."""
    frames = round(seconds * RATE) + 40
    ours, theirs = CONTEXT.Pipe()
    with ros_graph.Graph() as graph:
        sender = CONTEXT.Process(target=serve_ros, args=(graph.port, frames, theirs))
        sender.start()
        router = f"router=127.0.0.1:{graph.port}&domain=0&timeout=60&rate={RATE}"
        with open_source(f"ros2:/markers?{router}") as source:
            row = read_all(source, frames, ours)
        sender.join()
    return row


def serve_lsl(name: str, frames: int, result: Connection) -> None:
    """Send simulated markers over LSL, then report when each frame was sent."""
    points = np.random.default_rng(0).normal(size=(MARKERS, 3))
    sent = np.empty(frames)
    with LslOutlet([f"M{k}" for k in range(MARKERS)], RATE, name=name) as outlet:
        if not outlet.wait_for_listener(60):
            sys.exit("nobody listened")
        start = time.monotonic() + 0.2
        for k in range(frames):
            sent[k] = wait_until(start + k / RATE)
            outlet.push(points, start + k / RATE)
        result.recv()
        result.send(sent)


def over_lsl(seconds: float) -> dict[str, float]:
    """Latency of LSL frames in ms, and what was lost."""
    frames, name = round(seconds * RATE), f"ikns-benchmark-{os.getpid()}-markers"
    ours, theirs = CONTEXT.Pipe()
    CONTEXT.Process(target=serve_lsl, args=(name, frames, theirs)).start()
    with open_source(f"lsl:{name}?scope=machine&timeout=60") as source:
        return read_all(source, frames, ours)


def faults_of_a_ros_finger(repeats: int) -> dict[str, dict[str, float]]:
    """Time from a fault to the safe state, ms."""
    result = {}
    for fault in ("router killed", "router stopped", "feedback silent"):
        took = []
        for _ in range(repeats):
            with ros_graph.Graph() as graph:
                robot = ros_graph.Robot(graph.port, position=0.5)
                with open_finger(
                    "ros2:finger/commands?type=joint_trajectory&joint=finger&open=0"
                    f"&closed=1&router=127.0.0.1:{graph.port}&domain=0&safe=hold"
                    "&feedback=joint_states"
                ) as finger:
                    began = time.monotonic()
                    while time.monotonic() - began < 0.2:
                        finger.command(0.5)
                        time.sleep(0.002)
                    began = time.monotonic()
                    if fault == "router killed":
                        graph.process.kill()
                    elif fault == "router stopped":
                        graph.pause()
                    else:
                        robot.quiet.set()
                    while finger.state().mode == "active":
                        finger.command(0.5)
                        time.sleep(0.001)
                    took.append(1e3 * (time.monotonic() - began))
                    graph.go_on()
                robot.close()
        result[fault] = {"n": repeats, "p50": np.median(took), "max": max(took)}
    return result


PARTS = {
    "publish": lambda seconds, quick: published(seconds),
    "streams": lambda seconds, quick: {
        "LSL, ms": over_lsl(seconds),
        "NatNet, ms": over_natnet(seconds),
        "ROS 2, ms": over_ros(seconds),
    },
    "finger": lambda seconds, quick: faults_of_a_ros_finger(1 if quick else 10),
}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="0.3 seconds each")
    parser.add_argument("--seconds", type=float, help="of each row")
    parser.add_argument("--only", choices=PARTS, help="one of the tables")
    parser.add_argument("--json", action="store_true", help="one JSON object instead")
    options = parser.parse_args()
    seconds = options.seconds or (0.3 if options.quick else 60.0)
    ikns.warm_up()
    told: dict[str, Any] = {
        "cores": os.cpu_count(),
        "load": round(os.getloadavg()[0], 1),
        "seconds": seconds,
    }
    tables = {
        name: part(seconds, options.quick)
        for name, part in PARTS.items()
        if options.only in (None, name)
    }
    if options.json:
        print(json.dumps(told | tables, indent=2))
        return
    print(f"cores {told['cores']}, load {told['load']}, {seconds:g} s each; simulated")
    for name, rows in tables.items():
        for row, values in rows.items():
            words = f"finger, {row}, ms" if name == "finger" else row
            cells = "  ".join(f"{key} {value:.3f}" for key, value in values.items())
            print(f"{words:<28} {cells}")


if __name__ == "__main__":
    main()
