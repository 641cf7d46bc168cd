"""The page of a study: its numbers are the tables', its simulated parts say so."""

import csv
import io
import re
from html.parser import HTMLParser

import pytest
import small_visits as small

from ikns.experiments.study import init_study
from ikns.experiments.study.summary import summarize
from ikns.experiments.study.summary.numbers import numbers, trials_csv
from ikns.view.study_report import study_page

VOID = {"meta", "img"}


class Reader(HTMLParser):
    """What a browser would see; fails on tags that do not close in order."""

    def __init__(self, page):
        super().__init__()
        self.open, self.seen, self.text = [], [], []
        self.tables, self.captions, self.headings = [], [], []
        self.feed(page)
        self.close()
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")
        elif tag in ("caption", "figcaption"):
            self.captions.append("")
        elif tag in ("h2", "h1"):
            self.headings.append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)
        for tags, kept in (
            (("caption", "figcaption"), self.captions),
            (("h1", "h2"), self.headings),
        ):
            if set(tags) & set(self.open):
                kept[-1] += data
        if {"td", "th"} & set(self.open):
            self.tables[-1][-1][-1] += data

    def table(self, *columns):
        """Rows of the table that has these columns, by column."""
        for header, *rows in self.tables:
            if set(columns) <= set(header):
                return [dict(zip(header, row, strict=True)) for row in rows]
        raise AssertionError(f"no table with {columns}")


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """Declared study of four simulated participants, with a variation."""
    top = tmp_path_factory.mktemp("simulated")
    study = small.small_study(init_study(top / "study").parent)
    for who in (1, 2, 3):
        errors = dict.fromkeys([("ikns", "T1"), ("gamepad", "T1")], who + 1.0)
        small.tracking(study, who, errors, variation="late")
    summary = summarize(study)
    return summary, *study_page(summary)


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """One person, two simulated participants, and a visit of another version."""
    top = tmp_path_factory.mktemp("mixed")
    errors = {("ikns", "T1"): 2.0, ("gamepad", "T1"): 3.0}
    small.tracking(top / "study", 1, errors, simulated=False)
    for who in (2, 3):
        small.tracking(top / "study", who, errors)
    odd = small.tracking(top / "study", 4, errors) / "visit.json"
    odd.write_text(odd.read_text().replace('"format": 1', '"format": 7'))
    summary = summarize(top / "study")
    return summary, *study_page(summary)


def test_numbers_on_the_page_are_the_tables_numbers(simulated):
    summary, page, _ = simulated
    found = summary.groups[0].tracking
    rows = Reader(page).table("RMSE (of 100)", "trajectory", "n trials")
    assert len(rows) == len(found.rmse) == 6
    for row, cell in zip(rows, found.rmse, strict=True):
        assert row["condition"] == cell.condition
        assert row["trajectory"] == (cell.level or "all")
        assert float(row["RMSE (of 100)"]) == pytest.approx(cell.over.mean, abs=0.005)
        assert float(row["SD"]) == pytest.approx(cell.over.deviation, abs=0.005)
        assert int(row["n participants"]) == cell.over.subjects == 4
        assert int(row["n trials"]) == cell.trials
    lags = Reader(page).table("lag (s)", "overshoot (of 100)")
    for row, cell in zip(lags, found.metrics["lag"], strict=True):
        mean, spread = map(float, row["lag (s)"].split("\u00a0±\u00a0"))
        assert mean == pytest.approx(cell.over.mean, abs=0.0005)
        assert spread == pytest.approx(cell.over.deviation, abs=0.0005)


def test_objects_variations_and_attempts_on_the_page_are_the_tables(simulated):
    summary, page, _ = simulated
    group = summary.groups[0]
    reader = Reader(page)
    success = reader.table("ikns: succeeded", "ring: succeeded")
    cells = {(c.condition, c.object): c for c in group.picking.cells}
    for row, name in zip(success, [*group.picking.objects, ""], strict=True):
        for condition in ("ikns", "ring"):
            cell = cells[condition, name]
            said = row[f"{condition}: succeeded"].replace("\u00a0", " ")
            assert said == f"{cell.succeeded} of {cell.trials}"
    times = reader.table("ikns: n succeeded", "ring: n succeeded")
    all_objects = cells["ring", ""]  # the last of columns that are called the same
    assert float(times[-1]["median (s)"]) == pytest.approx(
        all_objects.median, abs=0.005
    )
    varied = reader.table("variation", "settings")
    assert len(varied) == len(group.tracking.varied) == 4
    late = varied[1]
    assert late["settings"].replace("\u00a0", " ") == "latency = 0.1"
    assert int(late["n pairs"]) == 3
    assert float(late["difference (of 100)"]) == pytest.approx(
        group.tracking.varied[1].against.mean, abs=0.005
    )
    done = reader.table("condition", "kind", "done", "aborted")
    assert [int(row["attempts"]) for row in done] == [0, 27, 0, 27]


def test_the_answers_come_first_and_are_those_of_the_statistics(simulated):
    summary, page, _ = simulated
    text = "".join(Reader(page).text)
    answers = numbers(summary)["groups"][0]["answers"]
    assert [a["question"] for a in answers] == [
        "Does tracking with the null space (ikns) differ from the gamepad?",
        "Does pick and place with the null space (ikns) differ from the ring button, "
        "in success and in time?",
    ]
    for each in answers:
        for sentence in (each["question"], *each["answer"]):
            # The contents name it before.
            assert text.index(sentence) < text.rindex("What was done")
    found = summary.groups[0].tracking.comparisons[0].analysis
    for sentence in (
        *(test.sentence() for test in found.paper),
        found.subjects.sentence(),
        found.equivalence.sentence(),
        found.model.sentence(),
    ):
        assert sentence in text
    tests = Reader(page).table("test", "what it says")
    assert [row["test"] for row in tests[:3]] == [
        "the paper's own",
        "the paper's own",
        "over participants",
    ]


def test_the_forest_plot_draws_the_tests_of_the_answers(simulated):
    summary, _, drawn = simulated
    name, forest = drawn[0]
    assert name == "simulated_answers"
    group = summary.groups[0]
    tracked, picked = group.tracking.comparisons[0], group.picking.comparisons[0]
    for axes, test, same in zip(
        forest.figure.axes,
        (tracked.analysis.subjects, picked.analysis.time.over_subjects),
        (tracked.analysis.equivalence, picked.equivalence),
        strict=True,
    ):
        lines = [list(line.get_xdata()) for line in axes.lines]
        assert lines[1:] == [
            [test.low, test.high],
            [same.low, same.high],
            [test.difference],
        ]
        (shade,) = axes.patches
        assert shade.get_x() == -same.margin
        assert shade.get_width() == 2 * same.margin
        (said,) = axes.texts
        assert same.verdict in said.get_text()
        low, high = axes.get_xlim()
        assert low < -same.margin
        assert high > test.high


def test_one_participant_has_no_interval_and_does_not_set_an_axis(tmp_path):
    study = tmp_path / "study"
    for who in (1, 2, 3):
        errors = {("ikns", "T1"): 2.0 + who % 2, ("gamepad", "T1"): 3.0}
        errors |= {("mouse", "T1"): 8.0} if who == 1 else {}
        small.tracking(study, who, errors)
    picks = {("ikns", "A"): ("success", 5.0), ("ring", "A"): ("dropped", 4.0)}
    small.visit(study, 1, "picking", small.picking_rows(picks))
    summary = summarize(study)
    page, drawn = study_page(summary)
    figures = {name: each.figure for name, each in drawn}
    (axes,) = figures["simulated_answers"].axes  # none of picking
    tracked = {c.names: c for c in summary.groups[0].tracking.comparisons}
    assert tracked["ikns", "mouse"].subjects == 1
    said = {text.get_text() for text in axes.texts}
    assert "ikns minus mouse\nno interval for one participant" in said
    test = tracked["ikns", "gamepad"].analysis.subjects
    assert axes.get_xlim()[1] == pytest.approx(1.15 * max(-test.low, test.high))
    upper, _ = figures["simulated_picking_objects"].axes
    assert not any(bar.has_yerr for bar in upper.containers)
    reader = Reader(page)
    (row, _) = reader.table("ikns: succeeded", "success (%)")
    assert row["ikns: succeeded"].replace("\u00a0", " ") == "1 of 1"
    assert row["success (%)"] == "0"  # the ring's, the last that is called so
    assert "".join(reader.text).count("no interval for one participant") == 2


def test_simulated_is_said_large_in_every_heading_caption_figure_and_file(simulated):
    summary, page, drawn = simulated
    reader = Reader(page)
    assert "Simulated: no person took part" in reader.text
    assert len(reader.headings) > 5
    for heading in reader.headings[1:]:
        assert heading.endswith("Simulated.") or heading == "Next steps", heading
    for caption in reader.captions:
        assert caption.endswith("Simulated.")
    text = "".join(reader.text)
    assert "4 simulated participants" in text
    assert not re.findall(r"\d+ (?:participants|people|persons)", text)
    assert "What such a simulation can and cannot show" in page
    assert len(drawn) == 8
    for name, each in drawn:
        assert name.startswith("simulated_")
        assert each.figure.get_suptitle().endswith("(simulated participants)")
    assert numbers(summary)["simulated"] == [True]
    for row in csv.DictReader(io.StringIO(trials_csv(summary, "tracking"))):
        assert row["simulated"] == "yes"


def test_a_page_about_people_speaks_of_no_simulation(tmp_path):
    study = tmp_path / "study"
    for who in (1, 2, 3):
        errors = {("ikns", "T1"): 2.0 + who % 2, ("gamepad", "T1"): 3.0}
        small.tracking(study, who, errors, simulated=False)
    page, drawn = study_page(summarize(study))
    assert "imulat" not in "".join(Reader(page).text)
    assert "3 participants" in page
    assert drawn
    for name, each in drawn:
        assert "imulated" not in name + each.figure.get_suptitle()


def test_people_come_first_and_what_was_not_tested_says_why(mixed):
    _, page, drawn = mixed
    reader = Reader(page)
    text = "".join(reader.text)
    assert text.index("Answers: people") < text.index("Answers: simulated")
    people, virtual = (text.index(f"\n{name}") for name in ("People", "Simulated part"))
    assert people < text.index("Not tested: one participant only.", people) < virtual
    assert "expected a visit of format 1, found 7" in text
    assert "1 of 4 visits could not be used" in text
    assert "No person took part: 2 simulated participants" in text
    assert "Participants: 1 participant in tracking" in text
    titles = {name: each.figure.get_suptitle() for name, each in drawn}
    assert titles["tracking_rmse"] == "RMSE by trajectory and condition"
    for name, title in titles.items():
        assert name.startswith("simulated_") == title.endswith(
            "(simulated participants)"
        )


def test_the_page_is_whole_and_loads_nothing(simulated, mixed):
    for _, page, _ in (simulated, mixed):
        reader = Reader(page)
        for _, attrs in reader.seen:
            for name in ("src", "href", "srcset", "data", "action", "poster"):
                assert (attrs.get(name) or "data:").startswith(("data:", "#"))
        tags = {tag for tag, _ in reader.seen}
        assert not tags & {"script", "link", "iframe"}
        assert not re.search(r"(url\(|@import|https?:)", page.split("</style>")[0])
        assert all(a["alt"] for t, a in reader.seen if t == "img")
        assert len(page.encode()) < 3_000_000


def test_the_page_shows_what_was_done_when_nothing_was_finished(tmp_path):
    rows = [small.attempt(1, "ikns", "T1", small.off_by(1), outcome="aborted")]
    small.visit(tmp_path / "study", 1, "tracking", rows)
    small.visit(tmp_path / "study", 1, "picking", [])
    page, drawn = study_page(summarize(tmp_path / "study"))
    reader = Reader(page)
    text = "".join(reader.text)
    assert "No trial was finished, so there is nothing to draw or to test." in text
    assert "1 of 1 simulated participant finished no trial: 01" in text
    assert "Not tested: nothing was attempted." in text
    (row, *_) = reader.table("condition", "kind", "aborted")[1:]
    assert (row["aborted"], row["attempts"]) == ("1", "1")
    assert not drawn


def test_the_methods_are_written_from_the_configuration(simulated):
    summary, page, _ = simulated
    text = "".join(Reader(page).text)
    for words in (
        "A trial gave 1 s to align and then 15 s to track.",
        "In each condition every curve came once.",
        "Rest between conditions: 60 s.",
        "two one-sided t-tests against a margin of 1 of 100 declared beforehand",
        "Input: ikns: replay:arm.c3d; gamepad: gamepad.",
        "Software: ikns 0.1.0.",
        "A trial ended with success, with the object dropped, or after 20 s.",
    ):
        assert words in text


def test_the_methods_hide_neither_settings_nor_what_was_not_simulated(tmp_path):
    errors = {("ikns", "T1"): 2.0}
    small.tracking(
        tmp_path,
        1,
        errors,
        design={"training": 10},
        training="counted, not simulated",
        parameters={"marker_noise": 0.001},
    )
    (group,) = numbers(summarize(tmp_path))["groups"]
    text = " ".join(group["methods"])
    assert "Parameters of the simulation: marker_noise = 0.001." in text
    assert "do not count (training: counted, not simulated)." in text


def test_numbers_and_trials_for_other_programs_are_those_of_the_summary(simulated):
    summary, _, _ = simulated
    (group,) = numbers(summary)["groups"]
    found = summary.groups[0].tracking
    assert [c["over"]["mean"] for c in group["tracking"]["rmse"]] == [
        c.over.mean for c in found.rmse
    ]
    analysis = group["tracking"]["comparisons"][0]["analysis"]
    assert analysis["subjects"]["p"] == found.comparisons[0].analysis.subjects.p
    for name in ("tracking", "picking"):
        text = trials_csv(summary, name)
        rows = list(csv.DictReader(io.StringIO(text)))
        table = getattr(summary.groups[0], name).table
        key = "rmse" if name == "tracking" else "time"
        assert [float(row[key]) for row in rows] == table[key].tolist()
