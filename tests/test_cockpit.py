"""A visit in a real browser: Chromium plays trials, and what it did is on disk.

Headless Chromium draws in software, and the machine may be busy: nothing here depends
on how often a page draws, only on what it sends, 60 times a second.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from threading import Event, Thread
from typing import Any

import numpy as np
import pytest

from ikns.experiments.cockpit import Cockpit
from ikns.experiments.conduct import (
    Conductor,
    HeldInput,
    PickingExperiment,
    TrackingExperiment,
    VisitLog,
    run_visit,
)
from ikns.experiments.conduct.ring import ring_driver
from ikns.experiments.picking import pick_schedule
from ikns.experiments.tracking import measure, schedule
from ikns.experiments.visits import read_visit, tracking_record
from ikns.finger import Safety, SimulatedFinger
from ikns.view.scene.browser import HOW_TO_GET_ONE, browser_options, find_browser

PAGES = ("gamepad", "keyboard", "mouse")
#: A gamepad as browsers give it; the test moves its stick.
GAMEPAD = """
    window.stick = { axes: [0, 0, 0, 0], pressed: false, there: true };
    const button = () => ({ pressed: false, touched: false, value: 0 });
    navigator.getGamepads = () => {
        if (!stick.there) return [null, null, null, null];
        const buttons = Array.from({ length: 17 }, button);
        buttons[0] = { pressed: stick.pressed, touched: stick.pressed, value: 1 };
        return [null, { id: "Test", index: 1, connected: true, mapping: "standard",
            axes: stick.axes, buttons, timestamp: performance.now() }, null, null];
    };
"""
#: Ends of a stick's way that follow the line: c is minus the second axis.
FOLLOW = """({ seconds, list }) => {
    const began = performance.now(), last = list.length - 1;
    setInterval(() => {
        const share = (performance.now() - began) / 1000 / seconds;
        stick.axes[1] = -list[Math.min(last, Math.round(share * last))] / 100;
    }, 10);
}"""


@dataclass
class Served:
    """A visit that is served, and pages that look at it."""

    conductor: Conductor
    cockpit: Cockpit
    chromium: Any
    complaints: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)
    pages: list[Any] = field(default_factory=list)

    def open(self, address: str, *, script: str = "") -> Any:
        page = self.chromium.new_page(viewport={"width": 640, "height": 400})
        self.pages.append(page)
        if script:
            page.add_init_script(script)
        page.on("console", lambda said: self.complaints.append(said.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("requestfailed", lambda r: self.complaints.append(r.url))
        page.on("request", lambda request: self.asked.append(request.url))
        page.goto(address)
        return page

    def participant(self, *, script: str = "") -> Any:
        page = self.open(self.cockpit.url, script=script)
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

    def wait(self, what: Any, seconds: float = 20.0) -> None:
        """Wait until something holds of what is shown."""
        end = time.monotonic() + seconds
        while not what(self.conductor.shown):
            shown = self.conductor.shown
            assert time.monotonic() < end, (shown["fault"], shown["message"], shown)
            # Playwright's own events are handled meanwhile.
            self.pages[-1].wait_for_timeout(10)

    def until(self, *states: str, seconds: float = 20.0) -> None:
        self.wait(lambda shown: shown.get("state") in states, seconds)

    @property
    def rows(self) -> list[dict[str, Any]]:
        return read_visit(self.conductor.log.folder).attempts


def says(page: Any, id: str, text: str) -> None:
    """Wait until a page shows a text."""
    page.wait_for_function(
        "([id, text]) => document.getElementById(id).textContent === text",
        arg=[id, text],
    )


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    browser = find_browser()
    if browser is None:
        pytest.skip(HOW_TO_GET_ONE)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        chromium = driver.chromium.launch(
            executable_path=browser, args=browser_options()
        )
        yield chromium
        chromium.close()


@contextmanager
def at_work(
    chromium: Any, folder: Path, conditions: list[str], **design: Any
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
    held = {name: HeldInput() for name in conditions if name in PAGES}
    arm = HeldInput(timeout=3600.0)  # an arm that is held still
    arm.put(time.monotonic(), 0.5)
    presses: SimpleQueue[None] = SimpleQueue()
    drivers: Any = {
        name: lambda one=one: nullcontext(one) for name, one in held.items()
    }
    drivers["ikns"] = lambda: nullcontext(arm)
    # A busy machine may keep anything waiting.
    finger = SimulatedFinger(safety=Safety(command_timeout=10.0))
    drivers["ring"] = lambda: ring_driver(presses, lambda: finger)
    stop = Event()
    with Cockpit(conductor, held, on_press=lambda: presses.put(None)) as cockpit:
        thread = Thread(
            target=run_visit, args=(conductor, drivers), kwargs={"stop": stop}
        )
        thread.start()
        made = Served(conductor, cockpit, chromium)
        try:
            yield made
            assert made.complaints == []
            # Nothing came from anywhere else.
            home = cockpit.url
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
        visit.wait(lambda shown: shown["c"] == 0.25)
        page.evaluate("stick.pressed = true")
        visit.until("align")
        page.evaluate("stick.pressed = false")
        began = visit.conductor.experiment.trial()[1]  # type: ignore[attr-defined]
        heights = visit.conductor.curve["heights"]
        page.evaluate(f"stick.axes[1] = {-heights[0] / 100}")
        visit.until("track")
        late = time.monotonic() - began
        page.evaluate(FOLLOW, {"seconds": 25.0, "list": heights})
        visit.until("finished", seconds=40.0)
        says(page, "prompt", "That was all. Thank you!")
        (row,) = visit.rows
    assert row["outcome"] == "done"
    record = tracking_record(row)
    assert (record.time[0] < -4.9, record.time[-1] > 24.9) == (True, True)
    # A hundred times a second; a busy machine leaves some out, but a curve that turns
    # within a second or two needs ten.
    assert len(record.time) > 300
    known = record.time[np.isfinite(record.c)]
    gap = np.diff(known, append=25.0)[known > -4.0].max()
    assert gap < 5.0
    figures = measure(record)
    # The stick follows as late as this test began it, by the page's 10 ms, the
    # server's 10 ms and steps of 0.04 s, and stands still where nothing comes. Such a
    # curve goes at most at 20 per second.
    assert figures.rmse < 20 * (late + 0.1 + gap)
    assert figures.correlation > 0.95
    assert -0.05 < figures.lag < late + 0.1 + gap
    told = visit.conductor.results[-1]
    assert told["rmse"] == figures.rmse


def test_a_trial_with_the_keyboard_and_the_panel(chromium: Any, tmp_path: Path) -> None:
    with at_work(
        chromium, tmp_path / "v", ["keyboard"], repeats=1, seconds=12.0
    ) as visit:
        panel, page = visit.panel(), visit.participant()
        assert panel.inner_text("#state") == "Waiting"
        assert panel.is_disabled("#abort")
        page.keyboard.down("ArrowUp")
        visit.wait(lambda shown: (shown["c"] or 0) > 0.3)
        page.keyboard.up("ArrowUp")
        panel.click("#begin")
        visit.until("track")
        says(panel, "state", "Tracking")
        high = visit.conductor.shown["c"]
        page.keyboard.down("KeyS")
        visit.wait(lambda shown: (shown["c"] or 0) < high - 0.2)
        page.keyboard.up("KeyS")
        # 0.5 per second, whatever the page draws.
        low = visit.conductor.shown["c"]
        visit.until("finished", seconds=30.0)
        panel.wait_for_function(
            "() => document.querySelectorAll('#attempts tr').length === 1"
        )
        (row,) = visit.rows
        shown = panel.inner_text("#attempts")
    assert row["outcome"] == "done"
    record = tracking_record(row)
    assert f"{measure(record).rmse:.2f}" in shown
    c = record.c[np.isfinite(record.c)]
    assert c.max() <= high + 1e-12
    assert c.min() <= low + 1e-12
    # The ramp goes at 0.5 per second: between two messages in a row hardly more.
    falling = np.flatnonzero(np.diff(record.c) < 0)
    duration = record.time[falling[-1] + 1] - record.time[falling[0]]
    assert 0.5 * duration == pytest.approx(c.max() - c.min(), abs=0.1)


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


def test_an_unplugged_gamepad_gives_no_signal(chromium: Any, tmp_path: Path) -> None:
    with at_work(chromium, tmp_path / "v", ["gamepad"], repeats=1) as visit:
        page = visit.participant(script=GAMEPAD)
        visit.wait(lambda shown: shown["c"] == 0.0)
        page.evaluate("stick.there = false")
        visit.wait(lambda shown: not shown["c"] == shown["c"])
        says(page, "input", "No gamepad yet: press one of its buttons")
        time.sleep(1.1)  # a signal that came within a second would do
        page.keyboard.press("Space")
        visit.wait(lambda shown: "button of the gamepad" in shown["message"])
        assert visit.conductor.shown["state"] == "waiting"


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
    assert 0 < first["time"] < 20
    assert (second["outcome"], second["practised"]) == ("dropped", 1)
