"""Programs that drive a finger, started as a user starts them, brought to motion."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from visit_page import (
    Page,  # a participant's and an experimenter's page, without browser
)

__all__ = ["COMMANDS", "ForkServer", "Pages", "Program", "Shell", "argv_of"]

ROOT = Path(__file__).parents[2]
COMMANDS = ("run", "track", "pick")
_OPTIONS = {
    "run": ["--json"],
    "track": [
        *("--conditions", "ikns", "--profiles", "T1", "--repeats", "1", "--json"),
        *("--training", "0", "--seconds", "60", "--align", "0.5", "--rest", "0.1"),
        *("--no-browser", "--no-view"),
    ],
    "pick": [
        *("--conditions", "ikns", "--objects", "A", "--training", "0", "--json"),
        *("--limit", "60", "--rest", "0.1", "--no-browser", "--no-view"),
    ],
}


def argv_of(
    command: str, files: Path, folder: Path, servos: list[str], safe_state: str
) -> list[str]:
    """Words of a command that moves servos, PORT?id=1, until it is ended."""
    person = "person" if len(servos) == 1 else "two"
    fingers = [f"dynamixel:{servo}" for servo in servos]
    fingers[1:] = [f"{finger}&dof=2" for finger in fingers[1:]]
    return [
        command,
        *([str(folder / "visit")] if command != "run" else []),
        *_OPTIONS[command],
        *("--subject", str(files / person)),
        *("--source", f"replay:{files / 'free.c3d'}?loop=yes"),
        *(word for finger in fingers for word in ("--finger", finger)),
        *("--safe-state", safe_state),
    ]


def environment() -> dict[str, str]:
    """So that this checkout is measured, wherever the package is installed from."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    return os.environ | {"PYTHONPATH": path}


class Program:
    """A program in a session of its own, with its output in a folder.

    Parameters
    ----------
    folder : Path
        Gets ``out``, a pipe, and ``err``.
    start : callable
        Starts it: from the paths of both to its pid and a function that returns its
        exit code, or None while it runs.
    """

    def __init__(
        self,
        folder: Path,
        start: Callable[[Path, Path], tuple[int, Callable[[], int | None]]],
    ) -> None:
        out, self._err = folder / "out", folder / "err"
        self._err.touch()
        os.mkfifo(out)
        self._reader = os.open(out, os.O_RDONLY | os.O_NONBLOCK)
        self.pid, self._poll = start(out, self._err)
        self.code: int | None = None

    def poll(self) -> int | None:
        """Return its exit code, or None while it runs."""
        if self.code is None:
            self.code = self._poll()
        return self.code

    def send(self, number: int, *, group: bool) -> None:
        """Send a signal to it, or to its group as a terminal does."""
        with contextlib.suppress(ProcessLookupError):
            (os.killpg if group else os.kill)(self.pid, number)

    def close_stdout(self) -> None:
        """Stop reading what it prints."""
        if self._reader >= 0:
            os.close(self._reader)
            self._reader = -1

    def said(self) -> str:
        """Return what is on its standard error."""
        return self._err.read_text("utf-8", "replace")

    def left_over(self) -> list[int]:
        """Find the processes of its session that still run."""
        found = []
        for stat in Path("/proc").glob("[0-9]*/stat"):
            with contextlib.suppress(OSError):
                words = stat.read_text().rpartition(")")[2].split()
                if int(words[3]) == self.pid and words[0] != "Z":
                    found.append(int(stat.parent.name))
        return found

    def end(self) -> None:
        """Kill whatever is left of it."""
        self.close_stdout()
        for pid in self.left_over():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        while self.poll() is None:
            time.sleep(0.01)


class Shell:
    """Starts every program anew, by its console script."""

    def start(self, argv: list[str], folder: Path) -> Program:
        """Start one."""

        def begin(out: Path, err: Path) -> tuple[int, Callable[[], int | None]]:
            script = Path(sys.executable).with_name("ikns")
            with out.open("wb") as stdout, err.open("ab") as stderr:
                process = subprocess.Popen(
                    [sys.executable, str(script), *argv],
                    stdin=subprocess.DEVNULL,
                    stdout=stdout,
                    stderr=stderr,
                    start_new_session=True,
                    env=environment(),
                )
            return process.pid, process.poll

        return Program(folder, begin)

    def close(self) -> None:
        """Nothing is kept."""


class ForkServer:
    """Starts programs as forks of one that has loaded everything."""

    def __init__(self, files: Path) -> None:
        self._lock = threading.Lock()
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("fork_server.py"))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env=environment(),
        )
        source = f"replay:{files / 'free.c3d'}?speed=max"
        argv = ["run", "--subject", str(files / "person"), "--source", source]
        if self._ask(warm=[*argv, "--dry-run", "--json"]) != 0:
            raise RuntimeError("ikns run --dry-run failed.")

    def _ask(self, **asked: Any) -> Any:
        with self._lock:
            assert self._process.stdin is not None
            assert self._process.stdout is not None
            self._process.stdin.write(json.dumps(asked) + "\n")
            self._process.stdin.flush()
            return json.loads(self._process.stdout.readline())

    def start(self, argv: list[str], folder: Path) -> Program:
        """Start one."""

        def begin(out: Path, err: Path) -> tuple[int, Callable[[], int | None]]:
            pid = self._ask(start=argv, out=str(out), err=str(err))
            return pid, lambda: self._ask(poll=pid)

        return Program(folder, begin)

    def close(self) -> None:
        """End it; what it started is ended by whoever started that."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait(10)


class Pages:
    """The pages of a visit, in a thread: they begin a trial and then stay open."""

    def __init__(self, command: str, program: Program) -> None:
        self._command, self._program = command, program
        self.running, self._stop = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Leave; the program may be gone by now."""
        self._stop.set()
        self._thread.join(5)

    def _run(self) -> None:
        # The server vanishes when the program ends, which is what is measured.
        with contextlib.suppress(Exception):
            asyncio.run(self._visit())

    async def _visit(self) -> None:
        while not (found := re.search(r"https?://\S+", self._program.said())):
            if self._stop.is_set():
                return
            await asyncio.sleep(0.02)
        panel, page = Page("panel"), Page("participant")
        for one in (panel, page):
            await one.come(found[0])
        await panel.wait(
            lambda shown: shown["c"] is not None and shown["page_connected"]
        )
        await panel.submit("begin")
        if self._command == "pick":
            await panel.until("ready")
            await page.submit("toggle")
        await panel.until("running" if self._command == "pick" else "track")
        self.running.set()
        both = (one.wait(lambda _: self._stop.is_set()) for one in (panel, page))
        await asyncio.gather(*both, return_exceptions=True)
