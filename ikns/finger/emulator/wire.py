"""Simulated servos on a pseudo-terminal that any serial program can open."""

from __future__ import annotations

import contextlib
import math
import os
import select
import termios
import threading
import time
import tty
from pathlib import Path
from typing import Self

from ikns.errors import InvalidInput
from ikns.finger.emulator.device import Servo
from ikns.finger.emulator.faults import FAULTS, MOMENTARY, Fault
from ikns.finger.emulator.packet import checksum, crc16

#: Longest step of the servos' simulation, s.
_TICK = 0.005
#: The adapter is unplugged during a response, or after this time without one, s.
_UNPLUG_DELAY = 0.1
#: Relative difference of bit rates that a receiver tolerates.
_BAUD_TOLERANCE = 0.03
_SPEEDS = {
    getattr(termios, name): int(name[1:])
    for name in dir(termios)
    if name[0] == "B" and name[1:].isdigit()
}


class Wire:
    """Simulated servos on one bus, reachable through a pseudo-terminal until closed.

    Parameters
    ----------
    *servos : Servo
    link : path, optional
        A symbolic link to the pseudo-terminal, for a name that does not change.
    faults : sequence of Fault
        Their start times count from now.
    answer_delay : float
        Between an instruction and its response, s, beyond the servo's own return delay
        and the time of their bytes on the line.

    Attributes
    ----------
    port : str
        Port to open: the link, or the pseudo-terminal itself.

    Raises
    ------
    InvalidInput
        When the link exists already.

    Examples
    --------
    >>> with Wire(Servo("xl430")) as wire:
    ...     wire.port.startswith("/dev/")
    True
    """

    def __init__(
        self,
        *servos: Servo,
        link: str | Path | None = None,
        faults: tuple[Fault, ...] | list[Fault] = (),
        answer_delay: float = 0.0,
    ) -> None:
        if not 0 <= answer_delay < math.inf:
            raise InvalidInput(
                f"the answer delay must be a number of seconds, not {answer_delay:g}."
            )
        self.servos = servos
        self._link = None if link is None else Path(link)
        if self._link is not None and self._link.exists():
            raise InvalidInput(f"{self._link}: exists already; choose another link.")
        self._answer_delay = answer_delay
        self._start = time.monotonic()
        self._lock = threading.RLock()
        self._faults = list(faults)
        self._due: list[tuple[float, bytes]] = []
        self._master = self._slave = -1
        self._replug_at = math.inf
        self._plug()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name="servo")
        self._thread.start()

    @property
    def port(self) -> str:
        """Port to open."""
        return self._path if self._link is None else str(self._link)

    @property
    def plugged(self) -> bool:
        """Whether the port exists."""
        return self._master >= 0

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self._start

    def inject(self, kind: str, duration: float = math.inf, value: float = 0.0) -> None:
        """Start a fault now.

        Parameters
        ----------
        kind : str
            One of :data:`ikns.finger.emulator.FAULTS`.
        duration, value : float
            Seconds, and the value of the kind.
        """
        if kind not in FAULTS:
            raise InvalidInput(f"unknown fault '{kind}', expected {', '.join(FAULTS)}.")
        with self._lock:
            self._faults.append(Fault(kind, self.elapsed, duration, value))

    def clear_faults(self) -> None:
        """End all faults; alerts last until a reboot."""
        with self._lock:
            self._faults.clear()
            self._replug_at = 0.0

    def close(self) -> None:
        """Stop the servos and remove the port."""
        self._stop.set()
        self._thread.join()
        self._unplug()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()

    def _plug(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._path = os.ttyname(self._slave)
        self._replug_at = math.inf
        if self._link is not None:
            part = self._link.with_name(f".{self._link.name}.{os.getpid()}")
            part.symlink_to(self._path)
            part.replace(self._link)

    def _unplug(self) -> None:
        if not self.plugged:
            return
        if self._link is not None:
            self._link.unlink(missing_ok=True)
        os.close(self._slave)
        os.close(self._master)
        self._master = self._slave = -1
        self._due.clear()

    def _run(self) -> None:
        while not self._stop.is_set():
            with self._lock:
                self._start_faults()
                if self.plugged:
                    self._send()
                for servo in self.servos:
                    servo.advance()
                soonest = min((due for due, _ in self._due), default=math.inf)
                wait = min(max(soonest - time.monotonic(), 0.0), _TICK)
            if not self.plugged:
                time.sleep(wait)
            elif select.select([self._master], [], [], wait)[0]:
                # The other end may have flushed the bytes since.
                with self._lock, contextlib.suppress(BlockingIOError):
                    self._receive(os.read(self._master, 4096))

    def _active(self, kind: str) -> Fault | None:
        now = self.elapsed
        active = [f for f in self._faults if f.kind == kind and f.active(now)]
        return active[-1] if active else None

    def _start_faults(self) -> None:
        """Start the faults that do more than change bytes."""
        for kind in MOMENTARY:
            if (fault := self._active(kind)) is None:
                continue
            self._faults.remove(fault)
            for servo in self.servos:
                {
                    "alert": servo.shock,
                    "overheat": servo.overheat,
                    "power": servo.restart,
                }[kind]()
        begun = (f for f in self._faults if f.kind == "unplug")
        fault = next((f for f in begun if f.start <= self.elapsed), None)
        if fault is not None and self.plugged:
            if self._due or self.elapsed > fault.start + _UNPLUG_DELAY:
                if self._due and (data := min(self._due)[1]):
                    with contextlib.suppress(BlockingIOError):
                        os.write(self._master, data[: len(data) // 2])
                self._unplug()
                self._replug_at = self.elapsed + fault.duration
                self._faults.remove(fault)
        elif not self.plugged and self.elapsed > self._replug_at:
            self._plug()

    def _receive(self, data: bytes) -> None:
        if self._active("silence") is not None:
            return
        speed = _SPEEDS.get(termios.tcgetattr(self._master)[5], 0)
        delay = self._active("delay")
        for servo in self.servos:
            if abs(speed - servo.baud) > _BAUD_TOLERANCE * servo.baud:
                continue  # framing errors: it receives nothing
            for reply in servo.receive(data):
                late = self._answer_delay
                late += 0.0 if delay is None else delay.value or 0.05
                self._due.append((reply.due + late, reply.data))

    def _send(self) -> None:
        now = time.monotonic()
        ready = sorted(item for item in self._due if item[0] <= now)
        self._due = [item for item in self._due if item[0] > now]
        for _, data in ready:
            if self._active("silence") is None and self._active("mute") is None:
                with contextlib.suppress(BlockingIOError):
                    os.write(self._master, self._corrupt(data))

    def _corrupt(self, data: bytes) -> bytes:
        """Apply the active faults to the bytes of a response."""
        if self._active("crc") is not None:
            data = data[:-1] + bytes([data[-1] ^ 0x5A])
        fault = self._active("id")
        if fault is not None:
            protocol = 2 if data[:3] == b"\xff\xff\xfd" else 1
            data = _with_id(data, protocol, int(fault.value) if fault.value > 0 else -1)
        return data


def _with_id(data: bytes, protocol: int, number: int) -> bytes:
    """Replace the sender of a status packet, with a matching checksum."""
    at = 4 if protocol == 2 else 2
    number = number if number >= 0 else (data[at] + 1) % 253
    changed = data[:at] + bytes([number]) + data[at + 1 :]
    if protocol == 2:
        return changed[:-2] + crc16(changed[:-2]).to_bytes(2, "little")
    return changed[:-1] + bytes([checksum(changed[2:-1])])
