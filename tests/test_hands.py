"""The participant's gamepad: asked what it is, never trusted by its place in a list."""

import json
import shutil
import subprocess
from base64 import b64encode
from collections.abc import Callable, Iterator
from importlib.resources import files
from typing import Any

import pytest

from ikns.view.scene.picture import HOW_TO_GET_ONE, browser_options, find_browser

#: What every script has: `pads` is what the browser hands out; `at` reads a control
#: signal after a change; `pad` and `odd` make gamepads.
BEFORE = """
globalThis.pads = [];
const { Hands } = await import("data:text/javascript;base64,@");
let begun = 0;
const hands = new Hands({ share: () => 0 }, { onBegin() { begun += 1; }, onPress() {}, onStop() {} });
const buttons = (n, on = {}) => [...Array(n)].map((_, k) => ({ pressed: Boolean(on[k]), value: on[k] ?? 0 }));
const pad = (id, axes, on = {}, mapping = "standard") =>
  ({ id: `${id} (Vendor: 1)`, index: 0, connected: true, mapping, axes, buttons: buttons(17, on) });
const odd = (id, axes, on = {}) => ({ ...pad(id, axes, on, ""), buttons: buttons(11, on) });
const at = (list, times = 1) => {
  pads = list.map((one, index) => one && { ...one, index });
  let c = null;
  for (let k = 0; k < times; k += 1) c = hands.c("gamepad");
  return c;
};
// Axis 2 of six.
const axis = (value, on) => odd("Strange", [0, 0, value, 0, 0.1, -1], on);
const sweep = (...values) => values.map((value) => at([axis(value)]));
"""  # noqa: E501
NODE = """
globalThis.window = { addEventListener() {} };
globalThis.document = { addEventListener() {} };
Object.defineProperty(globalThis, "navigator", {
  value: { getGamepads: () => globalThis.pads }, configurable: true, writable: true });
"""

Play = Callable[[str], Any]


@pytest.fixture(scope="module")
def play() -> Iterator[Play]:
    """Run the body of a function in a browser, or in node without one."""
    source = files("ikns.experiments.cockpit").joinpath("hands.js").read_bytes()
    before = BEFORE.replace("@", b64encode(source).decode())
    browser, node = find_browser(), shutil.which("node")
    if browser is not None:
        from playwright.sync_api import sync_playwright

        with sync_playwright() as driver:
            chromium = driver.chromium.launch(
                executable_path=browser, args=browser_options()
            )
            page = chromium.new_page()
            page.evaluate("navigator.getGamepads = () => globalThis.pads")
            yield lambda script: page.evaluate(f"async () => {{ {before} {script} }}")
            chromium.close()
    elif node is not None:

        def in_node(script: str) -> Any:
            whole = f"const run = async () => {{ {before} {script} }};"
            whole += "console.log(JSON.stringify(await run()));"
            done = subprocess.run(
                [node, "--input-type=module", "-e", NODE + whole],
                capture_output=True,
                text=True,
                check=True,
            )
            return json.loads(done.stdout)

        yield in_node
    else:
        pytest.skip(HOW_TO_GET_ONE)


@pytest.mark.parametrize(
    ("stick", "axes", "on", "c"),
    [
        ("left", [0.4, -0.75, 0, 0], {}, 0.75),
        ("left", [0, 0.5, 0, -1], {}, 0.0),  # down, and another stick up
        ("left", [0, -1.02, 0, 0], {7: 1.0}, 1.0),
        ("trigger", [0, -1, 0, 0], {7: 0.25}, 0.25),
        ("trigger", [0, -1, 0, 0], {6: 1.0}, 0.0),
    ],
)
def test_a_standard_gamepad_is_read(
    play: Play, stick: str, axes: list[float], on: dict[int, float], c: float
) -> None:
    found = play(
        f'hands.stick = "{stick}";'
        f'const c = at([pad("One", {axes}, {json.dumps(on)})]);'
        "return [c, hands.gamepad];"
    )
    name = {"left": "left stick", "trigger": "right trigger"}[stick]
    assert found == [c, f"One: {name}"]


def test_no_button_of_another_mapping_is_trusted(play: Play) -> None:
    for stick in ("left", "trigger"):
        readings, text, begun = play(
            f'hands.stick = "{stick}"; const found = [];'
            "for (let k = 0; k < 11; k += 1)"
            "  found.push(at([axis(-1, { [k]: 1 })], 20), at([axis(-1)], 20));"
            "return [found, hands.gamepad, begun];"
        )
        assert readings == [None] * 22
        assert text.startswith("Strange is not understood: push the control")
        assert begun == 0


def test_an_axis_is_chosen_by_moving_it_and_its_ends_are_those_seen(play: Play) -> None:
    found = play(
        "const before = sweep(-0.9, -0.8, 0, 0.6, 0.8, 0.1, -0.6, -0.9);"
        "const text = hands.gamepad;"
        "const after = sweep(-0.9, -0.05, 0.8, 1, 0.05);"
        "return [before, text, after, at([axis(-0.9, { 7: 1, 0: 1 })]), begun];"
    )
    before, text, after, pressed, begun = found
    assert before[:-1] == [None] * 7
    assert text == "Strange: axis 2 from -0.90 to 0.80 (C chooses another)"
    # Linear between the ends; 1 was farther than what was seen before.
    assert after == pytest.approx([0, 0.5, 1, 1, 0.5], abs=1e-12)
    assert pressed == pytest.approx(0, abs=1e-12)
    assert begun == 0


def test_a_held_control_is_not_its_own_rest(play: Play) -> None:
    # Pressed and held for seconds: where it rests is known only once it is let go.
    held, let_go, half = play(
        "sweep(-1, -0.3, 0.5, 1); const held = at([axis(1)], 200);"
        "sweep(0.2, -0.7); const on = at([axis(-1)], 30);"
        "return [held, on, at([axis(0)])];"
    )
    assert held is None
    assert (let_go, half) == pytest.approx((0, 0.5), abs=1e-12)


def test_a_trigger_that_is_0_until_first_moved(play: Play) -> None:
    # Then it jumps to where it is, and rises through 0 on its way.
    rising, rest, readings = play(
        "at([axis(0)], 100); const rising = sweep(-0.98, -0.5, 0, 0.5, 1, 0.1, -0.9);"
        "const rest = at([axis(-1)], 30);"
        "return [rising, rest, sweep(1, 0, -1)];"
    )
    assert rising == [None] * 7
    assert rest == pytest.approx(0, abs=1e-12)
    assert readings == pytest.approx([1, 0.5, 0], abs=1e-12)


def test_a_stick_of_another_mapping_rests_in_its_middle(play: Play) -> None:
    sweep, rest, readings = play(
        "const found = sweep(0.01, -0.5, -1, -0.4); const rest = at([axis(0.01)], 30);"
        "return [found, rest, sweep(-0.4, -1, 1)];"
    )
    assert sweep == [None] * 4
    assert rest == pytest.approx(0, abs=1e-12)
    assert readings == pytest.approx([0.41 / 1.01, 1, 0], abs=1e-12)


def test_trembling_chooses_no_axis(play: Play) -> None:
    assert play(
        "const found = [];"
        "for (let k = 0; k < 300; k += 1) found.push(at([axis(0.25 * Math.sin(k))]));"
        "return found.every((c) => c === null);"
    )


def test_a_chosen_axis_can_be_chosen_anew(play: Play) -> None:
    text, again = play(
        "const other = (value) => at([odd('Strange', [0, value, -1, 0, 0.1, -1])]);"
        "sweep(-1, 0, 1, 0, -1); hands.pads.forget(); other(-1);"
        "const text = hands.gamepad;"
        "[-1, 0, 1, 0, -1].forEach(other);"
        "return [text, [other(1), hands.gamepad]];"
    )
    assert "not understood" in text
    assert again == [1, "Strange: axis 1 from -1.00 to 1.00 (C chooses another)"]


@pytest.mark.parametrize(
    "other",
    [
        "pad('Keys', [])",
        "odd('Keys', [])",
        "{ ...odd('Motion', [0, -1, 1]), buttons: [] }",
        "{ ...pad('Gone', [0, 0]), connected: false }",
        "null",
    ],
)
def test_what_is_no_gamepad_is_skipped(play: Play, other: str) -> None:
    found = play(
        f"const c = [at([{other}]), at([{other}, pad('One', [0, 0, 0, 0])]),"
        f"  at([{other}, pad('One', [0, -0.5, 0, 0])])]; return [c, hands.gamepad];"
    )
    assert found == [[None, 0, 0.5], "One: left stick"]


def test_the_gamepad_whose_control_moved_last_is_read(play: Play) -> None:
    script = """
        const two = (a, b, on = {}) => at([pad("A", [0, a]), pad("B", [0, b], on)]);
        const said = [];
        const step = (...given) => said.push([two(...given), hands.gamepad]);
        step(0, 0.02); step(0, -0.6); step(-0.05, -0.6); step(-0.9, -0.6);
        step(-0.9, -0.61); step(-0.9, -0.61, { 3: 1 }); step(-0.9, -0.61);
        return said;
    """
    assert play(script) == [
        [None, "Move the control of the gamepad to use"],
        [0.6, "B: left stick"],
        [0.6, "B: left stick"],  # A trembles
        [0.9, "A: left stick"],
        [0.9, "A: left stick"],  # B trembles
        [0.61, "B: left stick"],  # a button of B
        [0.61, "B: left stick"],
    ]


def test_slow_motion_counts_as_motion(play: Play) -> None:
    found = play(
        "const two = (a, b) => at([pad('A', [0, a]), pad('B', [0, b])]); two(-1, 0);"
        "for (let k = 0; k <= 40; k += 1) two(-1, -k / 100); return hands.gamepad;"
    )
    assert found == "B: left stick"


def test_a_gamepad_that_vanishes_gives_nothing_and_none_takes_its_place(
    play: Play,
) -> None:
    script = """
        const both = [pad("A", [0, -0.7]), pad("B", [0, 0])];
        const found = [at(both), at([null, both[1]], 100), hands.gamepad];
        found.push(at([both[0], both[1]]), at([null, pad("B", [0, -0.4])]), at([]));
        return [...found, hands.gamepad];
    """
    assert play(script) == [
        0.7,
        None,
        "Move the control of the gamepad to use",
        0.7,  # back, and its control is not at rest
        0.4,
        None,
        "No gamepad yet: press one of its buttons",
    ]


def test_a_gamepad_without_the_control_is_named(play: Play) -> None:
    found = play(
        "const few = { ...pad('Few', [0, -1]), buttons: buttons(4) };"
        "hands.stick = 'trigger'; const c = at([few]); return [c, hands.gamepad];"
    )
    assert found == [None, "Few has no right trigger"]
    assert play(
        "return [at([pad('Bad', [0, NaN])]), at([pad('Bad', [0, -0.5])])];"
    ) == [None, 0.5]


def test_the_first_button_begins_once(play: Play) -> None:
    assert play(
        "const press = (on) => at([pad('A', [0, 0]), pad('B', [0, 0], on)]);"
        "press({}); press({ 0: 1 }); press({ 0: 1 }); press({}); press({ 0: 1 });"
        "return [begun, hands.gamepad];"
    ) == [2, "B: left stick"]


def test_a_page_without_gamepads_says_so(play: Play) -> None:
    # Browsers hand out none to a page from another machine without encryption.
    found = play(
        "const get = navigator.getGamepads; navigator.getGamepads = undefined;"
        "const found = [hands.c('gamepad'), hands.gamepad, hands.c('keyboard')];"
        "navigator.getGamepads = get; return found;"
    )
    assert found[0] is None
    assert "open the page on this machine itself" in found[1]
    assert found[2] == 0
