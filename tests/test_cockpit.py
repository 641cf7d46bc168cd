"""A visit in a real browser: Chromium plays trials, and what it did is on disk.

Headless Chromium draws in software, and the machine may be busy: nothing here depends
on how fast anything is. The visit's clock only goes on when a test lets time pass, and
everything else is waited for.
"""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from threading import Condition, Event, Thread
from typing import Any

import numpy as np
import pytest
from accessible import judge

from ikns.experiments.cockpit import Cockpit, page_socket
from ikns.experiments.conduct import (
    Command,
    Conductor,
    HeldInput,
    PickingExperiment,
    TrackingExperiment,
    VisitLog,
    run_visit,
    visit_loop,
)
from ikns.experiments.conduct.measured import recent_values
from ikns.experiments.conduct.ring import ring_driver
from ikns.experiments.picking import pick_schedule
from ikns.experiments.tracking import measure, schedule
from ikns.experiments.visits import read_visit, tracking_record
from ikns.finger import Safety, SimulatedFinger
from ikns.view.scene.picture import browser_options

NEXT_WHILE_TRACKING = (
    "The participant follows the line. Abort if something went wrong; the trial comes "
    "again."
)
PAGES = ("gamepad", "keyboard", "mouse")
#: A gamepad as browsers give it; the test moves its stick.
GAMEPAD = """
    window.stick = {
        axes: [0, 0, 0, 0], pressed: false, there: true, mapping: "standard" };
    const button = () => ({ pressed: false, touched: false, value: 0 });
    navigator.getGamepads = () => {
        if (!stick.there) return [null, null, null, null];
        const buttons = Array.from({ length: 17 }, button);
        buttons[0] = { pressed: stick.pressed, touched: stick.pressed, value: 1 };
        return [null, { id: "Test", index: 1, connected: true, mapping: stick.mapping,
            axes: stick.axes, buttons, timestamp: performance.now() }, null, null];
    };
"""
#: Names and values of the panel's rows, and on how many lines the values stand.
ROWS = """() => [...document.querySelectorAll("#facts dt")].map(
    name => [name.textContent, name.nextSibling.textContent])"""
LINES = """() => [...document.querySelectorAll("#facts dt")].map(name => {
    const value = document.createRange();
    value.selectNodeContents(name.nextSibling);
    return [name.textContent, value.getClientRects().length];
})"""
#: How much time passes at once, s: less than a signal may be old, which is 0.2 s.
STEP = 0.15


@pytest.fixture(scope="module")
def browser_arguments() -> list[str]:
    """As for any page, but for 3-D: without it a browser computes half as much."""
    return ["--disable-gpu", *(o for o in browser_options() if o == "--no-sandbox")]


class Clock:
    """The time of a visit, s, in place of the module ``time``: it has to be moved."""

    def __init__(self) -> None:
        self.stop = Event()
        self._now, self._turns, self._news = time.monotonic(), 0, Condition()

    def monotonic(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        """End a turn of the visit's loop."""
        with self._news:
            self._turns += 1
            self._news.notify_all()
        time.sleep(0.005)
        while self.stop.is_set():  # the visit hangs, and time passes
            time.sleep(0.05)
            self._now += 0.05

    def let_pass(self, seconds: float) -> None:
        """Move on, and return when a whole turn of the loop has seen it."""
        with self._news:
            self._now += seconds
            seen = self._turns + 2
            assert self._news.wait_for(lambda: self._turns >= seen, 60)


class StillArm(HeldInput):
    """An arm that is held still; a test sets what the panel shows of it."""

    shown: Mapping[str, Any] | None = None

    def status(self) -> dict[str, Any]:
        return super().status() if self.shown is None else dict(self.shown)


@dataclass
class Served:
    """A visit that is served, and pages that look at it."""

    conductor: Conductor
    cockpit: Cockpit
    clock: Clock
    chromium: Any
    source: "StillArm"
    complaints: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    pages: list[Any] = field(default_factory=list)
    heard: int = 0

    def open(self, address: str, *, script: str = "", stopped: bool = False) -> Any:
        """Open a page; one that is stopped has a clock of its own that stands still."""
        page = self.chromium.new_page(viewport={"width": 640, "height": 400})
        self.pages.append(page)
        if script:
            page.add_init_script(script)
        page.on("console", lambda said: self.complaints.append(said.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("requestfailed", lambda r: self.complaints.append(r.url))
        page.on("request", lambda request: self.asked.append(request.url))
        if stopped:
            page.clock.install(time=0)
        page.goto(address)
        return page

    def participant(self, **options: Any) -> Any:
        page = self.open(self.cockpit.url, **options)
        page.wait_for_function(
            "() => document.getElementById('prompt').textContent !== ''"
        )
        return page

    def panel(self) -> Any:
        page = self.open(self.cockpit.panel_url)
        page.wait_for_function(
            "() => document.getElementById('state').textContent !== ''"
        )
        return page

    def wait(self, what: Any, seconds: float = 60.0) -> None:
        """Wait, as long as it takes, until something holds of what is shown."""
        end = time.monotonic() + seconds
        while not what(self.conductor.shown):
            shown = self.conductor.shown
            assert time.monotonic() < end, (shown["fault"], shown["message"], shown)
            # Playwright's own events are handled meanwhile.
            self.pages[-1].wait_for_timeout(5)

    def until(self, *states: str) -> None:
        self.wait(lambda shown: shown.get("state") in states)

    def let_pass(self, seconds: float) -> None:
        """Let the visit's clock go on."""
        self.clock.let_pass(seconds)
        self.heard = self.conductor.shown["source"].get("received", 0)

    def hears(self, c: float, within: float = 0.0) -> None:
        """Wait until a page has told a control signal at the present time."""

        def told(shown: Any) -> bool:
            new = shown["source"].get("received", 0) > self.heard
            return new and abs(shown["c"] - c) <= within

        self.wait(told)

    @property
    def rows(self) -> list[dict[str, Any]]:
        return read_visit(self.conductor.log.folder).attempts


def says(page: Any, id: str, text: str) -> None:
    """Wait until a page shows a text."""
    page.wait_for_function(
        "([id, text]) => document.getElementById(id).textContent === text",
        arg=[id, text],
    )


@contextmanager
def at_work(
    chromium: Any,
    folder: Path,
    conditions: list[str],
    fingers: list[SimulatedFinger] | None = None,
    **design: Any,
) -> Iterator[Served]:
    """A visit that goes on in a thread, as the command carries it out."""
    picking = conditions == ["ring"]
    align = design.pop("align", 1.0)
    design = {"conditions": conditions, "training": 0, "rest": 0.2} | design
    steps: Any = (
        pick_schedule(0, objects=["A"], **design)
        if picking
        else schedule(0, profiles=["T1"], **design)
    )
    log = VisitLog(
        folder,
        {
            "experiment": "picking" if picking else "tracking",
            "participant": "01",
            "simulated": False,
            "design": design,
        },
    )
    experiment: Any = (
        PickingExperiment(steps, log.attempts)
        if picking
        else TrackingExperiment(steps, log.attempts, align=align)
    )
    conductor = Conductor(experiment, log, page_conditions=[*PAGES, "ring"])
    clock = Clock()
    held = {name: HeldInput() for name in conditions if name in PAGES}
    arm = StillArm(timeout=3600.0)
    arm.put(clock.monotonic(), 0.5)
    presses: SimpleQueue[None] = SimpleQueue()
    drivers: Any = {
        name: lambda one=one: nullcontext(one) for name, one in held.items()
    }
    drivers["ikns"] = lambda: nullcontext(arm)
    made_fingers = [] if fingers is None else fingers

    def make_finger() -> SimulatedFinger:
        # A busy machine may keep anything waiting.
        finger = SimulatedFinger(safety=Safety(command_timeout=60.0))
        made_fingers.append(finger)
        return finger

    drivers["ring"] = lambda: ring_driver(presses, make_finger)
    stop = Event()
    with (
        pytest.MonkeyPatch.context() as patch,
        Cockpit(conductor, held, on_press=lambda: presses.put(None)) as cockpit,
    ):
        for module in (visit_loop, page_socket):
            patch.setattr(module, "time", clock)
        thread = Thread(
            target=run_visit, args=(conductor, drivers), kwargs={"stop": stop}
        )
        thread.start()
        made = Served(conductor, cockpit, clock, chromium, arm)
        try:
            yield made
            assert made.complaints == []
            # Nothing came from anywhere else.
            home = cockpit.url.partition("?")[0]
            assert {url[: len(home)] for url in made.asked} == {home}
        finally:
            for page in made.pages:
                if not page.is_closed():
                    page.close()
            stop.set()
            thread.join()


def test_a_whole_trial_with_a_gamepad(chromium: Any, tmp_path: Path) -> None:
    """5 s to align and 25 s to follow, as in the paper; here the stick follows."""
    with at_work(chromium, tmp_path / "v", ["gamepad"], repeats=1, align=5.0) as visit:
        page = visit.participant(script=GAMEPAD)
        page.evaluate("stick.axes[1] = -0.25")
        visit.hears(0.25)
        page.evaluate("stick.pressed = true")
        visit.until("align")
        page.evaluate("stick.pressed = false")
        profile, _ = visit.conductor.experiment.trial()  # type: ignore[attr-defined]
        for end in np.arange(1, round(30 / STEP) + 1) * STEP - 5.0:
            c = float(profile.at(end)) / 100
            page.evaluate("c => { stick.axes[1] = -c; }", c)
            visit.hears(c)
            visit.let_pass(STEP)
        visit.let_pass(STEP)
        visit.until("finished")
        says(page, "prompt", "That was all. Thank you!")
        (row,) = visit.rows
    assert row["outcome"] == "done"
    record = tracking_record(row)
    # A row for the beginning and each step; the clock rounds.
    assert np.allclose(record.time, np.arange(len(record.time)) * STEP - 5, atol=1e-6)
    assert len(record.time) == round(30 / STEP) + 1
    # The stick was where the line was, but for the beginning: rows of a clock that is
    # 1e-6 off at a line of at most 50 per second.
    assert np.abs(100 * record.c - record.target)[1:].max() < 1e-4
    figures = measure(record)
    assert figures.rmse < 1e-3
    assert figures.correlation > 0.9999  # over the lags that fit between two rows
    assert visit.conductor.results[-1]["rmse"] == figures.rmse


def test_a_trial_with_the_keyboard_and_the_panel(chromium: Any, tmp_path: Path) -> None:
    with at_work(chromium, tmp_path / "v", ["keyboard"], repeats=1, align=0.0) as visit:
        panel, page = visit.panel(), visit.participant(stopped=True)
        page.clock.pause_at(3600)
        assert panel.inner_text("#state") == "Waiting"
        assert panel.is_disabled("#abort")
        page.keyboard.down("ArrowUp")
        page.clock.run_for(800)
        page.keyboard.up("ArrowUp")
        page.clock.run_for(100)
        visit.hears(0.4, 1e-9)  # at 0.5 per second, whatever the page draws
        panel.click("#begin")
        visit.until("track")
        says(panel, "state", "Tracking")
        page.keyboard.down("KeyS")
        for k in range(1, 5):
            page.clock.run_for(1000 * STEP)
            # The page tells what holds 60 times a second.
            visit.hears(0.4 - 0.5 * k * STEP, 0.5 / 60 + 1e-9)
            visit.let_pass(STEP)
        page.keyboard.up("KeyS")
        for _ in range(5):
            page.clock.run_for(1000 * STEP)
            visit.hears(0.4 - 2 * STEP, 1e-9)
            visit.let_pass(STEP)
        visit.let_pass(25.0)
        visit.until("finished")
        panel.wait_for_function(
            "() => document.querySelectorAll('#attempts tr').length === 1"
        )
        (row,) = visit.rows
        shown = panel.inner_text("#attempts")
    assert row["outcome"] == "done"
    record = tracking_record(row)
    assert f"{measure(record).rmse:.2f}" in shown
    steps = np.arange(10)  # the first where the trial began
    assert np.allclose(record.time[:10], steps * STEP, atol=1e-6)
    ramp = 0.4 - 0.5 * STEP * np.minimum(steps, 4)
    assert np.abs(record.c[:10] - ramp).max() < 0.5 / 60 + 1e-9
    assert np.isnan(record.c[10:]).all()  # when the clock jumped it was too old


def test_instructions_come_first_and_a_training_trial_tells_its_score(
    chromium: Any, tmp_path: Path
) -> None:
    """And both pages fit a phone and are accessible, waiting and while a trial runs."""
    with at_work(chromium, tmp_path / "v", ["ikns"], repeats=1, training=1) as visit:
        panel, page = visit.panel(), visit.participant()
        says(panel, "next", "Press Begin when the participant is ready.")
        page.wait_for_selector("#card", state="visible")
        assert "Lift your elbow" in page.inner_text("#card")
        assert page.is_hidden("#score")
        judge(page)
        panel.click("#begin")
        visit.until("align")
        page.wait_for_selector("#card", state="hidden")
        visit.let_pass(1.5)
        visit.until("track")
        says(panel, "next", NEXT_WHILE_TRACKING)
        # The arm stays at 0.5, and tells so for longer than the second that is needed.
        for _ in range(10):
            visit.source.put(visit.clock.monotonic(), 0.5)
            visit.let_pass(STEP)
        visit.let_pass(25.0)
        visit.until("waiting")
        (row,) = visit.rows
        assert row["kind"] == "training"
        says(page, "points", f"{measure(tracking_record(row)).rmse:.1f}")
        # Not again: the condition is known.
        assert page.is_hidden("#how")
        judge(panel)
        # What a trial is worth is told in training only.
        panel.click("#begin")
        visit.until("align")
        panel.click("#abort")
        visit.until("waiting")
        page.wait_for_selector("#card", state="hidden")


def test_a_page_that_closes_and_one_that_watches(chromium: Any, tmp_path: Path) -> None:
    with at_work(chromium, tmp_path / "v", ["mouse"], repeats=1) as visit:
        first, second = visit.participant(), visit.participant()
        assert first.is_hidden("#viewer")
        assert second.is_visible("#viewer")
        assert "only watches" in second.inner_text("#hint")
        # What the second one does counts for nothing.
        second.mouse.move(320, 350)
        second.keyboard.press("Space")
        first.mouse.move(320, 120)
        visit.wait(lambda shown: (shown["c"] or 0) > 0.6)
        assert visit.conductor.shown["state"] == "waiting"
        first.keyboard.press("Space")
        visit.until("align", "track")
        first.close()
        visit.until("waiting")
        (row,) = visit.rows
        assert row["outcome"] == "aborted"
        assert "page was closed" in row["reason"]
        # The other one takes over, and the trial comes again.
        second.wait_for_function("() => document.getElementById('viewer').hidden")
        second.mouse.move(320, 200)
        visit.wait(lambda shown: shown["c"] is not None and shown["c"] == shown["c"])
        second.keyboard.press("Space")
        visit.until("align", "track")
        assert visit.conductor.shown["step"]["repeat"] == row["repeat"] + 1


def test_a_browser_without_the_token_is_refused(chromium: Any, tmp_path: Path) -> None:
    """Another user of this machine finds the port, but not the token."""
    with at_work(chromium, tmp_path / "v", ["ikns"], repeats=1) as visit:
        panel = visit.panel()
        home = visit.cockpit.url.partition("?")[0]
        assert panel.url == f"{home}panel"  # the token has left the address bar
        stranger = chromium.new_page()
        try:
            for path in ("", "panel"):
                answer = stranger.goto(home + path)
                assert answer.status == 403
                assert "open the address that the command" in stranger.inner_text(
                    "body"
                )
        finally:
            stranger.close()


def test_an_unplugged_gamepad_gives_no_signal(chromium: Any, tmp_path: Path) -> None:
    with at_work(chromium, tmp_path / "v", ["gamepad"], repeats=1) as visit:
        page = visit.participant(script=GAMEPAD)
        visit.hears(0.0)
        page.evaluate("stick.there = false")
        visit.wait(lambda shown: not shown["c"] == shown["c"])
        says(page, "input", "No gamepad yet: press one of its buttons")
        visit.let_pass(1.1)  # a signal that came within a second would do
        page.keyboard.press("Space")
        visit.wait(lambda shown: "button of the gamepad" in shown["message"])
        assert visit.conductor.shown["state"] == "waiting"


def test_both_pages_say_which_gamepad_is_read(chromium: Any, tmp_path: Path) -> None:
    with at_work(chromium, tmp_path / "v", ["gamepad"], repeats=1) as visit:
        panel, page = visit.panel(), visit.participant(script=GAMEPAD)
        visit.hears(0.0)
        says(page, "input", "Test: left stick")
        shown = "() => document.getElementById('facts').innerText.includes('{}')"
        panel.wait_for_function(shown.format("Test: left stick"))
        # One whose layout the browser does not know is no longer believed.
        page.evaluate("stick.mapping = ''")
        visit.wait(lambda shown: not shown["c"] == shown["c"])
        panel.wait_for_function(shown.format("Test is not understood: push"))
        page.wait_for_function(
            "() => document.getElementById('input').textContent"
            ".startsWith('Test is not understood')"
        )


@pytest.mark.parametrize("how", ["button", "panel key", "participant key"])
def test_the_emergency_stop(chromium: Any, tmp_path: Path, how: str) -> None:
    with at_work(chromium, tmp_path / "v", ["ikns"], repeats=1) as visit:
        panel, page = visit.panel(), visit.participant()
        panel.click("#begin")
        visit.until("align", "track")
        if how == "button":
            panel.click("#emergency")
        else:
            (panel if how == "panel key" else page).keyboard.press("Escape")
        visit.until("stopped")
        says(panel, "state", "STOPPED")
        says(page, "prompt", "Stopped")
        assert panel.is_disabled("#begin")
        (row,) = visit.rows
        assert row["reason"] == "emergency stop"
        panel.click("#end")
        visit.wait(lambda _: visit.conductor.over)


def test_the_arm_does_not_depend_on_a_page(chromium: Any, tmp_path: Path) -> None:
    with at_work(chromium, tmp_path / "v", ["ikns"], repeats=1) as visit:
        panel, page = visit.panel(), visit.participant()
        panel.click("#begin")
        visit.until("align", "track")
        page.close()
        visit.pages.remove(page)
        visit.wait(lambda shown: not shown["page_connected"])
        assert visit.conductor.shown["state"] in ("align", "track")


def test_a_stopped_finger_is_connected_again(chromium: Any, tmp_path: Path) -> None:
    fingers: list[SimulatedFinger] = []
    with at_work(chromium, tmp_path / "v", ["ring"], fingers=fingers) as visit:
        panel = visit.panel()
        visit.participant()
        visit.wait(lambda shown: shown["c"] == 0.0)
        assert panel.is_hidden("#banner")
        panel.wait_for_function("() => !document.getElementById('begin').disabled")
        fingers[-1].make_safe("servo: overheating")
        visit.wait(lambda shown: shown["stopped"] is not None)
        panel.wait_for_selector("#banner", state="visible")
        says(panel, "stopped", "Finger stopped")
        says(panel, "reason", "Servo: overheating.")
        assert "Connect again" in panel.inner_text("#remedy")
        size = "e => parseFloat(getComputedStyle(e).fontSize)"
        assert panel.eval_on_selector("#stopped", size) >= 32
        panel.wait_for_function("() => document.getElementById('begin').disabled")
        # The button is not all: the command is refused as well.
        visit.conductor.submit(Command("begin"))
        visit.wait(lambda shown: "finger stopped" in shown["message"].lower())
        assert visit.conductor.state == "waiting"
        panel.click("#connect")
        panel.wait_for_selector("#banner", state="hidden")
        visit.wait(lambda shown: shown["stopped"] is None and shown["c"] == 0.0)
        assert visit.conductor.shown["message"] == ""  # it no longer holds
        assert fingers[-1].state().mode == "active"
        panel.click("#begin")
        visit.until("ready")


def test_old_values_are_shown_as_unknown(chromium: Any, tmp_path: Path) -> None:
    """First those of a stream that is gone, then all of a visit that hangs."""
    with at_work(chromium, tmp_path / "v", ["ikns"], repeats=1) as visit:
        panel = visit.panel()
        assert panel.is_hidden("#lost")
        pose = {"refused": "", "residual": 0.001, "inside": True}
        arm = visit.source
        for age, told in ((0.1, "valid"), (3.0, "unknown")):
            arm.shown = {"kind": "ikns"} | recent_values((pose, age))
            panel.wait_for_function(
                "told => [...document.querySelectorAll('#facts dt')].some(e =>"
                " e.textContent === 'Pose' && e.nextSibling.textContent === told)",
                arg=told,
            )
            assert ("inside the points" in panel.inner_text("#facts")) == (age < 1)
        arm.shown = {"kind": "ikns", "dof": 2, "session": ""} | recent_values(
            ({"flexion": 0.2, "c_1": 0.3, "flexion_1": 0.4, "measured_1": None}, 0.1)
        )
        panel.wait_for_function(
            "() => document.getElementById('facts').textContent.includes('of finger 1')"
        )
        rows = panel.evaluate(ROWS)
        assert rows[0][0] == "c of finger 2"
        assert [row for row in rows if row[0][-1].isdigit()][1:] == [
            ["Flexion commanded 2", "0.20"],
            ["c of finger 1", "0.30"],
            ["Flexion commanded 1", "0.40"],
            ["Flexion measured 1", "\N{EN DASH}"],
        ]
        for width in (390, 1280, 1920):
            panel.set_viewport_size({"width": width, "height": 800})
            lines = dict(panel.evaluate(LINES))
            # One line each, within the window: "recorded" is one word.
            assert {lines[name] for name in (*dict(rows), "Session")} == {1}, width
            wide = panel.evaluate("document.documentElement.scrollWidth")
            assert wide <= width
        visit.clock.stop.set()
        try:
            says_news = "() => document.getElementById('lost').textContent"
            said = "No update from the program for "
            panel.wait_for_function(f"{says_news}.startsWith('{said}')")
            panel.wait_for_selector("#lost", state="visible")
        finally:
            visit.clock.stop.clear()
        panel.wait_for_selector("#lost", state="hidden")


def test_an_object_by_the_ring_button(chromium: Any, tmp_path: Path) -> None:
    with at_work(chromium, tmp_path / "v", ["ring"], repeats=2) as visit:
        panel, page = visit.panel(), visit.participant()
        visit.wait(lambda shown: shown["c"] == 0.0)
        panel.click("#begin")
        visit.until("ready")
        page.wait_for_function(
            "() => document.getElementById('name').textContent.length > 2"
        )
        page.keyboard.press("Enter")
        visit.until("running")
        visit.let_pass(3.0)
        page.keyboard.press("Space")
        visit.wait(lambda shown: shown["c"] == 1.0)
        visit.wait(lambda shown: (shown["source"].get("measured") or 0) > 0.5)
        page.keyboard.press("Space")
        visit.wait(lambda shown: shown["c"] == 0.0)
        panel.keyboard.press("Space")
        visit.until("judge")
        panel.fill("#text", "a firm grip")
        panel.click("#success")
        visit.until("waiting")
        panel.click("#begin")
        visit.until("ready")
        panel.keyboard.press("Space")
        visit.until("running")
        panel.click("#dropped")
        visit.until("finished")
        first, second = visit.rows
    assert (first["outcome"], first["comment"]) == ("success", "a firm grip")
    assert first["time"] == pytest.approx(3.0, abs=1e-6)
    assert (second["outcome"], second["practised"]) == ("dropped", 1)
