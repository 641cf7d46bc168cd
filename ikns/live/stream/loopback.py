"""Restrict sockets that listen on all networks to this machine.

liblsl always listens for data on all networks and has no setting for that, so a filter
of the Linux kernel (a classic BPF program, which needs no privileges) drops every
packet that is not from 127.0.0.0/8, including connection attempts.
"""

from __future__ import annotations

import ctypes
import os
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_SO_ATTACH_FILTER = 26
#: Offset of the IPv4 header, relative to the network layer (SKF_NET_OFF).
_NETWORK = 0xFFF00000
_ACCEPT, _DROP = 0xFFFFFFFF, 0
Line = tuple[int, int, int, int]  # code, jump if true, jump if false, operand
_FROM_THIS_MACHINE: tuple[Line, ...] = (
    (0x30, 0, 0, _NETWORK + 12),  # load the first byte of the source address
    (0x15, 0, 1, 127),  # is it 127?
    (0x06, 0, 0, _ACCEPT),
    (0x06, 0, 0, _DROP),
)
_FROM_NONE: tuple[Line, ...] = ((0x06, 0, 0, _DROP),)


@contextmanager
def only_from_this_machine() -> Iterator[list[int]]:
    """Restrict sockets that this process opens inside the block to this machine.

    IPv6 sockets receive nothing at all: IPv4 is enough within a machine.

    Yields
    ------
    list of int
        Filled at the end of the block: ports that remain open to other machines because
        the system has no such filter.
    """
    open_ports: list[int] = []
    before = _descriptors()
    yield open_ports
    if before is None:
        open_ports.append(0)
        return
    for number in (_descriptors() or set()) - before:
        try:
            ours = socket.socket(fileno=os.dup(number))
        except OSError:  # not a socket, or closed in the meantime
            continue
        with ours:
            if ours.family not in (socket.AF_INET, socket.AF_INET6):
                continue
            if ours.getsockname()[0] in ("0.0.0.0", "::"):
                version_4 = ours.family == socket.AF_INET
                try:
                    _filter(ours, _FROM_THIS_MACHINE if version_4 else _FROM_NONE)
                except OSError:
                    open_ports.append(ours.getsockname()[1])


def _filter(listening: socket.socket, lines: tuple[Line, ...]) -> None:
    program = ctypes.create_string_buffer(
        b"".join(struct.pack("HBBI", *line) for line in lines)  # struct sock_filter
    )
    # struct sock_fprog: number of lines and a pointer to them.
    option = struct.pack("HP", len(lines), ctypes.addressof(program))
    listening.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_FILTER, option)


def _descriptors() -> set[int] | None:
    folder = Path("/proc/self/fd")
    if not folder.is_dir():
        return None
    return {int(entry.name) for entry in folder.iterdir()}
