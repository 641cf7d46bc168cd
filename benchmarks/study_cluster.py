"""What does a Dask cluster do for a study? One table. Everything is simulated.

A small study by one process, then by 1, 2 and 4 workers of a cluster on this computer;
and again while workers are killed (SIGKILL) at random instants, with one worker always
the last one: a new one is started in its place. Are all files the same, bit for bit?
Bytes are counted on the wire, by a relay between the run and the scheduler. More
workers than cores are not faster.
"""

import argparse
import json
import logging
import os
import platform
import random
import socket
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import dask
import tomli_w
from distributed import Client, LocalCluster

from ikns.experiments.study import run_study
from ikns.live.warm_up import warm_up

#: Quick people: coarse frames, one profile, one object.
STUDY: dict[str, Any] = {
    "study": {"name": "small"},
    "tracking": {"profiles": ["T1"], "repeats": 1, "seconds": 15},
    "picking": {"objects": ["A"]},
    "parameters": {"rate": 50, "point_seconds": 2},
}
#: Time between kills, at most, s.
LONGEST = 6.0


class Relay:
    """Passes connections on to an address, and counts the bytes both ways."""

    def __init__(self, address: str) -> None:
        host, port = address.removeprefix("tcp://").rsplit(":", 1)
        self._to = host, int(port)
        self.sent = self.received = 0
        self._door = socket.create_server(("127.0.0.1", 0))
        self.address = f"tcp://127.0.0.1:{self._door.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        """Take no more connections."""
        self._door.close()

    def _accept(self) -> None:
        with suppress(OSError):  # closed
            while True:
                inside, _ = self._door.accept()
                outside = socket.create_connection(self._to)
                for ends in ((inside, outside, "sent"), (outside, inside, "received")):
                    threading.Thread(target=self._pass, args=ends, daemon=True).start()

    def _pass(self, source: socket.socket, sink: socket.socket, count: str) -> None:
        with suppress(OSError):
            while content := source.recv(1 << 16):
                setattr(self, count, getattr(self, count) + len(content))
                sink.sendall(content)
            sink.shutdown(socket.SHUT_WR)


def load() -> None:
    """Load in a worker, before the clock runs, what a task needs."""
    warm_up()


def files(study: Path) -> dict[str, bytes]:
    """Every file of the visits by name."""
    visits = study / "visits"
    found = sorted(path for path in visits.rglob("*") if path.is_file())
    return {path.relative_to(visits).as_posix(): path.read_bytes() for path in found}


def of_process(pid: int) -> tuple[float, float]:
    """Largest resident memory so far, MB, and CPU time, s, of a process."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
        stat = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:  # killed
        return 0.0, 0.0
    peak = [line.split()[1] for line in status.splitlines() if line[:5] == "VmHWM"]
    ticks = int(stat[11]) + int(stat[12])
    return int(peak[0]) / 1024 if peak else 0.0, ticks / os.sysconf("SC_CLK_TCK")


@contextmanager
def killing(cluster: Any, kills: int, seed: int) -> Iterator[list[int]]:
    """Kill a worker now and then; yield those killed."""
    luck, over, killed = random.Random(seed), threading.Event(), list[int]()

    def kill() -> None:
        while len(killed) < kills and not over.wait(luck.uniform(0.2, LONGEST)):
            nanny = luck.choice(list(cluster.workers.values()))
            if nanny.pid:
                os.kill(nanny.pid, 9)
                killed.append(nanny.pid)

    thread = threading.Thread(target=kill)
    thread.start()
    try:
        yield killed
    finally:
        over.set()
        thread.join()


def by_cluster(study: Path, workers: int, kills: int, seed: int) -> dict[str, Any]:
    """Simulate a study with so many workers on this computer."""
    with (
        # Kills are not the fault of the task that a worker had.
        dask.config.set({"distributed.scheduler.allowed-failures": 1000}),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster) as client,
    ):
        client.run(load)
        relay = Relay(cluster.scheduler_address)
        before = sum(of_process(n.pid)[1] for n in cluster.workers.values())
        began = time.perf_counter()
        with killing(cluster, kills, seed) as killed:
            run_study(study, scheduler=relay.address)
        seconds = time.perf_counter() - began
        after = [of_process(nanny.pid) for nanny in cluster.workers.values()]
        relay.close()
    return {
        "how": f"{workers} worker{'s' * (workers > 1)}",
        "seconds": seconds,
        # That of killed workers is not known.
        "cpu": None if killed else sum(cpu for _, cpu in after) - before,
        "worker_MB": max(peak for peak, _ in after),
        "sent_kB": relay.sent / 1e3,
        "received_kB": relay.received / 1e3,
        "killed": len(killed),
    }


def rows(folder: Path, people: int, runs: list[tuple[int, int, int]]) -> Any:
    """One process, then runs of (workers, kills, seed)."""

    def declared(name: str) -> Path:
        (folder / name).mkdir()
        table = STUDY | {"cohort": {"participants": people}}
        (folder / name / "study.toml").write_text(tomli_w.dumps(table))
        return folder / name

    def one(study: Path) -> dict[str, Any]:
        began, cpu = time.perf_counter(), time.process_time()
        run_study(study, n_jobs=1)
        return {
            "how": "1 process",
            "seconds": time.perf_counter() - began,
            "cpu": time.process_time() - cpu,
            "worker_MB": of_process(os.getpid())[0],
            "sent_kB": 0.0,
            "received_kB": 0.0,
            "killed": 0,
        }

    reference = declared("reference")
    yield one(reference) | {"same_bits": True}
    whole = files(reference)
    for number, (workers, kills, seed) in enumerate(runs):
        study = declared(f"run-{number}")
        row = by_cluster(study, workers, kills, seed)
        yield row | {"same_bits": files(study) == whole}


def show(found: list[dict[str, Any]], people: int) -> None:
    """Print the table."""
    print(
        f"People: {people}, cores: {os.cpu_count()}\n\n"
        "| simulated by | killed | s | speed-up | CPU s | largest worker, MB "
        "| kB to workers | kB back | same bits |\n|---|---|---|---|---|---|---|---|---|"
    )
    for row in found:
        cpu = "-" if row["cpu"] is None else round(row["cpu"])
        print(
            f"| {row['how']} | {row['killed']} | {row['seconds']:.0f} "
            f"| {found[0]['seconds'] / row['seconds']:.2f} | {cpu} "
            f"| {row['worker_MB']:.0f} | {row['sent_kB']:.0f} "
            f"| {row['received_kB']:.0f} | {'yes' if row['same_bits'] else 'NO'} |"
        )


def main() -> None:
    """Print the table, or one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=8)
    parser.add_argument("--kills", type=int, default=3, help="of each killed run")
    parser.add_argument("--seeds", type=int, default=2, help="killed runs of each kind")
    parser.add_argument(
        "--quick", action="store_true", help="1 person, tracking, 1 kill"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    people = 1 if options.quick else options.people
    runs = [(n, 0, 0) for n in (1, 2, 4)]
    runs += [
        (n, options.kills, seed) for n in (1, 2, 4) for seed in range(options.seeds)
    ]
    if options.quick:
        runs = [(1, 1, 0)]
        del STUDY["picking"]
    warm_up()
    with tempfile.TemporaryDirectory() as place:
        found = list(rows(Path(place), people, runs))
    if options.json:
        about = {"machine": platform.machine(), "cores": os.cpu_count()}
        print(json.dumps({"about": about, "rows": found}))
    else:
        show(found, people)
    if not all(row["same_bits"] for row in found):
        raise SystemExit("expected the same bits from all.")


if __name__ == "__main__":
    main()
