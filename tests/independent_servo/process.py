"""The independent servo, or several, in a process of its own on a pseudo-terminal.

    python -m independent_servo.process --link PORT --log FILE --control SOCKET

It goes on while the program under test is stopped or killed. What happens to it goes
into a file as JSON lines with ``t``, s of CLOCK_MONOTONIC, which all processes share:
torque, watchdog, goals, writes to the EEPROM, alerts, and the speed of the terminal. A
socket answers requests, a JSON object per line: its registers, or a fault to begin. It
ends when its standard input is closed. Of several servos requests and events have the
``id``; a fault without one is all servos'.
"""

import argparse
import contextlib
import json
import os
import select
import socket
import subprocess
import sys
import termios
import time
import tty
from functools import partial
from pathlib import Path
from typing import Any, Self, TextIO

from independent_servo.servo import Servo
from independent_servo.tables import MODELS

__all__ = ["ServoProcess"]

#: The servo moves at least this often, and the terminal's speed is looked at, s.
TICK = 0.004
#: A receiver tolerates this difference in speed (e-Manual, "Baud Rate").
TOLERANCE = 0.03
#: A slow answer arrives in pieces of so many bytes.
PIECE = 8
FAULTS = ("mute", "silence", "crc")
SPEEDS = {
    getattr(termios, name): int(name[1:])
    for name in dir(termios)
    if name[0] == "B" and name[1:].isdigit()
}


class Bus:
    """A pseudo-terminal with servos behind it."""

    def __init__(self, options: argparse.Namespace, log: TextIO) -> None:
        self._log, self._options = log, options
        several = len(options.id) > 1
        self.servos = {
            number: Servo(
                options.model,
                id=number,
                baud=options.baud,
                clears_profile=options.clears_profile,
                log=partial(self.note, id=number) if several else self.note,
            )
            for number in options.id
        }
        self.baud = self.servos[options.id[0]].baud
        self.link = Path(options.link)
        self.faults: dict[str, set[int]] = {name: set() for name in FAULTS}
        self._arriving: list[tuple[float, bytes]] = []
        self._leaving: list[tuple[float, bytes]] = []
        self._free = [0.0, 0.0]  # when the line is free again: to and from the servo
        self.master = self._slave = -1
        self.plug()

    def note(self, **event: Any) -> None:
        self._log.write(json.dumps({"t": time.monotonic(), **event}) + "\n")
        self._log.flush()

    def plug(self) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self.master, False)
        part = self.link.with_name(f".{self.link.name}.part")
        part.symlink_to(os.ttyname(self._slave))
        part.replace(self.link)
        self._speed = self._terminal()

    def unplug(self) -> None:
        if self.master >= 0:
            self.link.unlink(missing_ok=True)
            os.close(self._slave)
            os.close(self.master)
            self.master = self._slave = -1
            self._arriving.clear()
            self._leaving.clear()

    def _terminal(self) -> int:
        return SPEEDS.get(termios.tcgetattr(self.master)[5], 0)

    def _after(self, way: int, now: float, count: int) -> float:
        """When so many bytes have passed that are given to the line now."""
        if not self._options.byte_time:
            return now
        self._free[way] = max(self._free[way], now) + 10 * count / self.baud
        return self._free[way]

    def read(self) -> None:
        with contextlib.suppress(BlockingIOError):  # flushed by the other end since
            data = os.read(self.master, 4096)
            self._arriving.append((self._after(0, time.monotonic(), len(data)), data))

    def turn(self) -> float:
        """Do what is due; return how long nothing else is, s."""
        for servo in self.servos.values():
            servo.pass_time()
        if self.master >= 0 and (speed := self._terminal()) != self._speed:
            self._speed = speed
            self.note(event="terminal", baud=speed)
        while self._arriving and self._arriving[0][0] <= time.monotonic():
            due, data = self._arriving.pop(0)
            if abs(self._speed / self.baud - 1) > TOLERANCE:
                continue
            for number, servo in self.servos.items():
                if number in self.faults["silence"]:
                    continue
                for delay, answer in servo.hear(data):
                    if number not in self.faults["mute"]:
                        wrong = number in self.faults["crc"]
                        late = self._options.answer_delay
                        self._answer(due + delay + late, answer, wrong=wrong)
        while self._leaving and self._leaving[0][0] <= time.monotonic():
            with contextlib.suppress(BlockingIOError):
                os.write(self.master, self._leaving.pop(0)[1])
        soonest = [queue[0][0] for queue in (self._arriving, self._leaving) if queue]
        return min([TICK, *(max(due - time.monotonic(), 0.0) for due in soonest)])

    def _answer(self, due: float, answer: bytes, *, wrong: bool) -> None:
        if wrong:
            answer = answer[:-1] + bytes([answer[-1] ^ 0xFF])
        size = PIECE if self._options.byte_time else len(answer)
        for at in range(0, len(answer), size):
            piece = answer[at : at + size]
            self._leaving.append((self._after(1, due, len(piece)), piece))

    def request(self, line: str) -> dict[str, Any]:
        """Do what a test asks for."""
        asked = json.loads(line)
        what, number = asked.get("do", "look"), asked.get("id")
        servo = next(iter(self.servos.values())) if number is None else None
        servo = servo or self.servos[number]
        if what in FAULTS:
            whose = set(self.servos) if number is None else {number}
            self.faults[what] -= whose
            self.faults[what] |= whose if asked["on"] else set()
            self.note(event=what, on=asked["on"])
        elif what == "power":
            servo.start()
        elif what == "alert":
            servo.raise_alert(asked["name"])
        elif what == "unplug":
            self.unplug()
        elif what == "replug":
            self.plug()
        return {
            "t": time.monotonic(),
            "registers": servo.values,
            "position": servo.motor.position,
            "velocity": servo.motor.velocity,
        }


def serve(options: argparse.Namespace) -> None:
    """Be a servo until standard input is closed."""
    with contextlib.suppress(PermissionError):  # a servo waits for no other program
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(options.control)
    listener.listen()
    callers: list[socket.socket] = []
    with Path(options.log).open("a", encoding="utf-8") as log:
        bus = Bus(options, log)
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        while True:
            wait = bus.turn()
            ears = [listener, sys.stdin, *callers]
            wire = [bus.master] if bus.master >= 0 else []
            ready = select.select([*ears, *wire], [], [], wait)[0]
            if wire and wire[0] in ready:
                bus.read()
            for ear in ready:
                if ear is sys.stdin:
                    bus.unplug()
                    return
                if ear is listener:
                    callers.append(listener.accept()[0])
                elif ear in callers:
                    line = ear.recv(4096).decode()
                    if line:
                        ear.sendall(json.dumps(bus.request(line)).encode() + b"\n")
                    else:
                        callers.remove(ear)
                        ear.close()


class ServoProcess:
    """Starts servos, asks them, and ends them; `port` is what a program opens."""

    def __init__(
        self,
        folder: Path,
        *,
        model: str = "xl430",
        id: int | tuple[int, ...] = 1,
        baud: int = 57600,
        answer_delay: float = 0.0,
        byte_time: bool = False,
        clears_profile: bool = False,
    ) -> None:
        self.model = MODELS[model]
        self.port, self._log = folder / "servo", folder / "servo.jsonl"
        control = folder / "servo.socket"
        options = {
            "--model": model,
            "--baud": baud,
            "--answer-delay": answer_delay,
            "--link": self.port,
            "--log": self._log,
            "--control": control,
        }
        words = [str(word) for pair in options.items() for word in pair]
        # Without site-packages: whatever it needs of others it would not find.
        argv = [sys.executable, "-S", "-E", "-m", "independent_servo.process", *words]
        argv += ["--id", *map(str, id if isinstance(id, tuple) else (id,))]
        argv += ["--byte-time"] * byte_time + ["--clears-profile"] * clears_profile
        self._process = subprocess.Popen(
            argv,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=Path(__file__).parents[1],
            start_new_session=True,  # a Ctrl-C at the terminal is not for the servo
        )
        assert self._process.stdout is not None
        if self._process.stdout.readline() != b"ready\n":
            self.close()
            raise RuntimeError("the servo did not start.")
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.connect(str(control))
        self._lines = self._socket.makefile("r")

    def request(self, **asked: Any) -> dict[str, Any]:
        """Ask for something: ``do="mute", on=True``, ``do="alert", name="shock"``."""
        self._socket.sendall(json.dumps(asked).encode() + b"\n")
        answer: dict[str, Any] = json.loads(self._lines.readline())
        return answer

    def __getitem__(self, name: str) -> int:
        """Value of a register now."""
        return int(self.request()["registers"][name])

    def events(self, kind: str = "") -> list[dict[str, Any]]:
        """What has happened to it, of one kind or all."""
        lines = self._log.read_text("utf-8").split("\n")[:-1]
        found = [json.loads(line) for line in lines]
        return [e for e in found if kind in ("", e["event"])]

    def servo(self, number: int) -> "OneServo":
        """One of several servos."""
        return OneServo(self, number)

    def close(self) -> None:
        """End it."""
        if hasattr(self, "_socket"):
            self._lines.close()
            self._socket.close()
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait(10)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


class OneServo:
    """One of the servos of a process: its registers and events."""

    def __init__(self, process: ServoProcess, number: int) -> None:
        self.port, self._process, self._number = process.port, process, number

    def request(self, **asked: Any) -> dict[str, Any]:
        return self._process.request(**asked, id=self._number)

    def __getitem__(self, name: str) -> int:
        return int(self.request()["registers"][name])

    def events(self, kind: str = "") -> list[dict[str, Any]]:
        """What has happened to it, of one kind or all."""
        found = self._process.events(kind)
        return [e for e in found if e.get("id", self._number) == self._number]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", choices=list(MODELS), default="xl430")
    parser.add_argument("--id", type=int, nargs="+", default=[1])
    parser.add_argument("--baud", type=int, default=57600)
    parser.add_argument("--answer-delay", type=float, default=0.0, metavar="SECONDS")
    parser.add_argument("--byte-time", action="store_true")
    parser.add_argument("--clears-profile", action="store_true")
    for name in ("--link", "--log", "--control"):
        parser.add_argument(name, required=True, metavar="PATH")
    serve(parser.parse_args())


if __name__ == "__main__":
    main()
