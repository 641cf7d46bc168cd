"""A program that fails, and a disk: what is left of the finger and of the session."""

from __future__ import annotations

import math
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from ikns.errors import IknsError
from ikns.finger import DynamixelFinger, SimulatedFinger
from ikns.finger.emulator import Servo, Wire
from ikns.live.runtime import LoopStatus, run
from ikns.live.session import mend_session, read_run
from ikns.live.stream import Source
from ikns.live.stream.replay import Replay
from live import person
from live.chain import Canary, Clock, Watched, session_for, session_holds, violations
from live.outcome import Outcome
from live.servo_faults import WATCHDOG, still_at
from live.stream_faults import BEAT, Struck

__all__ = ["PROCESS_FAULTS", "kill", "strike"]

#: Stated: a finger whose loop hung is in its safe state, and a few packets later
#: without torque, s.
_LIMP = 0.5 + BEAT + 0.08
#: Stated: a look at what was asked for, and a few packets to the servo, s.
_LEAVE = BEAT + 0.08
#: How often rows are given to the system, and to the disk, s, with some room to do it.
_TOLD, _SYNCED = 0.2 + 0.1, 1.0
_EXCEPTION = "exception in a callback"
_SIGNALS = {
    "SIGTERM": signal.SIGTERM,
    "kill -9": signal.SIGKILL,
    "stopped for 1 s (SIGSTOP)": signal.SIGSTOP,
}
_DISK = ("disk full for 0.5 s", "session folder deleted")
PROCESS_FAULTS = (_EXCEPTION, *_SIGNALS, *_DISK)


def strike(name: str, seed: int, folder: Path) -> Outcome:
    """Inject one fault at a random instant."""
    if name == _EXCEPTION:
        return _exception(seed, folder)
    if name in _DISK:
        return _disk(name, seed, folder)
    return kill(name, seed, folder)[0]


def _exception(seed: int, folder: Path) -> Outcome:
    rng = np.random.default_rng(seed)
    subject, recording = person.load(folder)
    after, raised = rng.uniform(0.3, 1.0), math.nan

    def explode(status: LoopStatus) -> None:
        nonlocal raised
        if status.time > after:
            raised = time.monotonic()
            raise RuntimeError("a screen broke")

    with tempfile.TemporaryDirectory() as scratch:
        session = Path(scratch) / "session"
        servo = Servo("xl430")
        with (
            Canary() as canary,
            Wire(servo) as wire,
            session_for(session, subject, folder / "person", recording) as writer,
        ):
            finger = Watched(DynamixelFinger(wire.port), canary=canary)
            try:
                with Source(Replay(recording, loop=True)) as source:
                    run(
                        source,
                        subject,
                        finger,
                        session=writer,
                        on_status=explode,
                        status_every=0.0,
                    )
            except RuntimeError:
                pass
            left = servo.torque
        wrong = session_holds(session)
    return Outcome(
        _EXCEPTION,
        "relaxed",
        "under torque" if left else "relaxed",
        {"safe": still_at(servo, raised) - raised},
        {"safe": _LEAVE},
        violations(
            finger.told, finger.finger.safety.limits, finger.resolution, between=True
        ),
        wrong,
        stall=max(finger.stall, canary.stall),
    )


def _disk(name: str, seed: int, folder: Path) -> Outcome:
    """Let writing fail; what is done must go on."""
    rng = np.random.default_rng(seed)
    subject, recording = person.load(folder)
    piece = person.piece(recording, int(rng.integers(len(recording.time) - 300)))
    start = int(rng.integers(40, 90))
    unlimited = resource.getrlimit(resource.RLIMIT_FSIZE)
    struck, told = [math.nan], []
    room = int(rng.integers(0, 20_000))

    with tempfile.TemporaryDirectory() as scratch:
        session = Path(scratch) / "session"

        def change(frame, before, since, rng):
            if not since:
                struck[0] = time.monotonic()
                if name == _DISK[0]:  # files may not grow, as on a full disk
                    largest = max(p.stat().st_size for p in session.rglob("*.tsv"))
                    limit = (largest + room, unlimited[1])
                    resource.setrlimit(resource.RLIMIT_FSIZE, limit)
                else:
                    shutil.rmtree(session)
            elif since == 50:
                resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
            return [frame], 0.0

        clock = Clock()
        finger = Watched(SimulatedFinger(clock=clock), clock)
        feed = Struck(Replay(piece), start, start + 100, change, rng)
        try:
            with session_for(
                session,
                subject,
                folder / "person",
                recording,
                on_fault=lambda text: told.append((time.monotonic(), text)),
            ) as writer:
                with Source(feed) as source:
                    report = run(source, subject, finger, session=writer)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, unlimited)
        wrong = session_holds(session, report.frames) if session.exists() else "deleted"
    deleted = name == _DISK[1]
    if deleted and wrong == "deleted":
        wrong = ""  # as it should be: there is nothing left to open
    seconds = {"told": told[0][0] - struck[0]} if told else {}
    after = [change.after for change in report.transitions]
    # A disk with some room left fails only once that is used up: 40 kB a second.
    return Outcome(
        name,
        "active",
        after[-2],
        seconds,
        {"told": _SYNCED if deleted else _TOLD + room / 40e3},
        violations(finger.told, finger.finger.safety.limits, 0.0, between=True),
        wrong,
        (),
        "holding" in after,
        finger.stall,
    )


def kill(
    name: str, seed: int, folder: Path, *, session: Path | None = None
) -> tuple[Outcome, float]:
    """Send a signal to a program that drives a servo; also return the seconds lost."""
    rng = np.random.default_rng(seed)
    number, context = _SIGNALS[name], get_context("forkserver")
    expected = "stopped" if number == signal.SIGKILL else "relaxed"
    lost = limp = math.nan
    with tempfile.TemporaryDirectory() as scratch:
        session = Path(scratch) / "session" if session is None else session
        servo = Servo("xl430")
        with Canary() as canary, Wire(servo) as wire:
            context.set_forkserver_preload(["ikns.live.runtime", "ikns.calibration"])
            ours, theirs = context.Pipe()
            child = context.Process(
                target=_drive, args=(folder, session, wire.port, theirs)
            )
            child.start()
            theirs.close()
            began = _told(ours)
            if isinstance(began, str):  # it never came to drive anything
                child.join(10)
                return Outcome(name, expected, began, {}, {}, 0, ""), lost
            canary.begin()
            time.sleep(rng.uniform(0.3, 2.5))
            # A child that the machine kept from running is safe before it is struck.
            early = not servo.torque or servo.watchdog_error
            struck = time.monotonic()
            os.kill(child.pid, number)
            if number == signal.SIGSTOP:
                time.sleep(1.0)
                os.kill(child.pid, signal.SIGCONT)
                resumed = time.monotonic()
                while servo.torque and time.monotonic() < resumed + 5.0:
                    time.sleep(0.002)
                limp = time.monotonic() - resumed
                child.terminate()
            child.join(10)
            time.sleep(WATCHDOG + 0.1 if number == signal.SIGKILL else 0.0)
            torque = servo.torque
            if number == signal.SIGKILL:  # nothing is left that could switch it off
                torque = torque and not servo.watchdog_error
            still = still_at(servo, struck) - struck
            outside = sum(not 1024 <= goal <= 3072 for _, goal in servo.goals)
        try:
            rows = read_run(session).receive_time  # it opens as it was left
            lost = struck - began - (rows[-1] if len(rows) else 0.0)
            mend_session(session)
            wrong = session_holds(session)
        except Exception as error:
            wrong = str(error)
    remarks = ("the servo was left pushing.",) if torque else ()
    if limp > _LIMP + canary.stall:
        remarks += (f"limp, it was under torque for {limp:.2f} s.",)
    promised = {"safe": _LEAVE if number == signal.SIGTERM else WATCHDOG}
    outcome = Outcome(
        name,
        expected,
        ("stopped" if servo.watchdog_error else "relaxed") if not torque else "pushing",
        {"safe": still},
        promised,
        outside,
        wrong,
        remarks,
        stall=math.inf if early else canary.stall,
    )
    return outcome, lost


def _told(child: Connection) -> float | str:
    """When the child's run began, s, or what kept it from beginning."""
    try:
        told = child.recv()
    except EOFError:
        return "the program died before it drove the finger."
    return told if isinstance(told, float) else str(told)


def _drive(folder: Path, session: Path, port: str, tell: Connection) -> None:
    """Do what `ikns run` does, until stopped."""
    sys.stdout = sys.stderr = Path(os.devnull).open("w", encoding="utf-8")
    subject, recording = person.load(folder)
    told = False

    def note(status: LoopStatus) -> None:
        nonlocal told
        if not told:
            told = True
            tell.send(time.monotonic() - status.time)

    try:
        with session_for(session, subject, folder / "person", recording) as writer:
            with Source(Replay(recording, loop=True)) as source:
                run(
                    source,
                    subject,
                    DynamixelFinger(port),
                    session=writer,
                    on_status=note,
                    status_every=0.05,
                )
    except (IknsError, OSError) as error:
        if told:
            raise
        tell.send(f"did not begin: {error}")
