"""``ikns study plan``: from a study file, from options, from a pilot's visits."""

import io
import json
import math
import re
from contextlib import redirect_stdout

import numpy as np
import pytest
import typer
from scipy import integrate, stats
from statsmodels.stats.power import TTestPower

from ikns.cli.study_plan import plan
from ikns.errors import FileError, InvalidInput, NotEnoughData
from ikns.experiments.picking import pick_schedule
from ikns.experiments.study import init_study
from ikns.experiments.tracking import Attempt, TrackingRecord, draw_profile, schedule
from ikns.experiments.visits import create_visit, tracking_row, write_attempts
from ikns.view.power import power_figure

APP = typer.Typer()
APP.command()(plan)


def run(*argv):
    """Run the command as the program does; return what it prints."""
    out = io.StringIO()
    with redirect_stdout(out):
        typer.main.get_command(APP).main(
            args=["--simulations", "300", *map(str, argv)],
            prog_name="plan",
            standalone_mode=False,
        )
    return out.getvalue()


def found(*argv):
    return json.loads(run(*argv, "--json"))


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Folder of the example study."""
    return init_study(tmp_path_factory.mktemp("plan") / "study").parent


# --- power ----------------------------------------------------------------------------


#: Enough studies to tell powers apart.
EXACT = ["--spread", 1.0, "--simulations", 2000]


def difference_power(difference, deviation, n):
    return float(TTestPower().power(difference / deviation, n, 0.05))


def equivalence_power(margin, difference, deviation, n):
    """Given the spread found, the mean is normal: integrated over the spread's chi."""
    error, quantile = deviation / math.sqrt(n), stats.t.isf(0.05, n - 1)

    def given(chi):
        slack = margin - quantile * error * chi / math.sqrt(n - 1)
        if slack <= 0:
            return 0.0
        z = np.array([slack - difference, -slack - difference]) / error
        return float(-np.diff(stats.norm.cdf(z))[0] * stats.chi.pdf(chi, n - 1))

    edge = margin / error * math.sqrt(n - 1) / quantile
    return integrate.quad(given, 0, min(edge, 12 + math.sqrt(n)))[0]


@pytest.mark.parametrize(
    ("options", "power"),
    [
        (["--difference", 0.6], lambda n: difference_power(0.6, 1.0, n)),
        (["--margin", 0.8], lambda n: equivalence_power(0.8, 0.0, 1.0, n)),
        (
            ["--margin", 0.8, "--difference", 0.2],
            lambda n: equivalence_power(0.8, 0.2, 1.0, n),
        ),
    ],
    ids=["difference", "equivalence", "equivalence off the middle"],
)
def test_every_power_told_is_the_closed_form_within_its_own_error(options, power):
    told = found(*options, *EXACT, "--participants", 12)
    for row in [*told["power"], told["declared"]]:
        exact = power(row["participants"])
        # Binomial of 2000; 20 rows at four errors leave 1 in 800 to the fixed seed.
        error = math.sqrt(exact * (1 - exact) / 2000)
        assert abs(row["power"] - exact) < 4 * error + 1e-3
        assert row["low"] <= row["power"] <= row["high"]
    exact = next(n for n in range(2, 200) if power(n) >= 0.8)
    # One participant more is 0.02 of power there, and two errors are 0.018.
    assert abs(told["sample_size"]["participants"] - exact) <= 2


def test_one_sided_bounds_of_statsmodels_hold_the_power_of_equivalence():
    told = found("--margin", 0.8, *EXACT)
    for row in told["power"]:
        n = row["participants"]
        one = float(TTestPower().power(0.8, n, 0.05, alternative="larger"))
        # Both tests must reject: at most as often as one, at least 1 less both misses.
        # Four binomial errors of 2000 are at most 4 sqrt(0.25 / 2000) = 0.0447.
        assert max(0.0, 2 * one - 1) - 0.0447 < row["power"] < one + 0.0447


def test_parts_of_the_spread_shrink_as_the_design_says():
    parts = ["--spread", 0.6, "--level-spread", 0.8, "--trial-spread", 1.2]
    design = ["--levels", 3, "--repeats", 4, "--margin", 1.0]
    told = found(*parts, *design, "--simulations", 2000)
    whole = math.sqrt(0.36 + 0.64 / 3 + 2 * 1.44 / 12)
    assert told["spread"]["of_subject_means"] == pytest.approx(whole)
    exact = next(n for n in range(2, 99) if equivalence_power(1, 0, whole, n) >= 0.8)
    assert abs(told["sample_size"]["participants"] - exact) <= 1


def test_one_seed_one_answer():
    options = ["--margin", 1.0, "--spread", 1.0]
    assert found(*options, "--seed", 3) == found(*options, "--seed", 3)
    assert found(*options, "--seed", 3) != found(*options, "--seed", 4)


# --- a study --------------------------------------------------------------------------


def test_margin_design_and_seed_are_those_the_study_declares(study):
    told = found(study)
    assert (told["margin"], told["unit"], told["seed"]) == (1.0, "of 100", 0)
    assert told["design"] == {
        "participants": 10,
        "levels": 3,
        "repeats": 3,
        "conditions": ["ikns", "gamepad"],
    }
    assert told["warnings"] == []
    other = found(study, "--experiment", "picking", "--most", 60)
    assert (other["margin"], other["unit"]) == (2.0, "s")
    assert other["design"]["levels"] == 11
    # 3.97 s between subjects: more than the paper's ten can show within 2 s.
    assert other["sample_size"]["participants"] > 10


def test_an_option_that_overrides_a_declaration_is_told(study):
    told = found(study, "--margin", 0.5, "--participants", 30, "--seed", 9)
    assert (told["margin"], told["seed"]) == (0.5, 9)
    assert told["declared"]["participants"] == 30
    assert any("--margin 0.5 instead of the 1" in line for line in told["warnings"])
    assert any("--participants 30 instead" in line for line in told["warnings"])


def test_the_table_names_the_assumption_and_marks_what_is_needed(study):
    text = " ".join(run(study).split())
    assert "Plan picking with --experiment picking." in text
    assert "equivalence within 1 RMSE (of 100), 300 simulated studies" in text
    assert "Assumed: differences of RMSE with standard deviations of 1.3" in text
    assert "the paper's printed means" in text
    assert re.search(r"\b\d+ \d+\.\d \d+\.\d to \d+\.\d needed", text)
    assert re.search(r"\b10 \d+\.\d \d+\.\d to \d+\.\d declared", text)


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        ([], "expected a margin for tracking"),
        (["--margin", "0"], "margin above 0"),
        (["--margin", "nan"], "margin"),
        (["--margin", "1", "--difference", "1"], "inside the margin 1"),
        (["--margin", "1", "--spread", "-1"], "standard deviations of 0 or more"),
        (["--margin", "1", "--level-spread", "0"], "one above 0"),
        (["--margin", "1", "--power", "1"], "a power between alpha"),
        (["--margin", "1", "--alpha", "0.6"], "alpha"),
        (["--margin", "1", "--figure", "power.jpg"], "that ends in .png, .svg or .pdf"),
        (["--margin", "1", "--spread", "1", "--pilot", "x"], "--spread or --pilot"),
    ],
)
def test_bad_options_are_refused_in_one_sentence(argv, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidInput) as caught:
        run(*argv)
    assert says in str(caught.value)
    assert re.fullmatch(r"[^\n]+\.", str(caught.value))
    assert not list(tmp_path.iterdir())


def test_a_study_without_the_experiment_or_a_margin_is_refused(study, tmp_path):
    text = (study / "study.toml").read_text()
    alone = tmp_path / "study.toml"
    alone.write_text(text[: text.index("# Experiment 2")])
    with pytest.raises(
        InvalidInput, match=r"with \[picking\], found only \[tracking\]"
    ):
        run(tmp_path, "--experiment", "picking")
    alone.write_text(re.sub(r"(?m)^margin = .*$", "", alone.read_text()))
    with pytest.raises(InvalidInput, match="a margin for tracking, declared"):
        run(tmp_path)
    with pytest.raises(FileError):
        run(tmp_path / "nowhere")


# --- a pilot --------------------------------------------------------------------------

ABOUT = {"study": "pilot", "variation": "", "variation_settings": {}, "seed": 0}
#: Of each of four participants: how much more error, of 100, and time, s, with IKNS.
MORE = (0.5, 2.0, 1.0, 2.5)


def picks(number):
    """Every object placed in 5 s, with IKNS later; the last one dropped."""
    steps = pick_schedule(number, objects=("A", "B"), training=1, rest=0.0)
    for count, step in enumerate([s for s in steps if s.kind != "rest"], start=1):
        lost = (step.condition, step.object, number) == ("ikns", "B", 3)
        time = 5.0 + MORE[number] * (step.condition == "ikns")
        yield {
            "number": count,
            "key": step.key,
            "kind": step.kind,
            "condition": step.condition,
            "object": step.object,
            "repeat": step.repeat,
            "outcome": "dropped" if lost else "success",
            "reason": "",
            "practised": 0,
            "time": time,
            "limit": step.limit,
            "comment": "",
        }


def tracks(number):
    """Pointer off by a constant, so that the RMSE is known."""
    steps = schedule(number, profiles=("T1", "T2"), repeats=1, training=0, rest=0.0)
    for count, step in enumerate([s for s in steps if s.kind == "trial"], start=1):
        profile = draw_profile(step.profile, step.seed, seconds=step.seconds)
        time = np.arange(2501) / 100
        off = 1.0 + MORE[number] * (step.condition == "ikns")
        c = (profile.at(time) + off) / 100
        record = TrackingRecord(profile, time, profile.at(time), c, "done")
        attempt = Attempt(step.key, "done", record=record)
        yield tracking_row(count, step, attempt, align=0.0, practised=0)


@pytest.fixture(scope="module")
def pilots(tmp_path_factory):
    """Folder of a study with both experiments, of people or simulated."""
    top = tmp_path_factory.mktemp("pilots")
    for simulated in (True, False):
        for number in range(len(MORE)):
            for experiment, rows in (("tracking", tracks), ("picking", picks)):
                name = f"sub-{number + 1:02d}_{experiment}"
                folder = top / ("virtual" if simulated else "people") / "visits" / name
                create_visit(
                    folder,
                    ABOUT
                    | {"experiment": experiment, "participant": f"{number + 1:02d}"}
                    | {"simulated": simulated, "participant_number": number},
                )
                write_attempts(folder, list(rows(number)))
    return top


def test_a_pilot_s_spread_is_measured_again_from_its_visits(pilots):
    told = found("--margin", 2, "--pilot", pilots / "people", "--levels", 2)
    # The same difference at every level and no noise: all of it is the subjects'.
    deviation = float(np.std(MORE, ddof=1))
    assert told["spread"]["subject"] == pytest.approx(deviation, rel=1e-6)
    assert told["spread"]["level"] == pytest.approx(0.0, abs=1e-6)
    low, high = told["spread"]["of_subject_means_interval"]
    assert low == pytest.approx(deviation * math.sqrt(3 / stats.chi2.ppf(0.975, 3)))
    assert high == pytest.approx(deviation * math.sqrt(3 / stats.chi2.ppf(0.025, 3)))
    assert told["spread"]["pilot_simulated"] is False
    assert told["spread"]["source"] == "a pilot with 4 subjects"
    assert told["warnings"] == []


def test_failures_of_a_pilot_are_at_the_limit_as_they_will_be_tested(pilots):
    told = found(
        "--margin", 20, "--pilot", pilots / "people", "--experiment", "picking"
    )
    d = np.array([[more, more] for more in MORE])
    d[3, 1] = 20.0 - 5.0
    means = d.mean(axis=1)
    assert told["spread"]["of_subject_means"] == pytest.approx(means.std(ddof=1))


def test_a_simulated_pilot_is_called_simulated(pilots, tmp_path):
    picture = tmp_path / "power.svg"
    argv = ("--margin", 2, "--pilot", pilots / "virtual")
    told = found(*argv)
    assert told["spread"]["pilot_simulated"] is True
    text = " ".join(run(*argv, "--figure", picture).split())
    assert f"the pilot {pilots / 'virtual'} is simulated" in text
    assert "(a simulated pilot with 4 subjects;" in text
    assert picture.read_bytes().startswith(b"<?xml")
    with pytest.raises(InvalidInput, match="--force"):
        run(*argv, "--figure", picture)


def test_a_pilot_without_the_experiment_is_refused(pilots, tmp_path):
    folder = tmp_path / "visits" / "sub-01_picking"
    create_visit(
        folder,
        ABOUT
        | {"experiment": "picking", "participant": "01"}
        | {"simulated": True, "participant_number": 0},
    )
    write_attempts(folder, list(picks(0)))
    with pytest.raises(NotEnoughData, match="visits of tracking"):
        run("--margin", 1, "--pilot", tmp_path)
    with pytest.raises(NotEnoughData, match=r"at least 2 subjects .* found 1"):
        run("--margin", 1, "--pilot", tmp_path, "--experiment", "picking")
    with pytest.raises(FileError):
        run("--margin", 1, "--pilot", tmp_path / "nowhere")


# --- the figure -----------------------------------------------------------------------


def drawn(**options):
    given = {"aim": "equivalence", "target": 0.8, "simulated": False} | options
    return power_figure([4, 8], [0.2, 0.9], [[0.1, 0.8], [0.3, 1.0]], **given)


def test_the_figure_shows_every_power_and_says_what_is_simulated():
    (axes,) = drawn(needed=8, declared=4).axes
    line = next(line for line in axes.lines if line.get_label() == "power")
    assert line.get_xydata().tolist() == [[4.0, 20.0], [8.0, 90.0]]
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels[-2:] == ["needed: 8", "declared: 4"]
    assert "by simulation" in drawn().get_suptitle()
    assert "(simulated subject)" not in drawn().get_suptitle()
    assert "(simulated subject)" in drawn(simulated=True).get_suptitle()


def test_a_figure_of_shapes_that_disagree_is_refused():
    options = {"aim": "", "target": 0.8, "simulated": False}
    with pytest.raises(InvalidInput, match="one length"):
        power_figure([4], [0.2, 0.9], [[0.1], [0.3]], **options)
    with pytest.raises(InvalidInput, match=r"\(2, 1\)"):
        power_figure([4], [0.2], [0.1, 0.3], **options)
    with pytest.raises(InvalidInput, match="0 to 1"):
        power_figure([4], [1.2], [[0.1], [0.3]], **options)
