"""What does publishing cost the finger, and what does NatNet take? Two tables.

1. A simulated body swings its arm at 100 Hz through the live loop to a simulated
   finger: without a publisher; with `--publish lsl:NAME`, without and with a listener
   in another process; and with a publisher that blocks for ever. In turns, a second at
   a time: from receipt to command (median of the percentiles of each second), and to
   the end of the iteration, when the sample is handed over (all frames).
2. The server of the tests, which speaks NatNet 4.1, sends 39 simulated markers from
   another process on this machine; from sending to receipt.
"""

import argparse
import json
import multiprocessing
import os
import sys
import threading
import time
from contextlib import ExitStack
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

import ikns
from ikns.live.publish import Publisher, open_publisher
from ikns.live.runtime import run
from ikns.live.stream import Source, open_source
from ikns.live.stream.lsl_library import lsl
from ikns.live.stream.replay import Replay, wait_until
from ikns.recording.recording import Recording

RATE, MARKERS = 100.0, 39
CONTEXT = multiprocessing.get_context("spawn")
KINDS = ("nothing", "LSL, no listener", "LSL, one listener", "blocked for ever")


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

    def sample(self, at: float, values: tuple[float, ...]) -> None:
        """Wait for ever."""
        threading.Event().wait()

    def event(self, at: float, words: str) -> None:
        """Wait for ever."""
        threading.Event().wait()

    def close(self) -> None:
        """Do nothing."""


def published(rounds: int) -> dict[str, dict[str, float]]:
    """Percentiles of the loop in ms, by kind of publisher."""
    subject, recording = swinging(round(RATE))
    own = f"ikns-benchmark-{os.getpid()}"
    times: dict[str, tuple[list[list[float]], list[float]]] = {
        kind: ([], []) for kind in KINDS
    }
    publishers: dict[str, Publisher | None] = {"nothing": None}
    ours, theirs = CONTEXT.Pipe()
    with ExitStack() as stack:
        for kind in KINDS[1:3]:
            name = f"{own}-{KINDS.index(kind)}"
            publishers[kind] = stack.enter_context(
                open_publisher(f"lsl:{name}", rate=RATE, simulated=True)
            )
        publishers[KINDS[3]] = stack.enter_context(Publisher("stuck", Stuck()))
        reader = CONTEXT.Process(target=listen, args=(f"{own}-2", theirs))
        reader.start()
        ours.recv()
        for _ in range(rounds):
            for kind in KINDS:
                one(subject, recording, publishers[kind], times[kind])
        ours.send(None)
        pulled = ours.recv()
        reader.join()
    result = {}
    for kind, (command, end) in times.items():
        each = publishers[kind]
        p50, p99 = 1e3 * np.median(command, axis=0)
        last50, last99 = 1e3 * np.percentile(end, [50, 99])
        result[kind] = {
            "command p50": p50,
            "p99": p99,
            "end p50": last50,
            "p99 ": last99,
            "sent": each.sent if each else 0,
            "dropped": each.dropped if each else 0,
        }
    result[KINDS[2]]["pulled"] = pulled
    return result


def one(
    subject: ikns.Subject,
    recording: Recording,
    publisher: Publisher | None,
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


def serve(frames: int, result: Connection) -> None:
    """Send simulated markers by NatNet; their time is that of sending."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from natnet_server import NatNetServer

    points = np.random.default_rng(0).normal(size=(MARKERS, 3))
    labels = [f"M{k}" for k in range(MARKERS)]
    with NatNetServer({"simulated": labels}) as server:
        result.send(server.port)
        server.streaming.wait(60)
        start = time.monotonic()
        for k in range(frames + 1):
            wait_until(start + k / RATE)
            server.send(k, time.monotonic(), points)
        result.recv()


def over_natnet(seconds: float) -> dict[str, float]:
    """Latency of NatNet frames in ms, and what was lost."""
    frames = round(seconds * RATE)
    ours, theirs = CONTEXT.Pipe()
    sender = CONTEXT.Process(target=serve, args=(frames, theirs))
    sender.start()
    late = []
    with open_source(f"natnet:127.0.0.1:{ours.recv()}?timeout=60") as source:
        number = -1
        while number < frames:
            frame = next(source)
            number = frame.number
            late.append(frame.receive_time - frame.device_time)
        lost = source.continuity.counts.dropped
        ours.send(None)
    sender.join()
    p50, p99, most = 1e3 * np.percentile(late, [50, 99, 100])
    return {
        "frames": len(late), "p50": p50, "p99": p99, "max": most, "dropped": lost,
    }  # fmt: skip


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a second each")
    parser.add_argument("--seconds", type=float, help="of each row")
    parser.add_argument("--json", action="store_true", help="one JSON object instead")
    options = parser.parse_args()
    seconds = options.seconds or (1.0 if options.quick else 60.0)
    ikns.warm_up()
    told: dict[str, Any] = {
        "cores": os.cpu_count(),
        "load": round(os.getloadavg()[0], 1),
        "seconds": seconds,
        "publish": published(max(1, round(seconds))),
        "natnet": over_natnet(seconds),
    }
    if options.json:
        print(json.dumps(told, indent=2))
        return
    print(f"cores {told['cores']}, load {told['load']}, {seconds:g} s each; simulated")
    for kind, row in told["publish"].items():
        cells = "  ".join(f"{name} {value:.3f}" for name, value in row.items())
        print(f"{kind:<18} {cells}")
    cells = "  ".join(f"{name} {value:.3f}" for name, value in told["natnet"].items())
    print(f"{'NatNet, ms':<18} {cells}")


if __name__ == "__main__":
    main()
