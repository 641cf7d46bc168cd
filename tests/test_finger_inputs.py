import math
import os
import struct
import time
import tty

import pytest

from ikns.errors import InvalidInput
from ikns.finger import FingerError
from ikns.finger.inputs import Gamepad, Keyboard, RingButton


def until(condition):
    end = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.002)


def test_a_ring_button_goes_to_and_fro_at_its_rate():
    now = 0.0
    ring = RingButton(rate=0.5, clock=lambda: now)
    assert ring() == (0.0, 0.0)
    ring.press()
    now = 1.0
    assert ring() == (1.0, 0.5)
    now = 10.0
    assert ring() == (10.0, 1.0)
    ring.press()
    now = 11.0
    assert ring() == (11.0, 0.5)
    with pytest.raises(InvalidInput, match=r"rate must be positive"):
        RingButton(rate=0.0)


def test_keys_move_the_signal_and_the_terminal_is_given_back():
    master, slave = os.openpty()
    before = tty.tcgetattr(slave)
    with Keyboard(number=slave, step=0.25) as keys:
        assert keys()[1] == 0.0
        for typed, signal in (
            (b"++", 0.5),
            (b"\x1b[A", 0.75),
            (b"-", 0.5),
            (b"\x1b[B" * 5, 0.0),
            (b" ", 1.0),
            (b"++++", 1.0),
        ):
            os.write(master, typed)
            until(lambda signal=signal: keys()[1] == signal)
    assert tty.tcgetattr(slave) == before
    os.close(master)
    os.close(slave)


def test_a_keyboard_needs_a_terminal(tmp_path):
    with (tmp_path / "file").open("w") as file, pytest.raises(InvalidInput):
        Keyboard(number=file.fileno())


def test_a_gamepad_is_read_as_linux_shows_it_and_missed_when_gone(tmp_path):
    path = tmp_path / "js0"
    os.mkfifo(path)

    def event(value, kind=2, number=1):
        return struct.pack("<IhBB", 0, value, kind, number)

    with Gamepad(path) as pad:
        with path.open("wb", buffering=0) as device:
            device.write(event(-32767, kind=0x82))  # how it is at first
            until(lambda: pad()[1] == 1.0)
            device.write(event(-16384)[:5])  # in pieces
            device.write(event(-16384)[5:] + event(32767, number=0))
            until(lambda: pad()[1] == pytest.approx(0.5, abs=1e-4))
            device.write(event(1, kind=1) + event(32767))  # a button, then pulled
            until(lambda: pad()[1] == 0.0)
        until(lambda: math.isnan(pad()[1]))
    pad.close()


def test_a_trigger_rests_at_its_negative_end(tmp_path):
    path = tmp_path / "js0"
    os.mkfifo(path)
    with (
        Gamepad(path, axis=5, whole=True, reverse=False) as pad,
        path.open("wb", buffering=0) as device,
    ):
        device.write(struct.pack("<IhBB", 0, 0, 2, 5))
        until(lambda: pad()[1] == 0.5)
        device.write(struct.pack("<IhBB", 0, -32767, 2, 5))
        until(lambda: pad()[1] == 0.0)


def test_a_gamepad_that_is_not_there_is_refused():
    with pytest.raises(FingerError, match=r"js99: no gamepad there"):
        Gamepad("/dev/input/js99")
