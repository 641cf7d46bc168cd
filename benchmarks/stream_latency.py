"""How long is a frame on its way? One table.

Simulated markers (39 of them, as many as a full body wears) go from one process to
another over LSL on this machine, as `ikns stream` sends them. Latency runs from
the call that sends a frame to the moment the reader holds its markers; both processes
read the same clock. Then a recording is replayed inside one process: jitter is how long
after its deadline a frame is handed over, and pass-through what handing over costs when
frames are read as fast as they come; a million more (not with --quick) show what memory
does.
"""

import argparse
import json
import multiprocessing
import os
import platform
import sys
import time
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from ikns.live.stream import LslOutlet, Source, open_source
from ikns.live.stream.replay import Replay, wait_until
from ikns.recording.recording import Recording

MARKERS = 39
NAME = f"ikns-benchmark-{os.getpid()}"
Row = dict[str, float]


def simulated(frames: int, rate: float, seed: int) -> Recording:
    """Noise where markers would be; what it shows does not matter here."""
    rng = np.random.default_rng(seed)
    markers = rng.normal(size=(frames, MARKERS, 3))
    labels = [f"M{i}" for i in range(MARKERS)]
    return Recording(np.arange(frames) / rate, markers, labels, "simulated")


def send(name: str, rate: float, frames: int, seed: int, result: Connection) -> None:
    """Send frames on absolute deadlines, and report when each was sent."""
    there = simulated(frames, rate, seed)
    sent = np.empty(frames)
    with LslOutlet(there.labels, rate, name=name) as outlet:
        if not outlet.wait_for_listener(60):
            sys.exit("nobody listened")
        start = time.monotonic() + 0.2
        for k in range(frames):
            sent[k] = wait_until(start + k / rate)
            outlet.push(there.markers[k], start + k / rate)
        result.send(sent)
        result.recv()  # the reader has all


def over_lsl(rate: float, frames: int, seed: int) -> tuple[Row, dict[str, int]]:
    """Latency of each frame, and what the reader counted."""
    name = f"{NAME}-{rate:g}"
    ours, theirs = multiprocessing.get_context("spawn").Pipe()
    sender = multiprocessing.get_context("spawn").Process(
        target=send, args=(name, rate, frames, seed, theirs)
    )
    sender.start()
    received = np.empty(frames)
    with open_source(f"lsl:{name}?scope=machine&timeout=60") as source:
        for k in range(frames):
            received[k] = next(source).receive_time
        counts = source.continuity.counts
    latency = received - ours.recv()
    ours.send(None)
    sender.join()
    lost = {"dropped": counts.dropped, "late": counts.late}
    return percentiles(latency), lost


def replayed(rate: float, frames: int, seed: int) -> tuple[Row, dict[str, int]]:
    """Lateness of each frame against its absolute deadline."""
    source = Source(Replay(simulated(frames, rate, seed)))
    received = np.array([frame.receive_time for frame in source])
    lateness = received - received[0] - np.arange(frames) / rate
    counts = source.continuity.counts
    return percentiles(lateness), {"dropped": counts.dropped, "late": counts.late}


def passed_through(frames: int, seed: int) -> tuple[Row, dict[str, int]]:
    """Cost of handing over a frame, with everything that is counted."""
    source = Source(Replay(simulated(1000, 100.0, seed), speed=0, loop=True))
    spent = np.empty(frames)
    for k in range(frames):
        start = time.perf_counter()
        source.read()
        spent[k] = time.perf_counter() - start
    return percentiles(spent), {"dropped": source.continuity.counts.dropped, "late": 0}


def growth(frames: int, seed: int) -> list[int]:
    """Memory after each tenth of the frames against the first, kB."""
    source = Source(Replay(simulated(1000, 100.0, seed), speed=0, loop=True))
    marks = []
    for _ in range(10):
        for _ in range(frames // 10):
            source.read()
        marks.append(resident())
    return [mark - marks[0] for mark in marks]


def resident() -> int:
    """Memory of this process, kB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1024


def percentiles(seconds: np.ndarray) -> Row:
    """Percentiles in ms."""
    values = 1e3 * np.percentile(seconds, [50, 95, 99, 99.9, 100])
    return dict(zip(["p50", "p95", "p99", "p99.9", "max"], values, strict=True))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a second each")
    parser.add_argument("--seconds", type=float, help="of each stream")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true", help="one JSON object instead")
    options = parser.parse_args()
    seconds = options.seconds or (1.0 if options.quick else 60.0)
    rows: dict[str, tuple[Row, dict[str, int]]] = {}
    for rate in (100.0, 1000.0):
        frames = round(seconds * rate)
        rows[f"LSL, push to pull, {rate:g} Hz"] = over_lsl(rate, frames, options.seed)
        rows[f"replay, after its deadline, {rate:g} Hz"] = replayed(
            rate, frames, options.seed
        )
    frames = round(seconds * 10_000)
    rows["replay, as fast as it is read"] = passed_through(frames, options.seed)
    million = 10_000 if options.quick else 1_000_000
    memory = growth(million, options.seed)
    machine = {
        "machine": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "load": round(os.getloadavg()[0], 1),
        "python": platform.python_version(),
        "seed": options.seed,
        "markers": MARKERS,
        "seconds": seconds,
    }
    if options.json:
        named = {key: {**row, **lost} for key, (row, lost) in rows.items()}
        told = {**machine, "milliseconds": named, "memory_kb": memory}
        print(json.dumps(told, indent=2))
        return
    print(", ".join(f"{key} {value}" for key, value in machine.items()) + "; simulated")
    print(f"{'ms':<36}" + "".join(f"{h:>9}" for h in next(iter(rows.values()))[0])
          + f"{'dropped':>9}{'late':>7}")  # fmt: skip
    for name, (row, lost) in rows.items():
        cells = "".join(f"{value:>9.3f}" for value in row.values())
        print(f"{name:<36}{cells}{lost['dropped']:>9}{lost['late']:>7}")
    marks = ", ".join(f"{kb:+d}" for kb in memory)
    print(f"{million} frames; memory against the first tenth, kB: {marks}")


if __name__ == "__main__":
    main()
