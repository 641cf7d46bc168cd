"""A stand-in for Qualisys Track Manager that speaks its real-time protocol in bytes.

As much of version 1.25 as the unmodified client needs: commands, parameters as XML, and
data packets with the labeled 3D component; little-endian.
"""

import socket
import struct
import threading
from collections.abc import Sequence
from contextlib import suppress
from types import TracebackType

import numpy as np
from numpy.typing import ArrayLike

ERROR, COMMAND, XML, DATA = 0, 1, 2, 3
LABELED_3D = 1


class QtmServer:
    """Serve on a free port of this machine until the block ends."""

    def __init__(
        self,
        labels: Sequence[str],
        rate: float = 100.0,
        *,
        mute: bool = False,
        port: int = 0,
    ) -> None:
        self.labels, self.rate, self.mute = list(labels), rate, mute
        self.streaming = threading.Event()
        self.asked: list[str] = []
        self._clients: list[socket.socket] = []
        self._listening = socket.create_server(("127.0.0.1", port))
        self.port = self._listening.getsockname()[1]
        self._thread = threading.Thread(target=self._accept)

    def send(
        self,
        number: int,
        microseconds: int,
        markers: ArrayLike,
        *,
        drop_rate: int = 0,
        out_of_sync_rate: int = 0,
    ) -> None:
        """Send one frame to everyone who asked; markers in meters."""
        positions = 1e3 * np.asarray(markers, dtype=np.float64)
        component = struct.pack("<Ihh", len(positions), drop_rate, out_of_sync_rate)
        component += positions.astype("<f4").tobytes()
        data = struct.pack("<qII", microseconds, number, 1)
        data += struct.pack("<II", 8 + len(component), LABELED_3D) + component
        for client in self._clients:
            client.sendall(_packet(DATA, data))

    def hang_up(self) -> None:
        """Break every connection, and keep listening."""
        self.streaming.clear()
        while self._clients:
            client = self._clients.pop()
            with suppress(OSError):  # the client has left already
                client.shutdown(socket.SHUT_RDWR)
            client.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listening.accept()
            except OSError:
                return
            self._clients.append(client)
            threading.Thread(target=self._answer, args=(client,)).start()

    def _answer(self, client: socket.socket) -> None:
        try:
            if not self.mute:
                client.sendall(_packet(COMMAND, b"QTM RT Interface connected\0"))
            while True:
                size, _ = struct.unpack("<II", _exactly(client, 8))
                command = _exactly(client, size - 8).rstrip(b"\0").decode()
                self.asked.append(command)
                if not self.mute:
                    client.sendall(self._reply(command))
                if command.startswith("streamframes allframes"):
                    self.streaming.set()
        except OSError:
            return

    def _reply(self, command: str) -> bytes:
        if command.startswith("version"):
            text = f"Version set to {command.split()[1]}"
            return _packet(COMMAND, text.encode() + b"\0")
        if command.startswith("getparameters"):
            labels = "".join(
                f"<Label><Name>{label}</Name><RGBColor>255</RGBColor></Label>"
                for label in self.labels
            )
            xml = (
                "<QTM_Parameters_Ver_1.25><General>"
                f"<Frequency>{self.rate:g}</Frequency></General><The_3D>"
                "<AxisUpwards>+Z</AxisUpwards>"
                f"<Labels>{len(self.labels)}</Labels>{labels}</The_3D>"
                "</QTM_Parameters_Ver_1.25>"
            )
            return _packet(XML, xml.encode() + b"\0")
        if command.startswith("streamframes"):
            return b""
        return _packet(ERROR, b"Parse error\0")

    def __enter__(self) -> "QtmServer":
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        # Shutting a listening socket down wakes accept(); closing alone does not.
        self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        self._thread.join()
        self.hang_up()


def _packet(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", 8 + len(data), kind) + data


def _exactly(client: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        more = client.recv(size - len(data))
        if not more:
            raise ConnectionResetError
        data += more
    return data
