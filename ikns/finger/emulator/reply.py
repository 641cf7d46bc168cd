"""Status packets of a simulated servo, and when they are complete on the wire."""

from __future__ import annotations

from dataclasses import dataclass

from ikns.finger.emulator.baud import baud_rate
from ikns.finger.emulator.memory import Memory
from ikns.finger.emulator.packet import BROADCAST, STATUS, Packet, encode
from ikns.finger.models import Model

_PING, _READ, _SYNC_READ, _BULK_READ = 0x01, 0x02, 0x82, 0x92
#: Status errors of Protocol 1.0 for the error numbers of Protocol 2.0.
_ERRORS_1 = {1: 64, 2: 64, 3: 16, 4: 8, 5: 8, 6: 2, 7: 8}
#: Bits on the wire per byte, and units of the return delay time, s.
_BITS, _DELAY_UNIT = 10, 2e-6


@dataclass(frozen=True)
class Reply:
    """Bytes that a servo sends.

    Parameters
    ----------
    due : float
        When the last byte is on the wire, s on the servo's clock.
    data : bytes
    """

    due: float
    data: bytes


def expects_reply(packet: Packet, status_return_level: int) -> bool:
    """Whether the sender of an instruction gets a status packet."""
    if packet.instruction in (_PING, _SYNC_READ, _BULK_READ):
        return True
    if packet.id == BROADCAST:
        return False
    reads = packet.instruction == _READ
    return status_return_level == 2 or (status_return_level == 1 and reads)


def make_reply(
    model: Model,
    memory: Memory,
    packet: Packet,
    *,
    turn: int,
    error: int,
    content: bytes,
    now: float,
) -> Reply:
    """Make the status packet that answers an instruction.

    Parameters
    ----------
    model : Model
    memory : Memory
    packet : Packet
        The instruction.
    turn : int
        How many servos respond before this one.
    error : int
        Error number of Protocol 2.0.
    content : bytes
    now : float
        When the instruction was received, s.
    """
    if model.protocol == 1:
        error = _ERRORS_1.get(error, 0) | (memory.alert & 0x25)
    elif memory.alert:
        error |= 0x80
    data = encode(Packet(memory["id"], STATUS, content, error), model.protocol)
    # The instruction took time too.
    asked = len(packet.data) + 10
    baud = baud_rate(model, memory["baud_rate"])
    on_wire = (asked + (turn + 1) * len(data)) * _BITS / baud
    return Reply(now + memory["return_delay_time"] * _DELAY_UNIT + on_wire, data)
