"""A visit whose finger has stopped: nothing begins, and nothing old looks new."""

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import small_person
from test_conduct import ask, start

from ikns.experiments.conduct import Conductor
from ikns.experiments.conduct.live import LiveDriver, live_driver
from ikns.experiments.conduct.measured import recent_values
from ikns.experiments.conduct.signal_monitor import SignalMonitor
from ikns.finger import SimulatedFinger
from ikns.live.stream import Source
from ikns.live.stream.replay import Replay

STOPPED = {"state": "stopped", "finger": "stopped: overheating", "stopped": "too hot"}


def stopped(folder: Path, experiment: str = "tracking") -> Conductor:
    at = start(folder, experiment)
    at.set_source_status(STOPPED)
    return at


@pytest.mark.parametrize("experiment", ["tracking", "picking"])
def test_no_trial_begins_while_the_finger_is_stopped(
    tmp_path: Path, experiment: str
) -> None:
    at = stopped(tmp_path / "v", experiment)
    shown = ask(at, 0.1, "begin")
    assert shown["state"] == "waiting"
    assert shown["message"] == ("Finger stopped (Too hot); press Connect again first.")
    assert shown["stopped"]["title"] == "Finger stopped"
    assert shown["stopped"]["reason"] == "Too hot."
    assert "Connect again" in shown["stopped"]["remedy"]
    at.set_source_status({"state": "active", "finger": "active", "stopped": ""})
    assert at.update(0.2)["message"] == ""  # it no longer holds
    assert ask(at, 0.3, "begin")["state"] in ("align", "ready")


def test_a_source_that_is_gone_stops_a_finger_or_only_the_signal(
    tmp_path: Path,
) -> None:
    at = start(tmp_path / "v")
    for finger, title in ((True, "Finger stopped"), (False, "No control signal")):
        at.set_source_status({}, fault="lsl:lab has ended.", moved_finger=finger)
        shown = ask(at, 0.1, "begin")
        assert shown["stopped"]["title"] == title
        assert shown["stopped"]["reason"] == "Lsl:lab has ended."
        assert title in shown["message"]
        assert shown["state"] == "waiting"
    at.set_source_status({})
    shown = at.update(0.2)
    assert (shown["stopped"], shown["fault"], shown["message"]) == (None, "", "")


def test_connecting_again_aborts_the_trial_and_opens_the_source_once(
    tmp_path: Path,
) -> None:
    at = start(tmp_path / "v")
    assert "nothing has stopped" in ask(at, 0.1, "connect")["message"].lower()
    assert not at.take_reconnect()
    ask(at, 0.2, "begin")
    at.set_source_status(STOPPED)
    shown = ask(at, 0.3, "connect")
    assert shown["state"] == "waiting"
    assert "Too hot" in shown["attempts"][-1]["reason"]
    assert at.take_reconnect()
    assert not at.take_reconnect()


def test_a_finger_whose_source_is_there_is_armed_and_not_opened_again(
    tmp_path: Path,
) -> None:
    at = start(tmp_path / "v")
    armed = []
    at.on_arm = [lambda: armed.append(True)]
    ask(at, 0.1, "connect")
    assert armed == []  # nothing has stopped
    at.set_source_status(STOPPED)
    assert ask(at, 0.2, "connect")["message"] == ""
    assert armed == [True]
    assert not at.take_reconnect()
    assert "was stopped" in ask(at, 0.3, "emergency", "connect")["message"]
    assert armed == [True]


def test_after_an_emergency_stop_nothing_is_connected(tmp_path: Path) -> None:
    at = stopped(tmp_path / "v")
    shown = ask(at, 0.1, "emergency", "connect")
    assert shown["stopped"]["title"] == "Run stopped"
    assert not shown["can_connect"]
    assert not at.take_reconnect()


def test_a_refusal_disappears_when_it_no_longer_holds(tmp_path: Path) -> None:
    at = start(tmp_path / "v")
    at.add_sample(1.0, float("nan"))
    assert "No control signal" in ask(at, 2.0, "begin")["message"]
    assert "No control signal" in at.update(3.0)["message"]  # it still holds
    at.add_sample(4.0, 0.5)
    assert at.update(4.0)["message"] == ""
    ask(at, 4.0, "pause")
    assert "paused" in ask(at, 4.0, "begin")["message"]
    assert ask(at, 4.1, "pause")["message"] == ""
    ask(at, 4.1, "begin")
    assert ask(at, 4.2, "begin")["message"] == "A trial is already running."
    assert ask(at, 4.3, "abort")["message"] != "A trial is already running."


def test_a_value_is_known_for_half_a_second() -> None:
    found = recent_values(
        ({"a": 1, "b": 2}, 0.5), ({"c": 3}, 0.51), ({"d": ""}, float("nan"))
    )
    assert [found[k] for k in "abcd"] == [1, 2, None, None]
    assert found["unknown"] == ["c", "d"]
    assert found["age"]["b"] == 0.5


# --- with a live loop -----------------------------------------------------------------


class Breaking(Replay):
    """A recording that stays silent once a test says so."""

    silent = False

    def poll(self, timeout: float) -> Any:
        if self.silent:
            time.sleep(timeout)
            return None
        return super().poll(timeout)


def wait(driver: LiveDriver, what: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    end = time.monotonic() + 60
    while not what(shown := driver.status()):
        assert time.monotonic() < end, shown
        time.sleep(0.01)
    return shown


def moving() -> Breaking:
    recording = small_person.protocol().points.recording
    return Breaking(small_person.cut(recording, 0, 60), loop=True)


@pytest.mark.parametrize("with_finger", [True, False])
def test_a_silent_stream_has_no_valid_pose(with_finger: bool) -> None:
    client = moving()
    with live_driver(
        lambda: Source(client),
        small_person.subject(),
        finger=SimulatedFinger if with_finger else None,
    ) as driver:
        known = wait(driver, lambda shown: shown.get("refused") == "")
        assert known["unknown"] == [] or "refused" not in known["unknown"]
        wait(driver, lambda shown: shown.get("state") == "active")
        client.silent = True
        shown = wait(driver, lambda shown: "refused" in shown["unknown"])
        for name in ("refused", "residual", "worst_residual", "inside"):
            assert shown[name] is None
            assert shown["age"][name] > 0.5
        # The loop itself goes on, and says what has stopped and why.
        shown = wait(driver, lambda shown: bool(shown["stopped"]))
        wait(driver, lambda shown: shown["state"] == "stopped")
        if with_finger:
            assert "no valid pose" in shown["stopped"]
            assert shown["finger"].startswith("stopped: no valid pose")
        signal = SignalMonitor([])
        signal.source = shown
        notice = signal.stop_notice()
        assert notice is not None
        title = "Finger stopped" if with_finger else "No control signal"
        assert notice["title"] == title


def test_a_loop_that_hangs_makes_everything_unknown() -> None:
    free = threading.Event()
    free.set()

    def hang(status: object) -> None:
        free.wait(60)

    with live_driver(
        lambda: Source(moving()), small_person.subject(), on_status=hang
    ) as driver:
        wait(driver, lambda shown: shown.get("state") == "active")
        free.clear()
        try:
            wait(driver, lambda shown: set(shown["unknown"]) == set(shown["age"]))
        finally:
            free.set()
        wait(driver, lambda shown: "state" not in shown["unknown"])
