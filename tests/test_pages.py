"""Reports and 3-D views on a phone and on a desk, and what one can drag there.

One browser serves all.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import small_person
import small_visits
from accessible import DESK, PHONE, judge

from ikns.body.chains import chain_joints
from ikns.experiments.study import init_study
from ikns.experiments.study.summary import summarize
from ikns.motion.marker_ik import MarkerIK
from ikns.view.elbow import elbow_widget
from ikns.view.figures import residual_figure
from ikns.view.report import (
    KeyNumber,
    NextStep,
    Picture,
    Section,
    Table,
    report_html,
)
from ikns.view.scene import LiveView, map_scene, recording_scene, scene_html
from ikns.view.scene.playback import kept_frames
from ikns.view.study_report import study_page


@contextmanager
def tab(chromium: Any) -> Iterator[Any]:
    """Open a page; in the end it has complained of nothing."""
    page = chromium.new_page(viewport=DESK)
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    yield page
    page.close()
    assert said == []


@pytest.fixture(scope="module", name="page")
def _page(chromium: Any) -> Iterator[Any]:
    with tab(chromium) as page:
        yield page


@pytest.fixture(scope="module", name="report_page")
def _report_page(
    chromium: Any, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Any]:
    with tab(chromium) as page:
        page.goto(shown(tmp_path_factory.mktemp("report"), report()))
        yield page


def shown(folder: Path, html: str) -> str:
    path = folder / "page.html"
    path.write_text(html, encoding="utf-8")
    return path.as_uri()


def report() -> str:
    """Page of every kind of part."""
    person = small_person.subject()
    steady = residual_figure(np.arange(3.0), np.ones(3), simulated=True)
    table = Table(["a long name of a column"] * 9, [[1.5] * 9], "Wide. Not folded")
    return report_html(
        title="A person",
        lead="All parts of a report.",
        simulated=True,
        facts={"a name": "A value"},
        key_numbers=[KeyNumber("leak", "4 mm", "How far the hand drifts.")],
        sections=[
            Section("The arm", widget=elbow_widget(person)),
            Section(
                "Shown",
                ["A word in `code`."],
                [Picture(steady, "Shown.", "A line")],
                [table],
                [Picture(steady, "Folded.", "A line"), table],
            ),
            Section("Not shown", ["Words."], folded=True),
        ],
        next_steps=[NextStep("ikns control --subject a/very/long/name " * 3, "Go on.")],
    )


@pytest.mark.parametrize(
    "fault",
    [
        "<div style='width: 400px'>wide</div>",
        "<button></button>",
        "<p style='color: #aaa; background: white'>pale</p>",
    ],
)
def test_the_judge_of_pages_finds_a_fault(page: Any, fault: str) -> None:
    page.set_content(f"<html lang='en'><title>t</title><main>{fault}</main></html>")
    with pytest.raises(AssertionError):
        judge(page)


def test_a_report_fits_and_is_accessible(report_page: Any) -> None:
    page = report_page
    page.evaluate("document.querySelectorAll('details').forEach(x => x.open = true)")
    judge(page)
    # What goes on beyond an edge fades there, and nothing else does.
    beyond = set()
    for size in (DESK, PHONE):
        page.set_viewport_size(size)
        found = page.evaluate(
            """async () => {
                const drawn = () => new Promise(requestAnimationFrame);
                await drawn();
                await drawn();
                return [...document.querySelectorAll(".scroll, pre")].map(x => [
                    x.scrollWidth > x.clientWidth,
                    getComputedStyle(x).maskImage !== "none",
                ]);
            }"""
        )
        assert all(more == fades for more, fades in found)
        beyond |= {more for more, _ in found}
    assert beyond == {True, False}
    # Every link of the contents leads to a heading of that name.
    for link in page.locator("nav a").all():
        name = link.get_attribute("href")[1:]
        assert page.inner_text(f"#{name} h2").startswith(link.inner_text())
    # What is folded is in print.
    page.evaluate("document.querySelectorAll('details').forEach(x => x.open = false)")
    assert not page.get_by_text("Words.").is_visible()
    page.emulate_media(media="print")
    assert page.get_by_text("Words.").is_visible()
    page.emulate_media(media="screen")


def test_the_page_of_ten_participants_is_short(page: Any, tmp_path: Path) -> None:
    study = init_study(tmp_path / "study").parent
    html, _ = study_page(summarize(small_visits.small_study(study, people=10)))
    page.goto(shown(tmp_path, html))
    for size in (DESK, PHONE):
        page.set_viewport_size(size)
        assert page.evaluate("document.documentElement.scrollHeight") <= 6000
    judge(page)
    # The first picture is the answers'.
    first = page.locator("img").first
    assert first.evaluate("image => image.closest('section').id") == "answers"


def test_the_dragged_elbow_moves_c_and_the_finger_and_leaves_the_hand(
    report_page: Any,
) -> None:
    """The page's own numbers against the map and the skeleton, in Python.

    The page holds the hand to 1e-11 m; weights between points change by less than 1e-6
    with that. The goal is 1e-6.
    """
    page, person = report_page, small_person.subject()
    body, learned, chain = person.skeleton, person.null_space_map, person.chain
    columns = [body.joint_names.index(joint) for joint in chain_joints(chain)]
    page.set_viewport_size(DESK)
    for point in range(len(learned.centers_)):
        states = page.evaluate(
            """k => {
                elbow.choose(k);
                const last = elbow.state.places - 1;
                return Array.from({ length: 24 }, (_, i) => {
                    elbow.set((last * i) / 23);
                    return { ...elbow.state };
                });
            }""",
            point,
        )
        q = np.zeros((len(states), 18))
        q[:, columns] = [state["q"] for state in states]
        places, turns = (found[:, 0] for found in body.hands_in_thorax(q))
        np.testing.assert_allclose(
            places, [state["hand"] for state in states], atol=1e-9
        )
        # The hand stays, and the elbow does not.
        np.testing.assert_allclose(places - places[0], 0, atol=1e-9)
        np.testing.assert_allclose(turns - turns[0], 0, atol=1e-9)
        elbows = body.link_in_thorax(q, "right_forearm")[0]
        assert np.linalg.norm(elbows[-1] - elbows[0]) > 0.05
        c = np.array([state["c"] for state in states])
        wanted = learned.control_signal(q[:, columns], places)
        np.testing.assert_allclose(c, wanted, atol=1e-6, rtol=0)
        flexion = [state["flexion"] for state in states]
        np.testing.assert_array_equal(flexion, np.clip(c, 0, 1))

    # With the mouse: elbow and finger move, the hand is drawn where it was.
    page.select_option("#elbow-point", "0")
    drawn = """['hand', 'finger', 'fore'].map(
        x => document.getElementById(`elbow-${x}`).getAttribute('d'))"""
    page.locator("#elbow-arm").scroll_into_view_if_needed()
    hand, finger, fore = page.evaluate(drawn)
    grip = page.locator("#elbow-grip .dot").bounding_box()
    x, y = grip["x"] + grip["width"] / 2, grip["y"] + grip["height"] / 2
    before = page.evaluate("elbow.state.c")
    page.mouse.move(x, y)
    page.mouse.down()
    # The far end of the dotted line.
    end = page.evaluate(
        """() => {
            const way = document.getElementById("elbow-way");
            const { x, y } = way.getPointAtLength(way.getTotalLength())
                .matrixTransform(way.getScreenCTM());
            return [x, y];
        }"""
    )
    page.mouse.move(*end)
    page.mouse.up()
    assert abs(page.evaluate("elbow.state.c") - before) > 0.1
    after = page.evaluate(drawn)
    assert after[0] == hand
    assert after[1] != finger
    assert after[2] != fore
    # And with the keyboard.
    page.focus("#elbow-place")
    place = page.evaluate("elbow.state.c")
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("elbow.state.c") != place


def test_the_3d_pages_fit_and_curves_seek(page: Any, tmp_path: Path) -> None:
    person = small_person.subject()
    body, learned, chain = person.skeleton, person.null_space_map, person.chain
    recording = small_person.cut(small_person.protocol().points.recording, 0, 60)
    motion = MarkerIK(body).track(recording)
    scene = recording_scene(body, learned, chain, motion, recording, simulated=True)
    page.set_viewport_size(DESK)
    page.goto(shown(tmp_path, scene_html(scene)))
    # A quarter of the way along a curve is a quarter of the time.
    for curve in ("#c_curve", "#speed_curve"):
        box = page.locator(curve).bounding_box()
        for share in (0.25, 0.75):
            page.mouse.click(box["x"] + share * box["width"], box["y"] + 9)
            time = page.evaluate("viewer.animator.time")
            # A click is at a whole pixel.
            assert time == pytest.approx(
                share * scene.times[-1], abs=scene.times[-1] / box["width"]
            )
    # What is told at a frame is the motion's.
    speed = motion.hand_speed(chain)[kept_frames(motion.time)]
    frame = int(np.nanargmax(speed))
    page.evaluate("time => seek(time)", float(scene.times[frame]))
    told = f"{speed[frame]:.2f} m/s"
    page.wait_for_function(
        "told => document.getElementById('speed').textContent === told", arg=told
    )
    # The keyboard turns the view about its target, by 0.1 rad.
    way = "viewer.camera.position.clone().sub(viewer.controls.target).toArray()"
    before = np.array(page.evaluate(way))
    page.focus("#pane")
    page.keyboard.press("ArrowLeft")
    after = np.array(page.evaluate(way))
    angles = [np.arctan2(x, z) for x, _, z in (before, after)]
    assert angles[1] - angles[0] == pytest.approx(-0.1, abs=1e-9)
    assert np.linalg.norm(after) == pytest.approx(np.linalg.norm(before), rel=1e-9)
    # Nothing of MeshCat's own panel, and the legend is beside the body.
    assert not page.locator(".dg.main").first.is_visible()
    pane, legend = (
        page.locator(name).bounding_box() for name in ("#pane canvas", "#legend")
    )
    assert legend["x"] + legend["width"] <= pane["x"]
    judge(page)
    # On the phone every label is in sight; half a word takes 0.06 of half the width.
    labels = page.evaluate(
        """() => {
            const places = [], place = viewer.camera.position.clone();
            viewer.scene.updateMatrixWorld();
            viewer.scene.traverse(x => {
                if (x.isSprite)
                    places.push(place.setFromMatrixPosition(x.matrixWorld).project(viewer.camera).x);
            });
            return places;
        }"""
    )
    assert len(labels) > 3
    assert max(map(abs, labels)) < 0.94
    with LiveView(map_scene(body, learned, chain, simulated=True), body) as live:
        page.goto(live.url)
        live.show(body.neutral(), time=1.0, c=0.5)
        page.wait_for_function(
            "document.getElementById('c').textContent === 'c = 0.50'"
        )
        judge(page)
        page.goto("about:blank")
