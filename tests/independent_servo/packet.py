"""Bytes of both Dynamixel protocols, at the servo's end.

Source: ROBOTIS e-Manual, pages "DYNAMIXEL Protocol 2.0" and "Protocol 1.0".
"""

__all__ = ["crc16", "packet", "take_packet"]


def crc16(data: bytes) -> int:
    """CRC of Protocol 2.0, bit by bit: polynomial 0x8005, highest bit first, from 0."""
    crc = 0
    for bit in (byte >> shift & 1 for byte in data for shift in range(7, -1, -1)):
        crc = (crc << 1 & 0xFFFF) ^ (0x8005 if bit ^ crc >> 15 else 0)
    return crc


def packet(protocol: int, number: int, body: bytes) -> bytes:
    """Bytes of a packet; the body begins with the instruction, or 1.0's error."""
    if protocol == 1:
        inner = bytes([number, len(body) + 1]) + body
        return b"\xff\xff" + inner + bytes([255 - sum(inner) % 256])
    stuffed = body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
    size = (len(stuffed) + 2).to_bytes(2, "little")
    whole = b"\xff\xff\xfd\x00" + bytes([number]) + size + stuffed
    return whole + crc16(whole).to_bytes(2, "little")


def take_packet(protocol: int, seen: bytearray) -> tuple[int, bytes, bool] | None:
    """Take the first whole packet off the bytes: its id, its body, whether it holds."""
    header = b"\xff\xff\xfd\x00" if protocol == 2 else b"\xff\xff"
    start, size = len(header), protocol
    while True:
        at = seen.find(header)
        if at < 0:
            del seen[: -start + 1]
            return None
        del seen[:at]
        if len(seen) < start + 1 + size:
            return None
        length = int.from_bytes(seen[start + 1 : start + 1 + size], "little")
        if length < 1 + protocol or length > 300 or seen[start] == 255:
            del seen[0]  # no packet begins here
            continue
        end = start + 1 + size + length
        if len(seen) < end:
            return None
        whole = bytes(seen[:end])
        del seen[:end]
        body = whole[start + 1 + size : -protocol]
        if protocol == 1:
            return whole[2], body, sum(whole[2:]) % 256 == 255
        body = body.replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
        return whole[4], body, crc16(whole[:-2]) == int.from_bytes(whole[-2:], "little")
