import numpy as np
import pytest
from dynamixel_sdk import Protocol1PacketHandler, Protocol2PacketHandler
from hypothesis import given
from hypothesis import strategies as st

from ikns.finger.emulator.packet import (
    Packet,
    Parser,
    checksum,
    crc16,
    encode,
    stuff,
    unstuff,
)

#: ROBOTIS e-Manual, "DYNAMIXEL Protocol 2.0", the examples of each instruction.
PUBLISHED_2 = [
    (Packet(1, 0x01), "FFFFFD000103000119 4E"),
    (Packet(254, 0x01), "FFFFFD00FE030001 3142"),
    (Packet(1, 0x55, b"\x06\x04\x26", 0), "FFFFFD000107005500060426 655D"),
    (Packet(2, 0x55, b"\x06\x04\x26", 0), "FFFFFD000207005500060426 6F6D"),
    (Packet(1, 0x02, b"\x84\0\4\0"), "FFFFFD000107000284000400 1D15"),
    (Packet(1, 0x55, b"\xa6\0\0\0", 0), "FFFFFD0001080055 00A6000000 8CC0"),
    (Packet(1, 0x03, b"\x74\0\0\2\0\0"), "FFFFFD00010900037400 00020000 CA89"),
    (Packet(1, 0x55, b"", 0), "FFFFFD000104005500 A10C"),
    (Packet(1, 0x04, b"\x68\0\xc8\0\0\0"), "FFFFFD00010900046800 C8000000 AE8E"),
    (Packet(1, 0x05), "FFFFFD0001030005 02CE"),
    (Packet(1, 0x06, b"\1"), "FFFFFD000104000601 A1E6"),
    (Packet(1, 0x08), "FFFFFD0001030008 2F4E"),
    (Packet(1, 0x10, b"\x01\x44\x58\x4c\x22"), "FFFFFD0001080010 0144584C22 B1DC"),
    (Packet(254, 0x82, b"\x84\0\4\0\1\2"), "FFFFFD00FE090082 840004000102 CEFA"),
    (
        Packet(254, 0x83, b"\x74\0\4\0\1\x96\0\0\0\2\xaa\0\0\0"),
        "FFFFFD00FE110083 74000400 0196000000 02AA000000 8287",
    ),
    (
        Packet(254, 0x92, b"\1\x90\0\2\0\2\x92\0\1\0"),
        "FFFFFD00FE0D0092 0190000200 0292000100 1A05",
    ),
    (Packet(2, 0x55, b"\x24", 0), "FFFFFD0002050055 0024 8BA9"),
    (
        Packet(254, 0x93, b"\1\x20\0\2\0\xa0\0\2\x1f\0\1\0\x50"),
        "FFFFFD00FE100093 0120000200A000 021F00010050 B768",
    ),
]
#: "DYNAMIXEL Protocol 1.0".
PUBLISHED_1 = [
    (Packet(1, 0x01), "FFFF010201FB"),
    (Packet(1, 0x02, b"\x2b\1"), "FFFF0104022B01CC"),
    (Packet(254, 0x03, b"\x03\1"), "FFFFFE04030301F6"),
    (Packet(1, 0x04, b"\x1e\xf4\1"), "FFFF0105041EF401E2"),
    (Packet(254, 0x05), "FFFFFE0205FA"),
    (Packet(0, 0x06), "FFFF000206F7"),
    (
        Packet(254, 0x83, bytes.fromhex("1E04 0010005001 0120026003")),
        "FFFFFE0E83 1E04 0010005001 0120026003 67",
    ),
    (
        Packet(254, 0x92, bytes.fromhex("00 02011E 020224")),
        "FFFFFE0992 00 02011E 020224 1D",
    ),
]
STATUS_1 = [
    (Packet(1, 0, b"", 0), "FFFF010200FC"),
    (Packet(1, 0, b"\x20", 0), "FFFF01030020DB"),
    (Packet(1, 0, b"", 0x24), "FFFF010224D8"),
    (Packet(1, 0, b"\0\x80", 0), "FFFF010400008 07A"),
    (Packet(0, 0, b"", 0), "FFFF000200FD"),
]
bodies = st.binary(min_size=1, max_size=60) | st.lists(
    st.sampled_from([0xFF, 0xFD, 0x00]), min_size=1, max_size=40
).map(bytes)


@pytest.mark.parametrize(("packet", "published"), PUBLISHED_2)
def test_protocol_2_has_the_bytes_of_the_manual(packet, published):
    data = bytes.fromhex(published.replace(" ", ""))
    assert encode(packet, 2) == data
    assert Parser(2).feed(data) == [packet]


@pytest.mark.parametrize(("packet", "published"), PUBLISHED_1 + STATUS_1)
def test_protocol_1_has_the_bytes_of_the_manual(packet, published):
    data = bytes.fromhex(published.replace(" ", ""))
    assert encode(packet, 1) == data
    assert Parser(1, status=packet.error is not None).feed(data) == [packet]


@given(st.binary(max_size=80))
def test_checksums_are_those_of_the_sdk(data):
    assert crc16(data) == Protocol2PacketHandler().updateCRC(0, data, len(data))
    port = type("Port", (), {"is_using": False, "clearPort": lambda self: None})()
    port.writePort = lambda packet: len(packet)
    packet = [0, 0, 1, len(data) + 2, 3, *data, 0]
    Protocol1PacketHandler().txPacket(port, packet)
    assert checksum(bytes(packet[2:-1])) == packet[-1]


@given(bodies)
def test_stuffing_is_that_of_the_sdk_and_leaves_no_header(body):
    length = len(body) + 2
    packet = [0xFF, 0xFF, 0xFD, 0, 1, length & 0xFF, length >> 8, *body, 0, 0]
    stuffed = Protocol2PacketHandler().addStuffing(packet)
    assert bytes(stuffed[7:-2]) == stuff(body)
    assert b"\xff\xff\xfd\x00" not in stuff(body)
    assert unstuff(stuff(body)) == body


@given(
    st.lists(
        st.tuples(st.integers(0, 252), st.sampled_from([1, 2, 3, 0x83]), bodies),
        min_size=1,
        max_size=4,
    ),
    st.sampled_from([1, 2]),
    st.randoms(use_true_random=False),
)
def test_packets_are_found_in_any_pieces(parts, protocol, random):
    packets = [Packet(number, kind, data) for number, kind, data in parts]
    stream = b"".join(encode(packet, protocol) for packet in packets)
    parser, found = Parser(protocol), []
    while stream:
        cut = random.randint(1, len(stream))
        found += parser.feed(stream[:cut])
        stream = stream[cut:]
    assert found == packets


@given(st.binary(max_size=30).filter(lambda noise: b"\xff" not in noise), bodies)
def test_noise_before_a_packet_is_passed_over(noise, body):
    packet = Packet(7, 3, body)
    for protocol in (1, 2):
        assert Parser(protocol).feed(noise + encode(packet, protocol)) == [packet]


def test_every_broken_bit_is_noticed():
    packet = Packet(1, 0x55, b"\xa6\0\0\0", 0)
    data = encode(packet, 2)
    for bit in range(8 * 7, 8 * len(data)):  # beyond the header, id and length
        broken = np.frombuffer(data, np.uint8).copy()
        broken[bit // 8] ^= 1 << bit % 8
        assert not any(p.intact for p in Parser(2).feed(broken.tobytes()))
