"""``ikns servo``: emulate a Dynamixel servo on a pseudo-terminal, without hardware."""

from __future__ import annotations

import contextlib
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from ikns.cli.keyboard import keyboard, pressed_keys
from ikns.cli.options import AsJson
from ikns.cli.output import json_text
from ikns.errors import InvalidInput

_KEYS = {
    "s": "silence",
    "m": "mute",
    "d": "delay",
    "c": "crc",
    "i": "id",
    "a": "alert",
    "o": "overheat",
    "p": "power",
    "u": "unplug",
}
#: A port unplugged by key is back after this long, s.
_UNPLUGGED = 3.0
#: Wait for a key, and interval of looking for events, s.
_WAIT = 0.05


def servo(
    model: Annotated[
        str, typer.Option(help="xl430, xm430, mx28 or ax12 (Protocol 1.0).")
    ] = "xl430",
    id: Annotated[
        list[int] | None,
        typer.Option(
            help="ID on the bus. Repeat for more servos on the port.",
            show_default="1",
            min=0,
            max=252,
        ),
    ] = None,
    baud: Annotated[int, typer.Option(help="Baud rate, bit/s.")] = 57600,
    link: Annotated[
        Path | None, typer.Option(help="Symbolic link to create to the serial port.")
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            help="Fault to inject, KIND[=VALUE]@START[+DURATION], s. Repeat for more."
        ),
    ] = None,
    answer_delay: Annotated[
        float,
        typer.Option(
            help="Delay between an instruction and its answer, s, in addition to "
            "the transmission time.",
            min=0,
            max=1,
        ),
    ] = 0.0,
    obstacle: Annotated[
        float | None,
        typer.Option(
            help="Position that the servo cannot pass, ticks.",
            min=-1000000.0,
            max=1000000.0,
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            help="Time to run, s. Default: until q or Ctrl-C.", min=0.0, max=86400.0
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Emulate Dynamixel servos on a serial port, with faults on demand.

    Faults: silence, mute, delay, crc, id, alert, overheat, power, unplug. On a
    terminal their first letters inject them, r repairs and q quits.
    """
    import math

    from ikns.finger.emulator import FAULTS, Servo, Wire, parse_fault

    faults = [parse_fault(text) for text in fault or ()]
    numbers = id or [1]
    if len(set(numbers)) < len(numbers):
        raise InvalidInput(
            f"expected different ids, found {', '.join(map(str, numbers))}."
        )
    servos = [Servo(model, id=number, baud=baud) for number in numbers]
    if obstacle is not None:
        for made in servos:
            beyond = obstacle > made.motor.position
            ends = (-math.inf, obstacle) if beyond else (obstacle, math.inf)
            made.motor.obstacles = ends
    with (
        contextlib.suppress(KeyboardInterrupt),  # the usual way to stop it
        Wire(*servos, link=link, faults=faults, answer_delay=answer_delay) as wire,
        pressed_keys() as keys,
    ):
        ids: int | list[int] = numbers[0] if len(numbers) == 1 else numbers
        about = {"port": wire.port, "model": model, "id": ids, "baud": baud}
        if as_json:
            sys.stdout.write(json_text({**about, "simulated": True}))
        else:
            sys.stdout.write(_words(wire.port, model, numbers, baud))
            if keyboard():
                letters = ", ".join(f"{k} {v}" for k, v in _KEYS.items())
                sys.stdout.write(f"Keys: {letters}, r repair, q quit\n")
        sys.stdout.flush()
        seen = [0] * len(servos)
        while duration is None or wire.elapsed < duration:
            pressed = keys(_WAIT)[:1]
            if pressed == "q":
                break
            if pressed == "r":
                wire.clear_faults()
            elif pressed in _KEYS:
                lasts = _UNPLUGGED if pressed == "u" else math.inf
                wire.inject(_KEYS[pressed], lasts)
                sys.stderr.write(f"{wire.elapsed:8.2f} s  {FAULTS[_KEYS[pressed]]}\n")
            for k, made in enumerate(servos):
                events = list(made.events)
                which = f"servo {made.id}: " if len(servos) > 1 else ""
                for at, text in events[seen[k] :]:
                    since = at - (time.monotonic() - wire.elapsed)
                    where = f"{text} at {made.motor.position:.0f}"
                    sys.stderr.write(f"{since:8.2f} s  {which}{where}\n")
                seen[k] = len(events)


def _words(port: str, model: str, numbers: list[int], baud: int) -> str:
    """Say what is emulated, and how to drive it."""
    which = ", ".join(map(str, numbers))
    fingers = [
        f"--finger 'dynamixel:{port}?id={number}&baud={baud}&model={model}"
        + (f"&dof={dof}'" if dof > 1 else "'")
        for dof, number in enumerate(numbers, start=1)
    ]
    plural = "s" if len(numbers) > 1 else ""
    return (
        f"{port}: simulated {model}, id{plural} {which}, {baud} baud; try "
        f"{' '.join(fingers)}\n"
    )
