"""A bus on a pseudo-terminal: simulated servos that any serial program can talk to."""

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

__all__ = ["Wire"]

#: The servos move at least this often, seconds.
_TICK = 0.005
#: A plug is pulled without an answer in flight after so long, seconds.
_PULL = 0.1
#: A receiver tolerates so much difference in speed.
_BAUD_TOLERANCE = 0.03
_SPEEDS = {
    getattr(termios, name): int(name[1:])
    for name in dir(termios)
    if name[0] == "B" and name[1:].isdigit()
}


class Wire:
    """Simulated servos on one bus, open as a pseudo-terminal until closed.

    Parameters
    ----------
    *servos : Servo
    link : path, optional
        A symbolic link to the pseudo-terminal, so that its name stays the same.
    faults : sequence of Fault
        When they start is counted from now.

    Attributes
    ----------
    port : str
        What to open: the link, or the pseudo-terminal itself.

    Raises
    ------
    InvalidInput
        When the link's name is taken.

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
    ) -> None:
        self.servos = servos
        self._link = None if link is None else Path(link)
        if self._link is not None and self._link.exists():
            raise InvalidInput(f"{self._link}: exists already; choose another link.")
        self._began = time.monotonic()
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
        """What to open."""
        return self._path if self._link is None else str(self._link)

    @property
    def plugged(self) -> bool:
        """Whether there is a port at all."""
        return self._master >= 0

    @property
    def elapsed(self) -> float:
        """Seconds since it began."""
        return time.monotonic() - self._began

    def inject(self, kind: str, duration: float = math.inf, value: float = 0.0) -> None:
        """Let something go wrong now.

        Parameters
        ----------
        kind : str
            One of :data:`ikns.finger.emulator.FAULTS`.
        duration, value : float
            Seconds, and what the kind takes.
        """
        if kind not in FAULTS:
            raise InvalidInput(f"unknown fault '{kind}', expected {', '.join(FAULTS)}.")
        with self._lock:
            self._faults.append(Fault(kind, self.elapsed, duration, value))

    def mend(self) -> None:
        """End all faults; alerts last until a reboot."""
        with self._lock:
            self._faults.clear()
            self._replug_at = 0.0

    def close(self) -> None:
        """Take the port away."""
        self._stop.set()
        self._thread.join()
        self._unplug()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Take the port away."""
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
                self._happen()
                if self.plugged:
                    self._send()
                for servo in self.servos:
                    servo.advance()
                soonest = min((due for due, _ in self._due), default=math.inf)
                wait = min(max(soonest - time.monotonic(), 0.0), _TICK)
            if not self.plugged:
                time.sleep(wait)
            elif select.select([self._master], [], [], wait)[0]:
                # What was there may have been flushed by the other end since.
                with self._lock, contextlib.suppress(BlockingIOError):
                    self._receive(os.read(self._master, 4096))

    def _active(self, kind: str) -> Fault | None:
        now = self.elapsed
        active = [f for f in self._faults if f.kind == kind and f.active(now)]
        return active[-1] if active else None

    def _happen(self) -> None:
        """Let the faults begin that do not merely change bytes."""
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
            if self._due or self.elapsed > fault.start + _PULL:
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
                continue  # framing errors: it hears nothing
            for reply in servo.receive(data):
                late = 0.0 if delay is None else delay.value or 0.05
                self._due.append((reply.due + late, reply.data))

    def _send(self) -> None:
        now = time.monotonic()
        ready = sorted(item for item in self._due if item[0] <= now)
        self._due = [item for item in self._due if item[0] > now]
        for _, data in ready:
            if self._active("silence") is None and self._active("mute") is None:
                with contextlib.suppress(BlockingIOError):
                    os.write(self._master, self._spoiled(data))

    def _spoiled(self, data: bytes) -> bytes:
        """Bytes as the faults of the moment leave them."""
        if self._active("crc") is not None:
            data = data[:-1] + bytes([data[-1] ^ 0x5A])
        fault = self._active("id")
        if fault is not None:
            protocol = 2 if data[:3] == b"\xff\xff\xfd" else 1
            data = _with_id(data, protocol, int(fault.value) if fault.value > 0 else -1)
        return data


def _with_id(data: bytes, protocol: int, number: int) -> bytes:
    """Give a status another sender, with the checksum that fits."""
    from ikns.finger.emulator.packet import checksum, crc16

    at = 4 if protocol == 2 else 2
    number = number if number >= 0 else (data[at] + 1) % 253
    changed = data[:at] + bytes([number]) + data[at + 1 :]
    if protocol == 2:
        return changed[:-2] + crc16(changed[:-2]).to_bytes(2, "little")
    return changed[:-1] + bytes([checksum(changed[2:-1])])
