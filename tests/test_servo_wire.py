"""ROBOTIS's own SDK, unmodified, talks to the simulated servo over a real terminal."""

import json
import os
import signal
import subprocess
import sys
import time

import dynamixel_sdk as sdk
import pytest
from command_line import check_refused

from ikns.errors import InvalidInput
from ikns.finger.emulator import FAULTS, Servo, Wire, parse_fault
from ikns.finger.models import MODELS

GOAL, PRESENT = (116, 4), (132, 4)


class Client:
    def __init__(self, port, protocol=2.0, baud=1_000_000):
        self.port, self.packets = sdk.PortHandler(port), sdk.PacketHandler(protocol)
        assert self.port.openPort()
        assert self.port.setBaudRate(baud)

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.port.closePort()

    def ping(self, number=1):
        return self.packets.ping(self.port, number)


def until_answered(ask):
    """Ask again on a busy machine: the SDK waits no longer than 34 ms."""
    for _ in range(20):
        answer = ask()
        if not {sdk.COMM_RX_TIMEOUT, sdk.COMM_RX_CORRUPT} & set(answer):
            return answer
        time.sleep(0.05)
    return answer


@pytest.fixture
def wire():
    servos = [Servo("xl430", id=number, baud=1_000_000) for number in (1, 2)]
    with Wire(*servos) as wire:
        yield wire


@pytest.fixture
def client(wire):
    with Client(wire.port) as client:
        yield client


@pytest.mark.parametrize("model", MODELS.values(), ids=lambda model: model.name)
def test_the_sdk_moves_every_model(model):
    with (
        Wire(Servo(model.name, baud=1_000_000)) as wire,
        Client(wire.port, float(model.protocol)) as client,
    ):
        number, result, error = until_answered(client.ping)
        assert (number, result, error) == (model.numbers[0], sdk.COMM_SUCCESS, 0)
        for name, value in {"torque_enable": 1, "goal_position": 700}.items():
            r = model[name]
            data = list(r.to_bytes(value))
            write = client.packets.writeTxRx
            place = (client.port, 1, r.address, r.size, data)
            answer = until_answered(lambda write=write, place=place: write(*place))
            assert answer == (sdk.COMM_SUCCESS, 0)
        end = time.monotonic() + 10
        place = model["present_position"]
        read = client.packets.readTxRx
        while time.monotonic() < end:
            data, *outcome = read(client.port, 1, place.address, place.size)
            # The SDK waits 34 ms, and a busy machine may need longer. Units are cut.
            answered = outcome == [sdk.COMM_SUCCESS, 0]
            if answered and abs(place.from_bytes(bytes(data)) - 700) <= 1:
                break
        else:
            pytest.fail("it did not get there")


def test_groups_read_and_write_several_servos(client, wire):
    write = sdk.GroupSyncWrite(client.port, client.packets, *GOAL)
    read = sdk.GroupSyncRead(client.port, client.packets, *GOAL)
    for number in (1, 2):
        assert write.addParam(number, [number, 4, 0, 0])
        assert read.addParam(number)
    assert write.txPacket() == sdk.COMM_SUCCESS
    assert until_answered(lambda: [read.txRxPacket()]) == [sdk.COMM_SUCCESS]
    assert [read.getData(number, *GOAL) for number in (1, 2)] == [1025, 1026]

    bulk = sdk.GroupBulkWrite(client.port, client.packets)
    assert bulk.addParam(1, *GOAL, [7, 0, 0, 0])
    assert bulk.addParam(2, 65, 1, [1])
    assert bulk.txPacket() == sdk.COMM_SUCCESS
    bulk = sdk.GroupBulkRead(client.port, client.packets)
    assert bulk.addParam(1, *GOAL)
    assert bulk.addParam(2, 65, 1)
    assert until_answered(lambda: [bulk.txRxPacket()]) == [sdk.COMM_SUCCESS]
    assert (bulk.getData(1, *GOAL), bulk.getData(2, 65, 1)) == (7, 1)


def test_the_sdk_finds_who_is_there(client):
    for _ in range(20):  # a busy machine answers too late
        found, result = client.packets.broadcastPing(client.port)
        if result == sdk.COMM_SUCCESS and len(found) == 2:
            break
    assert result == sdk.COMM_SUCCESS
    assert {number: about[0] for number, about in found.items()} == {1: 1060, 2: 1060}


def test_registered_writes_reboot_and_refusals(client, wire):
    packets, port = client.packets, client.port
    until_answered(lambda: packets.regWriteTxRx(port, 1, 65, 1, [1]))
    assert packets.action(port, 1) == sdk.COMM_SUCCESS
    time.sleep(0.05)  # the SDK does not read the answer to this one
    answer = until_answered(lambda: packets.read1ByteTxRx(port, 1, 65))
    assert answer == (1, sdk.COMM_SUCCESS, 0)
    for ask, error in (
        (lambda: packets.factoryReset(port, 1, 0xFF), 2),
        (lambda: packets.write4ByteTxRx(port, 1, *GOAL[:1], 4096), 6),
        (lambda: packets.reboot(port, 1), 0),
    ):
        assert until_answered(ask) == (sdk.COMM_SUCCESS, error)
    assert client.ping()[1] != sdk.COMM_SUCCESS  # it is starting


def test_a_wrong_rate_hears_nothing(wire):
    with Client(wire.port, baud=57600) as client:
        assert client.ping()[1] == sdk.COMM_RX_TIMEOUT


@pytest.mark.parametrize(
    ("fault", "result"),
    [
        ("silence", sdk.COMM_RX_TIMEOUT),
        ("mute", sdk.COMM_RX_TIMEOUT),
        ("crc", sdk.COMM_RX_CORRUPT),
        ("id", sdk.COMM_RX_TIMEOUT),
    ],
)
def test_the_sdk_sees_the_faults(client, wire, fault, result):
    wire.inject(fault, value=9)
    # An answer that is damaged may come too late, too.
    assert result in (client.ping()[1] for _ in range(20))
    wire.clear_faults()
    assert until_answered(client.ping)[1] == sdk.COMM_SUCCESS


def test_alerts_reach_the_sdk(client, wire):
    wire.inject("alert")
    end = time.monotonic() + 10
    while not client.ping()[2] & 0x80:
        assert time.monotonic() < end
    read = client.packets.read1ByteTxRx
    assert until_answered(lambda: read(client.port, 1, 70))[0] == 1 << 4


def test_a_link_follows_the_port_and_is_never_taken_from_others(tmp_path):
    link = tmp_path / "bus"
    with Wire(Servo(), link=link) as wire:
        first = link.readlink()
        with pytest.raises(InvalidInput, match=r"exists already"):
            Wire(Servo(), link=link)
        wire.inject("unplug", duration=0.05)
        end = time.monotonic() + 10
        while wire.plugged:
            assert time.monotonic() < end
        assert not link.is_symlink()
        while not link.is_symlink():
            assert time.monotonic() < end
        assert first.parent == link.readlink().parent
    assert not link.is_symlink()


@pytest.mark.parametrize(
    "text", ["", "silence", "fire@3", "delay=@3", "silence@-1", "silence@1+", "crc=3@1"]
)
def test_faults_that_cannot_be_read_are_refused(text):
    with pytest.raises(InvalidInput, match=r"fault '"):
        parse_fault(text)


def test_every_fault_can_be_written_down():
    for kind in FAULTS:
        assert parse_fault(f"{kind}@2").kind == kind


@pytest.mark.parametrize(
    "argv",
    [
        ["--model", "hs53"],
        ["--id", "300"],
        ["--id", "1", "--id", "1"],
        ["--baud", "12345"],
        ["--fault", "fire@3"],
        ["--duration", "-1"],
    ],
)
def test_the_command_refuses_in_a_sentence(argv, tmp_path, capfd):
    check_refused(["servo", *argv], tmp_path, capfd)


def test_the_command_overwrites_nothing(tmp_path, capfd):
    link = tmp_path / "bus"
    link.write_text("mine")
    check_refused(["servo", "--link", str(link)], tmp_path, capfd, names=link)


def test_the_command_serves_until_it_is_reported_to_stop(tmp_path):
    link = tmp_path / "bus"
    process = subprocess.Popen(
        [sys.executable, "-c", "from ikns.cli import main; raise SystemExit(main())"]
        + ["servo", "--link", str(link), "--baud", "1000000", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
    )
    lines = iter(process.stdout.readline, b"}\n")
    about = json.loads(b"".join(lines) + b"}")
    assert about == {
        "port": str(link),
        "model": "xl430",
        "id": 1,
        "baud": 1000000,
        "simulated": True,
    }
    with Client(str(link)) as client:
        write = client.packets.write1ByteTxRx
        assert until_answered(lambda: write(client.port, 1, 64, 1))[1] == 0
        assert any(b"torque on at 2048" in line for line in process.stderr)
    os.kill(process.pid, signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 0
    assert not link.is_symlink()
