"""A finger that is a joint of a robot of lerobot, through lerobot's own interface."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from dataclasses import replace
from typing import Self

from ikns.endings import ending_requested
from ikns.errors import InvalidInput
from ikns.finger.attempt import ConnectionAttempt, relax_after
from ikns.finger.errors import FingerError
from ikns.finger.guard import Guard, Safety
from ikns.finger.lerobot_joint import RobotDevice, RobotJoint
from ikns.finger.relax_at_exit import forget, not_relaxed, relax_at_exit
from ikns.finger.state import FingerState

#: Torque is tried to be switched off for so long at the end, s, and how long that is
#: waited for: a call of a robot may block.
_RELEASE_TIMEOUT, _RELAX_TIMEOUT = 1.0, 3.0
#: Seconds between readings of torque that is to stay off.
_CHECK_INTERVAL = 0.1
#: Torque that should be off and was not read to be off for so long is reported, s.
_CONFIRM_TIMEOUT = 1.0


class LeRobotFinger:
    """A finger that is one joint of a robot of lerobot; the others stay where they are.

    A thread of its own talks to the robot, since lerobot's calls may block. Limits,
    stall and timeouts are those of every finger. What lies below is the robot's:
    lerobot switches torque on while it connects, and knows no watchdog, so after the
    program is killed the motor keeps its last goal. See :class:`RobotJoint` for what
    "no torque" means.

    Parameters
    ----------
    robot : lerobot.robots.Robot
        Calibrated, not connected.
    joint : str
        One of its action features, such as ``gripper.pos``.
    open, closed : float
        Its values at flexion 0 and 1, in the robot's units.
    safety : Safety, optional
        Limits, timeouts and the safe state.
    rate : float
        Most cycles per second of sending the goal and observing.
    """

    resolution = 0.0

    def __init__(
        self,
        robot: RobotDevice,
        *,
        joint: str,
        open: float,
        closed: float,
        safety: Safety | None = None,
        rate: float = 50.0,
    ) -> None:
        if not 0 < rate < math.inf:
            raise InvalidInput(f"rate must be positive and finite, not {rate:g}.")
        self.safety = Safety() if safety is None else safety
        self._joint = RobotJoint(robot, joint, open=open, closed=closed)
        self._period = 1.0 / rate
        self._guard = Guard(self.safety)
        self._lock = threading.RLock()  # guard and results, never during a call
        self._access = threading.Lock()  # held while connecting or relaxing
        self._thread: threading.Thread | None = None
        self._connecting: ConnectionAttempt | None = None
        self._stop = threading.Event()
        self._known = FingerState()
        self._sent = self._responded = math.nan
        self._off_checked = -math.inf
        self._unwanted_since = math.inf

    @property
    def port(self) -> str:
        """Port of the robot; empty where its configuration has none."""
        return self._joint.port

    def connect(self) -> None:
        """Connect and follow commands from the present position; leave the safe state.

        Raises
        ------
        FingerError
            When the robot cannot be connected, or was never calibrated.
        """
        with self._access:
            thread = self._thread
            if thread is not None and self._stop.is_set():  # it was to relax
                thread.join(_RELAX_TIMEOUT)
                if thread.is_alive():
                    raise FingerError(f"{self._name} does not answer.")
            relax_at_exit(self)
            request = self._connecting = ConnectionAttempt()
            if thread is None or not thread.is_alive():
                self._stop.clear()
                thread = self._start()
            try:
                request.done.wait()
            except BaseException:  # such as Ctrl-C: the thread relaxes and ends
                self._stop.set()
                raise
            if request.error is not None:
                thread.join()
                raise request.error

    def command(self, flexion: float) -> float:
        """Request a flexion; return the one sent, NaN if none is."""
        with self._lock:
            return self._guard.command(self._check_silence(), flexion)

    def state(self) -> FingerState:
        """Return the latest known state."""
        with self._lock:
            now, guard = self._check_silence(), self._guard
            unconfirmed = ""
            if now - self._unwanted_since > _CONFIRM_TIMEOUT:
                unconfirmed = (
                    f"{self._name} has not confirmed that its torque is off, "
                    "cut its power"
                )
            return replace(
                self._known,
                age=now - self._known.time,
                mode=guard.mode,
                sent=self._sent if guard.torque else math.nan,
                stalled=guard.stalled,
                alert="; ".join(filter(None, (guard.reason, unconfirmed))),
            )

    def make_safe(self, reason: str) -> None:
        """Go to the safe state and stay in it until connected again."""
        with self._lock:
            self._guard.fail(reason)

    def relax(self) -> None:
        """Switch the torque off and disconnect; tries again when repeated.

        Raises
        ------
        FingerError
            When the robot does not answer, or its motor bus does not confirm that the
            torque is off.
        """
        self._stop.set()
        with self._access:
            thread = self._thread
            with self._lock:
                self._guard.relax()
            if thread is None and not self._joint.off:  # it failed before
                with contextlib.suppress(RuntimeError):  # Python starts none at exit
                    thread = self._start()
            if thread is not None:
                thread.join(_RELAX_TIMEOUT)
                if not thread.is_alive():
                    self._thread = thread = None
            if thread is not None or not self._joint.off:
                raise not_relaxed(
                    self,
                    f"{self._name} did not confirm that its torque is off, cut its "
                    "power.",
                )

    def __enter__(self) -> Self:
        """Connect."""
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        """Relax; a failure is added as a note to an exception already raised."""
        relax_after(self.relax, exception[1])

    @property
    def _name(self) -> str:
        return f"the robot with {self._joint.name}"

    def _check_silence(self) -> float:
        """Check the timeouts here too, as a call of the robot may block its thread."""
        now = time.monotonic()
        timeout = self.safety.silence_timeout
        if self._guard.mode == "active" and now - self._responded > timeout:
            self._guard.fail(f"no answer from the robot for {timeout:g} s")
        self._guard.tick(now)
        wrong = not (self._guard.torque or self._joint.off)
        self._unwanted_since = min(self._unwanted_since, now) if wrong else math.inf
        return now

    def _start(self) -> threading.Thread:
        """Start the thread; once it is to stop, that only switches the torque off."""
        name = f"finger on {self._joint.name}"
        thread = threading.Thread(target=self._run, daemon=True, name=name)
        thread.start()
        self._thread = thread
        return thread

    def _run(self) -> None:
        """Own the robot from connecting until the torque is off, whatever happens."""
        request = None
        while not self._stop.is_set():
            request, self._connecting = self._connecting, None
            if ending_requested():
                with self._lock:
                    self._guard.relax()
            if request is not None:
                self._open(request)
                if request.error is not None:
                    break
                request.done.set()
            try:
                self._cycle()
            except Exception as error:  # the robot's library raises what it likes
                self._failed(error)
            self._stop.wait(self._period)
        self._release()
        if self._joint.off:
            forget(self)
        for late in (request, self._connecting):
            if late is not None and not late.done.is_set():
                late.error = late.error or self._given_up()
                late.done.set()

    def _release(self) -> None:
        """Switch the torque off, more than once if need be, and disconnect."""
        give_up = time.monotonic() + _RELEASE_TIMEOUT
        while True:
            try:
                self._joint.switch_off()
            except Exception:  # one packet may be lost
                self._joint.off = False
            if self._joint.off or time.monotonic() > give_up:
                break
            time.sleep(self._period)
        with contextlib.suppress(Exception):
            self._joint.disconnect()

    def _open(self, request: ConnectionAttempt) -> None:
        """Connect, on the thread; note what went wrong in the request."""
        try:
            with self._lock:
                self._guard.relax()
            flexion = self._joint.connect()
            with self._lock:
                self._guard.start(self._observed(flexion), flexion)
            if self._stop.is_set() or ending_requested():
                raise self._given_up()
            self._sent = self._joint.send(self._guard.goal)
        except FingerError as error:
            request.error = error
        except Exception as error:
            request.error = FingerError(f"{self._name}: {_first_line(error)}.")
        if request.error is not None:
            with self._lock:
                self._guard.relax()

    def _given_up(self) -> FingerError:
        return FingerError(f"{self._name}: connecting was aborted.")

    def _cycle(self) -> None:
        """Send the goal, or keep the torque off, and observe."""
        with self._lock:
            self._guard.tick(time.monotonic())
            torque, goal = self._guard.torque, self._guard.goal
        if torque:
            self._sent = self._joint.send(goal)
        elif (
            not self._joint.off
            or time.monotonic() - self._off_checked > _CHECK_INTERVAL
        ):
            self._joint.switch_off()
            self._off_checked = time.monotonic()
        flexion = self._joint.observe()
        with self._lock:
            if math.isfinite(flexion):
                self._guard.measured(self._observed(flexion), flexion)

    def _observed(self, flexion: float) -> float:
        now = self._responded = time.monotonic()
        self._known = FingerState(time=now, flexion=flexion)
        return now

    def _failed(self, error: Exception) -> None:
        with self._lock:
            timeout = self.safety.silence_timeout
            if time.monotonic() - self._responded > timeout:
                self._guard.fail(
                    f"no answer from the robot for {timeout:g} s ({_first_line(error)})"
                )


def _first_line(error: Exception) -> str:
    """Return what an exception says, on one line and without full stops."""
    lines = str(error).strip().splitlines()
    text = lines[0] if lines else type(error).__name__
    return text.rstrip(".").replace(". ", "; ")
