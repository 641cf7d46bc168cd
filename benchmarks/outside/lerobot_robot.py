"""lerobot's own code on both sides: a robot of it as a finger, and ikns as its leader.

The robot is one servo on lerobot's motor bus (``one_servo``), the servo is simulated,
and so is the person. What is reported of torque and goals is read from the servo. Not
in CI, for which lerobot with PyTorch is too large: run it in an environment of its own
that has ikns, lerobot 0.4 and dynamixel-sdk.

    python benchmarks/outside/lerobot_robot.py [--json]
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

try:
    import lerobot
except ImportError:
    sys.exit(
        "this needs lerobot 0.4 (pip install 'ikns[lerobot]' dynamixel-sdk, in an "
        "environment of its own); it was not run."
    )
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import one_servo  # noqa: E402
from live import person  # noqa: E402

from ikns.finger import Safety, check_finger, open_finger  # noqa: E402
from ikns.finger.emulator import Servo, Wire  # noqa: E402
from ikns.recording.files import write_c3d  # noqa: E402
from ikns.recording.recording import Recording  # noqa: E402

OPEN, CLOSED = 100, 0
#: When nothing is seen, s of the recording: once so shortly that the finger holds and
#: goes on, once so long that it goes to its safe state and stays there.
HIDDEN = ((3.0, 3.35), (7.0, 8.0))
#: Ticks of one step of the follower's goal at most, for "it stays": rounding.
STILL = 1
BAUD = 1_000_000  # lerobot's default for these servos


@contextmanager
def wired() -> Iterator[Wire]:
    """Wire up a servo that lerobot has calibrated."""
    with Wire(Servo("xl430", baud=BAUD)) as wire:
        robot = one_servo.OneServo(one_servo.OneServoConfig(port=wire.port))
        for left in reversed(range(5)):  # on a busy machine its one second is short
            try:
                robot.connect()
                robot.disconnect()
                break
            except ConnectionError:
                if not left:
                    raise
                robot.bus.port_handler.closePort()
        wire.servos[0].goals.clear()
        yield wire


def finger(wire: Wire, safe: str = "limp"):
    """Make the finger that the servo is to lerobot."""
    joint = f"joint=gripper.pos&open={OPEN}&closed={CLOSED}"
    address = f"lerobot:one_servo?{joint}&port={wire.port}&id=simulated"
    return open_finger(address, safety=Safety(safe_state=safe))


def laws() -> dict:
    """Which laws of a finger it keeps."""
    with wired() as wire:
        report = check_finger(lambda: finger(wire), strict=False)
    return {"kept": len(report.kept), "broken": report.broken}


def driven(device, seconds: float) -> None:
    """Command it as a loop does."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        device.command(0.8)
        time.sleep(0.01)


def until(what: Callable[[], bool], seconds: float) -> float:
    """Return the seconds until something holds; NaN if it does not in time."""
    began = time.monotonic()
    while time.monotonic() - began < seconds:
        if what():
            return time.monotonic() - began
        time.sleep(0.002)
    return float("nan")


def fault(kind: str, safe: str) -> dict:
    """Inject a fault; return when it is noticed and when torque is off at the servo."""
    with wired() as wire:
        servo, device = wire.servos[0], finger(wire, safe)
        said = ""
        device.connect()
        driven(device, 0.5)
        if kind == "commands stop":
            began = time.monotonic()
        else:
            wire.inject(kind, 1.0)
            began = time.monotonic()
        noticed = torque = float("nan")
        while time.monotonic() - began < 4.0:
            if kind != "commands stop":
                device.command(0.8)
            now = time.monotonic() - began
            if np.isnan(noticed) and device.state().mode == "safe":
                noticed = now
            if np.isnan(torque) and not servo.torque:
                torque = now
            time.sleep(0.005)
        said = device.state().alert
        try:
            device.relax()
        except ConnectionError as error:
            said += f" / at the end: {error}"
        return {
            "fault": kind,
            "safe state": safe,
            "noticed, s": noticed,
            "no torque at the servo, s": torque,
            "torque in the end": servo.torque,
            "said": said,
        }


CHILD = """
import sys, time
sys.path[:0] = [{here!r}]
import one_servo
from ikns.finger import open_finger
with open_finger({address!r}) as device:
    print("moving", flush=True)
    while True:
        device.command(0.8)
        time.sleep(0.01)
"""


def ended(number: int) -> dict:
    """End the program with a signal; return when torque is off at the servo."""
    with wired() as wire:
        joint = f"joint=gripper.pos&open={OPEN}&closed={CLOSED}"
        address = f"lerobot:one_servo?{joint}&port={wire.port}&id=simulated"
        text = CHILD.format(here=str(HERE), address=address)
        child = subprocess.Popen(
            [sys.executable, "-c", text],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        assert child.stdout is not None
        child.stdout.readline()
        time.sleep(0.3)
        child.send_signal(number)
        off = until(lambda: not wire.servos[0].torque, 4.0)
        child.wait(10)
        return {
            "fault": f"signal {signal.Signals(number).name}",
            "safe state": "limp",
            "no torque at the servo, s": off,
            "torque in the end": wire.servos[0].torque,
        }


def teleoperated(folder: Path) -> dict:
    """Run lerobot-teleoperate as it is, on a recording with gaps."""
    person.make(folder, 1)
    _, points = person.load(folder)
    moving = person.piece(points, 200)
    time_s, markers = moving.time, moving.markers.copy()
    keep = time_s < 11.0
    for begin, end in HIDDEN:
        markers[(time_s >= begin) & (time_s < end)] = np.nan
    path = folder / "hidden.c3d"
    write_c3d(path, Recording(time_s[keep], markers[keep], moving.labels))
    plug_in = "lerobot_teleoperator_ikns"
    try:
        version(plug_in)
        found = []
    except PackageNotFoundError:
        found = ["--teleop.discover_packages_path=ikns.live.lerobot"]
    with wired() as wire:
        words = [
            *("-m", "lerobot.scripts.lerobot_teleoperate"),
            "--robot.discover_packages_path=one_servo",
            *("--robot.type=one_servo", f"--robot.port={wire.port}"),
            *("--robot.id=simulated", "--teleop.type=ikns", *found),
            f"--teleop.subject={folder / 'person'}",
            f"--teleop.source=replay:{path}",
            f"--teleop.joints={{gripper.pos: [{OPEN}, {CLOSED}]}}",
            *("--fps=50", "--teleop_time_s=12"),
        ]
        seen = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        done = subprocess.run(
            [sys.executable, *words], env=seen, capture_output=True, text=True
        )
        servo = wire.servos[0]
        if done.returncode or len(servo.goals) < 2:
            return {"exit code": done.returncode, "stderr": done.stderr[-2000:]}
        at, goal = np.array(servo.goals).T
        torque = servo.torque
    since = at - at[0]
    changed = since[1:][np.abs(np.diff(goal)) > STILL]
    said = "FINGER STOPPED"
    lines = (done.stdout + done.stderr).splitlines()
    return {
        "exit code": done.returncode,
        "plug-in found by": "its distribution" if not found else "its package",
        "actions sent": len(goal),
        "a second": len(goal) / since[-1],
        "goals, ticks": [int(goal.min()), int(goal.max())],
        "longest stand before the last one, s": np.diff(changed).max(),
        "stood in the end, s": since[-1] - changed[-1],
        "torque in the end": torque,
        "told": [line[line.index(said) :] for line in lines if said in line],
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    as_json = parser.parse_args().json
    result = {
        "lerobot": lerobot.__version__,
        "laws": laws(),
        "faults": [
            *(fault("commands stop", safe) for safe in ("limp", "hold", "open")),
            *(fault(kind, "limp") for kind in ("silence", "unplug")),
            *(ended(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)),
        ],
    }
    with tempfile.TemporaryDirectory() as folder:
        result["teleoperation"] = teleoperated(Path(folder))
    if as_json:
        print(json.dumps(result, indent=1, default=float))
        return
    print(f"lerobot {result['lerobot']}, a simulated servo and a simulated person\n")
    kept, broken = result["laws"]["kept"], result["laws"]["broken"]
    print(f"laws of a finger kept: {kept} of {kept + len(broken)} {broken or ''}\n")
    for row in result["faults"]:
        cells = (
            f"{k} {v:.3f}" if isinstance(v, float) else f"{k} {v}"
            for k, v in row.items()
        )
        print("  ".join(cells))
    print(f"\nlerobot-teleoperate, nothing seen at {HIDDEN} s of the recording")
    for name, value in result["teleoperation"].items():
        print(
            f"  {name}: {value:.2f}"
            if isinstance(value, float)
            else f"  {name}: {value}"
        )


if __name__ == "__main__":
    main()
