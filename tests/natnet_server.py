"""A stand-in for OptiTrack Motive that speaks NatNet in bytes, for tests and the desk.

Written from the layouts in OptiTrack's description of the protocol (NatNet 3.1, 4.0 and
4.1; little-endian), without any client's code: server info, models with marker sets,
rigid bodies and skeletons, the reply to FrameRate, and frames with marker sets,
unlabeled markers, rigid bodies and labeled markers. At the desk::

    python tests/natnet_server.py free.c3d
"""

import socket
import struct
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from types import TracebackType

import numpy as np
from numpy.typing import ArrayLike

SERVER_INFO, RESPONSE, MODELS, FRAME = 1, 3, 5, 7
OCCLUDED, POINT_CLOUD, FILLED = 1, 2, 4
TICKS = 10_000_000


class NatNetServer:
    """Serve on a free port of this machine until the block ends.

    `sets` has the marker names of each marker set; rigid bodies have three markers
    each, and marker sets of their own, as in Motive.
    """

    def __init__(
        self,
        sets: dict[str, Sequence[str]],
        rate: float = 100.0,
        *,
        version: tuple[int, int] = (4, 1),
        bodies: Sequence[str] = (),
        mute: bool = False,
        group: str = "",
        data_port: int = 1511,
        host: str = "127.0.0.1",
        listen: str | None = None,
        port: int = 0,
    ) -> None:
        self.sets = {name: list(markers) for name, markers in sets.items()}
        self.rate, self.version, self.bodies = rate, version, list(bodies)
        self.mute, self.group, self.data_port = mute, group, data_port
        self.streaming = threading.Event()
        self.asked: list[tuple[int, str]] = []
        self._client: tuple[str, int] | None = None
        self._listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._listening.bind((host if listen is None else listen, port))
        self._listening.settimeout(0.05)
        self.port = self._listening.getsockname()[1]
        # A server that listens at a broadcast address answers from its own.
        self._out = self._listening
        if listen is not None:
            self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._out.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._out.bind((host, self.port))
        if group:
            self._out.setsockopt(
                socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(host)
            )
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._answer)

    def send(
        self,
        number: int,
        seconds: float,
        markers: ArrayLike,
        *,
        flags: Sequence[int] = (),
        latency: float = 0.004,
        changed: bool = False,
    ) -> None:
        """Send one frame; markers in meters, of all sets one after the other."""
        points = np.asarray(markers, dtype="<f4").reshape(-1, 3)
        content = self.frame(number, seconds, points, flags, latency, changed=changed)
        target = (self.group, self.data_port) if self.group else self._client
        assert target is not None
        self._out.sendto(_packet(FRAME, content), target)

    def frame(
        self,
        number: int,
        seconds: float,
        points: np.ndarray,
        flags: Sequence[int],
        latency: float,
        *,
        changed: bool,
    ) -> bytes:
        sets, first = [], 0
        for name, names in self.sets.items():
            own = points[first : first + len(names)]
            first += len(names)
            sets.append(_text(name) + struct.pack("<I", len(own)) + own.tobytes())
        corner = np.ones((3, 3), dtype="<f4")
        sets += [
            _text(name) + struct.pack("<I", 3) + corner.tobytes()
            for name in self.bodies
        ]
        sets.append(_text("all") + struct.pack("<I", len(points)) + points.tobytes())
        bodies = [
            struct.pack("<I7ffH", 500 + k, 1, 1, 1, 0, 0, 0, 1, 1e-4, 1)
            for k in range(len(self.bodies))
        ]
        flags = flags or [POINT_CLOUD] * len(points)
        labeled = [
            struct.pack("<I3ffHf", k + 1, *point, 0.014, flag, 1e-4)
            for k, (point, flag) in enumerate(zip(points, flags, strict=True))
        ]
        loose = [np.array([9, 9, 9], dtype="<f4").tobytes()]
        parts = [sets, loose, bodies, [], *([[]] if self.version >= (4, 1) else [])]
        parts += [labeled, [], []]
        exposed = 123 * TICKS
        end = struct.pack("<IId", 0, 0, seconds)
        end += struct.pack("<QQQ", exposed, exposed, exposed + round(latency * TICKS))
        end += struct.pack("<H", 2 * changed)
        counted = b"".join(self._counted(part) for part in parts)
        return struct.pack("<I", number) + counted + end + struct.pack("<I", 0)

    def _counted(self, part: Sequence[bytes]) -> bytes:
        data = b"".join(part)
        size = struct.pack("<I", len(data)) if self.version >= (4, 1) else b""
        return struct.pack("<I", len(part)) + size + data

    def _models(self) -> bytes:
        sets = [*self.sets.items(), *((b, ["1", "2", "3"]) for b in self.bodies)]
        every = [name for names in self.sets.values() for name in names]
        found = []
        for name, names in [*sets, ("all", every)]:
            listed = b"".join(map(_text, names))
            found.append((0, _text(name) + struct.pack("<I", len(names)) + listed))
        for k, name in enumerate(self.bodies):
            body = _text(name) + struct.pack("<Ii3f", 500 + k, -1, 0, 0, 0)
            body += struct.pack("<I", 3) + struct.pack("<9f", *range(9))
            body += struct.pack("<3I", 1, 2, 3)
            if self.version >= (4, 0):
                body += _text("1") + _text("2") + _text("3")
            found.append((1, body))
        content = struct.pack("<I", len(found))
        for kind, data in found:
            size = struct.pack("<I", len(data)) if self.version >= (4, 1) else b""
            content += struct.pack("<I", kind) + size + data
        return content

    def _info(self) -> bytes:
        shared = [int(n) for n in (self.group or "0.0.0.0").split(".")]
        return (
            b"Motive".ljust(256, b"\0")
            + bytes([3, 1, 0, 0, *self.version, 0, 0])
            + struct.pack("<QHB4B", TICKS, self.data_port, bool(self.group), *shared)
        )

    def _answer(self) -> None:
        while not self._done.is_set():
            try:
                packet, sender = self._listening.recvfrom(65535)
            except TimeoutError:
                continue
            number, size = struct.unpack_from("<HH", packet)
            text = packet[4 : 4 + size].rstrip(b"\0").decode()
            self.asked.append((number, text))
            if self.mute:
                continue
            self._client = sender
            answer = {
                0: (SERVER_INFO, self._info()),
                2: (RESPONSE, struct.pack("<f", self.rate)),
                4: (MODELS, self._models()),
            }.get(number)
            if answer:
                with suppress(OSError):
                    self._out.sendto(_packet(*answer), sender)
            if number == 2:
                self.streaming.set()

    def __enter__(self) -> "NatNetServer":
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._done.set()
        self._thread.join()
        self._listening.close()
        self._out.close()


def _text(text: str) -> bytes:
    return text.encode() + b"\0"


def _packet(number: int, content: bytes) -> bytes:
    return struct.pack("<HH", number, len(content)) + content


def play(path: str) -> None:
    """Serve a recording over and over at the usual port, until Ctrl-C."""
    from ikns.recording.files import read

    recording = read(path)
    rate, number = recording.rate, 0
    points = np.nan_to_num(recording.markers)
    with NatNetServer({"Markers": recording.labels}, rate, port=1510) as server:
        server.streaming.wait()
        start = time.monotonic()
        while True:
            server.send(number, number / rate, points[number % len(points)])
            number += 1
            time.sleep(max(0.0, start + number / rate - time.monotonic()))


if __name__ == "__main__":
    with suppress(KeyboardInterrupt):
        play(sys.argv[1])
