"""The report is whole, safe, self-contained and the same for the same input."""

import base64
import re
from functools import cache
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure

from ikns.errors import FileError, InvalidInput
from ikns.view.directions import principal_angle_figure
from ikns.view.parts import KeyNumber, NextStep, Picture, Section, Table
from ikns.view.render import svg
from ikns.view.report import report_html, write_report
from ikns.view.residuals import residual_figure
from ikns.view.signals import control_figure, swivel_figure
from ikns.view.workspace import workspace_figure

VOID = {"meta", "img"}


class Reader(HTMLParser):
    """Notes what a browser would see; fails on tags that do not close in order."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.feed(page)
        self.close()
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)

    def tags(self, name: str) -> list[dict[str, str | None]]:
        return [attrs for tag, attrs in self.seen if tag == name]


def small_figure() -> Figure:
    return principal_angle_figure({"pose": [0.1, 0.2]}, simulated=True)


def spatial_figure() -> Figure:
    corners = np.eye(4, 3)
    return workspace_figure(corners, corners, [0, 1, 2, 3], corners, simulated=True)


def page(**changes: object) -> str:
    parts = {
        "title": "Calibration of one arm",
        "lead": "Everything worked.",
        "simulated": True,
        "facts": {"Side": "right", "Seed": 1, "Stature (m)": 1.7},
        "key_numbers": [KeyNumber("Leak", "4 mm", "How far the hand drifts.")],
        "sections": [
            Section(
                "What was learned",
                text=["In `map.json`."],
                pictures=[
                    Picture(
                        small_figure(), "Closer to 0 is better.", "Dots at 6 and 11"
                    ),
                    Picture(spatial_figure(), "The volume.", "A box of eight points"),
                ],
                tables=[
                    Table(
                        ["point", "r"], [[1, 0.98765], [2, float("nan")]], "Per point"
                    )
                ],
            ),
            Section("Only words", text=["Nothing else."]),
        ],
        "next_steps": [
            NextStep("ikns control --subject me/ trial.c3d", "Try a trial.")
        ],
    }
    return report_html(**(parts | changes))


@cache
def usual_page() -> str:
    return page()


def test_report_holds_every_part_in_order() -> None:
    reader = Reader(usual_page())
    text = " ".join(reader.text)
    order = [
        "Simulated subject",
        "Calibration of one arm",
        "Everything worked.",
        "Key numbers",
        "How far the hand drifts.",
        "What was learned",
        "map.json",
        "Figure 1.",
        "Figure 2.",
        "Table 1.",
        "Only words",
        "Next steps",
        "ikns control --subject me/ trial.c3d",
        "Side",
    ]
    body = text[text.index("Simulated subject") :]
    place = 0
    for words in order:
        place = body.index(words, place)


def test_report_has_one_main_heading_and_alternative_text_for_every_picture() -> None:
    reader = Reader(usual_page())
    assert len(reader.tags("h1")) == 1
    assert len(reader.tags("h2")) == 4
    alts = [image["alt"] for image in reader.tags("img")]
    assert alts == ["Dots at 6 and 11", "A box of eight points"]
    assert reader.tags("html") == [{"lang": "en"}]


def test_report_loads_nothing_from_elsewhere() -> None:
    reader = Reader(usual_page())
    for _, attrs in reader.seen:
        for name in ("src", "href", "srcset", "data", "action", "poster"):
            assert (attrs.get(name) or "data:").startswith(("data:", "#"))
    assert not reader.tags("script")
    assert not reader.tags("link")
    style = re.search(r"<style>(.*?)</style>", usual_page(), re.DOTALL)
    assert style
    assert "url(" not in style[1]
    assert "@import" not in style[1]
    policy = reader.tags("meta")[1]["content"]
    assert policy is not None
    assert policy.startswith("default-src 'none'")


def test_pictures_in_the_report_are_the_figures() -> None:
    images = [image["src"] or "" for image in Reader(usual_page()).tags("img")]
    plain, spatial = (base64.b64decode(source.split(",")[1]) for source in images)
    assert plain == svg(small_figure())
    # Nothing inside a picture may point out of it either.
    assert not re.search(rb'href="(?!#)', plain)
    assert b"<image" in spatial
    assert not re.search(rb'href="(?!#|data:image/png)', spatial)


def test_simulated_is_said_in_header_and_every_caption_or_nowhere() -> None:
    simulated = usual_page()
    assert simulated.count("Simulated subject") == 1
    # Two figures, one table and the key numbers.
    assert simulated.count("Simulated.") == 4
    assert "imulated" not in page(simulated=False, sections=[])


def test_numbers_in_a_column_share_their_decimals_and_stand_right() -> None:
    rows = [
        [1, 5.678, "yes", True],
        [10, 0.5, "no", None],
        [np.int64(3), np.nan, "", 0],
    ]
    table = Table(["n", "angle", "word", "flag"], rows)
    html = page(sections=[Section("s", tables=[table])])
    for cell in (">5.68<", ">0.50<", ">–<", ">10<", ">yes<"):
        assert cell in html
    head = re.findall(r'<th scope="col" (class="number")?>(\w+)</th>', html)
    assert [bool(right) for right, _ in head] == [True, True, False, False]


@settings(max_examples=30)
@given(st.text(max_size=40))
def test_hostile_text_stays_text(text: str) -> None:
    attack = f'<script>alert(1)</script>"><img src=x onerror=1>{text}&amp;'
    html = report_html(
        title=attack,
        lead=attack,
        simulated=True,
        facts={attack: attack},
        key_numbers=[KeyNumber(attack, attack, attack)],
        sections=[
            Section(attack, [attack], tables=[Table([attack], [[attack]], attack)])
        ],
        next_steps=[NextStep(attack, attack)],
    )
    reader = Reader(html)
    assert not reader.tags("script")
    assert not reader.tags("img")
    # The parser unescapes: what the reader sees is what was given.
    words = "".join(reader.text)
    assert words.count('<script>alert(1)</script>"><img src=x onerror=1>') == 15


def test_hostile_captions_and_alternative_texts_stay_text() -> None:
    attack = '"><script>alert(1)</script>'
    picture = Picture(Figure(figsize=(1, 1)), attack, attack)
    reader = Reader(page(sections=[Section("s", pictures=[picture])]))
    assert not reader.tags("script")
    assert reader.tags("img")[0]["alt"] == attack


def test_same_input_gives_the_same_page() -> None:
    assert page() == usual_page()


def test_a_picture_without_alternative_text_is_refused() -> None:
    silent = Section("s", pictures=[Picture(Figure(), "caption", " ")])
    with pytest.raises(InvalidInput, match="alternative text"):
        page(sections=[silent])


def test_a_ragged_table_is_refused() -> None:
    with pytest.raises(InvalidInput, match="2 columns holds a row of 1"):
        page(sections=[Section("s", tables=[Table(["a", "b"], [[1]])])])


def test_write_report_replaces_the_file_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    write_report(path, report_html(title="first", sections=[], simulated=False))
    assert "first" in path.read_text(encoding="utf-8")
    bad = Section("s", pictures=[Picture(Figure(), "caption", "")])
    with pytest.raises(InvalidInput):
        write_report(path, report_html(title="second", sections=[bad], simulated=False))
    assert "first" in path.read_text(encoding="utf-8")
    write_report(path, report_html(title="third \udcff", sections=[], simulated=False))
    assert "third ?" in path.read_text(encoding="utf-8")
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_does_not_exist_is_an_error_in_one_sentence(
    tmp_path: Path,
) -> None:
    path = tmp_path / "missing" / "report.html"
    with pytest.raises(FileError, match="report.html: cannot be written"):
        write_report(path, report_html(title="t", sections=[], simulated=False))
    with pytest.raises(FileError, match="cannot be written"):
        write_report(tmp_path, report_html(title="t", sections=[], simulated=False))


def test_report_of_a_whole_recording_stays_under_three_megabytes() -> None:
    rng = np.random.default_rng(6)
    time = np.arange(12_000) / 100
    noise = rng.normal(size=(12_000, 3))
    labels = rng.integers(-1, 10, 12_000)
    figures = [
        workspace_figure(
            noise, noise, labels, rng.normal(size=(10, 3)), simulated=False
        ),
        control_figure(
            time, noise[:, 0], noise[:, 1], noise[:, 2] > 0, simulated=False
        ),
        residual_figure(time, noise[:, 0], simulated=False),
        swivel_figure(*noise.T[:2], labels, np.ones(10), simulated=False),
    ]
    pictures = [Picture(figure, "caption", "alt") for figure in figures]
    html = page(sections=[Section("all", pictures=pictures)])
    assert len(html.encode()) < 3_000_000
