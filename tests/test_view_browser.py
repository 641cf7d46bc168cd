"""The pages in a real browser: the scene is there, the slider moves it, no errors.

Headless Chromium draws in software. Places are read from three.js itself; it blends
between frames in double precision what a page stores as float32: 1e-6 m.
"""

import io
import re
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
import small_person

from ikns.motion.marker_ik import MarkerIK
from ikns.view.scene import (
    LiveView,
    Scene,
    map_scene,
    recording_scene,
    scene_html,
)
from ikns.view.scene.body import drawn_links
from ikns.view.scene.picture import (
    HOW_TO_GET_ONE,
    find_browser,
    screenshot,
)
from ikns.view.scene.playback import kept_frames

CHAIN = "right_arm"
#: Place of a node in the scene, which is that of the thorax.
PLACE = """path => {
    const node = viewer.scene_tree.find(path).object;
    viewer.scene.updateMatrixWorld(true);
    return Array.from(node.matrixWorld.elements).slice(12, 15);
}"""
SLIDE = """time => {
    const slider = document.getElementById("time");
    slider.value = time;
    slider.dispatchEvent(new Event("input"));
}"""


@dataclass
class Tab:
    """A page and whatever it complained of."""

    page: Any
    complaints: list[str] = field(default_factory=list)

    def show(self, address: str) -> None:
        self.complaints.clear()
        self.page.goto(address)
        self.page.wait_for_function("() => window.viewer || viewer")
        self.settle()

    def settle(self) -> None:
        """Wait until the page has drawn what it knows."""
        self.page.wait_for_function("() => !viewer.needs_render")

    def place(self, *path: str) -> np.ndarray:
        return np.array(self.page.evaluate(PLACE, ["ikns", *path]))

    def pixels(self) -> np.ndarray:
        self.settle()
        return matplotlib.image.imread(io.BytesIO(self.page.screenshot()))[..., :3]


@pytest.fixture(scope="module", name="tab")
def _tab(chromium: Any) -> Tab:
    page = chromium.new_page(viewport={"width": 400, "height": 300})
    tab = Tab(page)
    page.on(
        "console",
        lambda said: said.type == "error" and tab.complaints.append(said.text),
    )
    page.on("pageerror", lambda error: tab.complaints.append(str(error)))
    page.on("requestfailed", lambda asked: tab.complaints.append(asked.url))
    return tab


@cache
def mapped() -> Scene:
    person = small_person.subject()
    return map_scene(person.skeleton, person.null_space_map, CHAIN, simulated=True)


def address(scene: Scene, folder: Path) -> str:
    path = folder / "view.html"
    path.write_text(scene_html(scene), encoding="utf-8")
    return path.as_uri()


def colors(image: np.ndarray) -> int:
    rows = np.round(255 * image.reshape(-1, 3)).astype(int)
    return len(np.unique(rows, axis=0))


def test_the_map_is_there_and_slider_and_legend_change_it(
    tab: Tab, tmp_path: Path
) -> None:
    tab.show(address(mapped(), tmp_path))
    assert tab.page.title() == "Null-space map (simulated)"
    # Every node that is drawn is in the tree of three.js, with a mesh or a text.
    drawn = [c["path"] for c in mapped().commands if c["type"] == "set_object"]
    kinds = tab.page.evaluate(
        """paths => paths.map(path => viewer.scene_tree.find(
            path.split("/").slice(1).concat(["<object>"])).object.type)""",
        drawn,
    )
    assert set(kinds) == {"Mesh", "Sprite"}
    centers = small_person.subject().null_space_map.centers_
    for k, center in enumerate(centers):
        np.testing.assert_allclose(tab.place("points", str(k + 1)), center, atol=1e-6)
    image = tab.pixels()
    assert colors(image[50:250, 100:300]) > 200  # a blank one has a gradient's 30

    before = tab.place("body", "right_forearm")
    hand = tab.place("body", "right_hand")
    tab.page.evaluate(SLIDE, 0)
    at_zero = tab.pixels()
    np.testing.assert_allclose(tab.place("body", "right_hand"), hand, atol=1e-6)
    assert np.linalg.norm(tab.place("body", "right_forearm") - before) > 0.02
    # The sky does not change, the elbow does.
    changed = np.any(np.abs(at_zero - image) > 0.1, axis=2)
    assert changed[50:250].sum() > 50
    assert tab.page.inner_text("#c") == f"c = {mapped().c[0]:.2f}"

    # The legend, closed in a small window, switches things off.
    assert not tab.page.get_by_label("interpolation volume").is_visible()
    tab.page.click("#legend summary")
    at_zero = tab.pixels()
    tab.page.get_by_label("interpolation volume").uncheck()
    assert np.any(np.abs(at_zero - tab.pixels()) > 0.02, axis=2).sum() > 500
    visible = 'viewer.scene_tree.find(["ikns", "volume"]).object.visible'
    assert tab.page.evaluate(visible) is False
    assert tab.complaints == []


def test_a_recording_plays_with_our_controls_and_with_meshcats(
    tab: Tab, tmp_path: Path
) -> None:
    person, body = small_person.subject(), small_person.subject().skeleton
    recording = small_person.cut(small_person.protocol().points.recording, 0, 60)
    motion = MarkerIK(body).track(recording)
    scene = recording_scene(
        body, person.null_space_map, CHAIN, motion, recording, simulated=True
    )
    tab.show(address(scene, tmp_path))
    kept = kept_frames(motion.time)
    for frame in (0, len(kept) // 2, len(kept) - 1):
        tab.page.evaluate(SLIDE, float(scene.times[frame]))
        for link in drawn_links(body):
            place = body.link_in_thorax(motion.q[kept[frame]], link)[0]
            np.testing.assert_allclose(tab.place("body", link), place, atol=1e-6)
    # MeshCat's own slider, in the panel that it brings.
    tab.page.evaluate("viewer.animator.time_scrubber.setValue(0)")
    first = body.link_in_thorax(motion.q[kept[0]], "right_hand")[0]
    np.testing.assert_allclose(tab.place("body", "right_hand"), first, atol=1e-6)
    # Playing moves time on; pressing again stops it.
    tab.page.click("#play")
    tab.page.wait_for_function("() => viewer.animator.time > 0.05")
    tab.page.click("#play")
    assert tab.page.evaluate("viewer.animator.playing") is False
    assert tab.complaints == []


def test_c_leaves_the_picture_where_it_is_far_beyond_its_range(
    tab: Tab, tmp_path: Path
) -> None:
    person, body = small_person.subject(), small_person.subject().skeleton
    recording = small_person.cut(small_person.protocol().points.recording, 0, 60)
    motion = MarkerIK(body).track(recording)
    scene = recording_scene(
        body,
        person.null_space_map,
        CHAIN,
        motion,
        recording,
        c=np.linspace(-1, 2, len(motion.time)),
        simulated=True,
    )
    tab.show(address(scene, tmp_path))
    drawn = "document.querySelector('#c_curve path').getAttribute('d')"
    points = re.split("[ML]", tab.page.evaluate(drawn))[1:]
    heights = [float(point.split()[1]) for point in points]
    # 0 is at 100 and 1 at 0; the picture ends at -15 and 115, the line does not.
    assert heights[0] == 200
    assert heights[-1] < -90
    hidden = "getComputedStyle(document.querySelector('#c_curve svg')).overflow"
    assert tab.page.evaluate(hidden) == "hidden"
    assert "before clipping" in tab.page.inner_text("#player .name")


def test_a_live_view_follows_the_postures(tab: Tab) -> None:
    body = small_person.subject().skeleton
    rng = np.random.default_rng(1)
    with LiveView(mapped(), body) as live:
        tab.show(live.url)
        for k in range(3):
            q = rng.uniform(body.lower, body.upper)
            live.show(q, time=float(k), c=0.5)
            tab.page.wait_for_function(
                "clock => document.getElementById('clock').textContent === clock",
                arg=f"{k}.00 s",
            )
            place = body.link_in_thorax(q, "right_hand")[0]
            # Six digits are sent.
            np.testing.assert_allclose(
                tab.place("body", "right_hand"), place, atol=1e-6
            )
        assert tab.page.inner_text("#c") == "c = 0.50"
        assert tab.complaints == []
        tab.page.goto("about:blank")


@pytest.mark.parametrize("width", [390, 1280])
def test_the_live_view_of_several_signals_has_a_bar_for_each(
    tab: Tab, width: int
) -> None:
    body, names = small_person.subject().skeleton, ("c_1", "c_2")
    tab.page.set_viewport_size({"width": width, "height": 600})
    with LiveView(replace(mapped(), signals=names, c=np.zeros((2, 2)),
                          times=np.arange(2.0)), body) as live:  # fmt: skip
        tab.show(live.url)
        live.show(body.neutral(), time=1.0, c=[0.25, np.nan])
        tab.page.wait_for_function(
            "() => document.getElementById('clock').textContent === '1.00 s'"
        )
        said = [tab.page.inner_text(f"#{name}") for name in names]
        assert said == ["c_1 = 0.25", "c_2 unknown"]
        full = [tab.page.locator(f"#{name}_gauge").bounding_box() for name in names]
        bars = [tab.page.locator(f"#{name}_gauge i").bounding_box() for name in names]
        # A browser lays out in 64ths of a pixel.
        assert bars[0]["width"] == pytest.approx(full[0]["width"] / 4, abs=1 / 32)
        assert bars[1] is None or bars[1]["width"] == 0
        # Nothing is beyond the edge, and nothing covers anything else.
        boxes = full + [
            tab.page.locator(f"#{name}").bounding_box() for name in (*names, "clock")
        ]
        assert all(0 <= b["x"] and b["x"] + b["width"] <= width for b in boxes)
        for k, one in enumerate(boxes):
            for other in boxes[k + 1 :]:
                assert (
                    one["x"] + one["width"] <= other["x"]
                    or other["x"] + other["width"] <= one["x"]
                    or one["y"] + one["height"] <= other["y"]
                    or other["y"] + other["height"] <= one["y"]
                )
        assert tab.complaints == []
        tab.page.goto("about:blank")


def test_the_browser_takes_the_picture() -> None:
    browser = find_browser()
    if browser is None:
        pytest.skip(HOW_TO_GET_ONE)
    taken = screenshot(browser, scene_html(mapped()), width=600, height=450, scale=1.0)
    assert taken is not None
    image = matplotlib.image.imread(io.BytesIO(taken))[..., :3]
    assert image.shape[:2] == (450, 600)
    assert colors(image[150:400, 260:560]) > 500
