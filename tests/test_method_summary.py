"""What a calibration says of each method: changes of c where nothing is meant."""

import numpy as np
import pytest
import small_person

from ikns.calibration.method_summary import (
    _recommended,
    method_summary,
    no_range_learned,
)
from ikns.calibration.subject import Subject
from ikns.cli.calibration_tables import calibration_parts, methods_parts
from ikns.live.control.recorded import control_table
from ikns.motion.marker_ik import MarkerIK
from ikns.motion.motion import Motion
from ikns.nullspace.readout import METHODS


@pytest.fixture(scope="module")
def moved() -> tuple[Subject, Motion]:
    """A simulated person with six seconds of ordinary movement, and that."""
    subject = small_person.known_by_movement()
    free = small_person.another_day().free.recording
    return subject, MarkerIK(subject.skeleton).track(free, chain="right_arm")


def rests(subject: Subject, motion: Motion, method: str) -> np.ndarray:
    """Changes of c over reaches, by hand from what `ikns control` writes, unclipped."""
    speed = control_table(subject, motion, method=method).rows[:, 2]
    c = subject.readout(method).control_signal(subject.skeleton, motion)
    hand = motion.task_position(subject.chain)
    moving = ~(speed < 0.05)
    edges = np.flatnonzero(np.diff(moving.astype(int)))
    found = []
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        whole = np.isfinite(speed[a : b + 2]).all()
        if moving[a + 1] and whole and np.linalg.norm(hand[b + 1] - hand[a]) >= 0.1:
            found.append(abs(c[b + 1] - c[a]))
    return np.array(found)


def test_changes_are_those_of_what_control_writes(moved):
    subject, motion = moved
    found = method_summary(subject, [], [motion])
    for method in METHODS:
        by_hand = rests(subject, motion, method)
        assert found["reaches"] == {"between_places": 0, "natural": len(by_hand)}
        row = found["methods"][method]
        assert row["between_places"] is None
        assert np.isclose(row["natural"], by_hand.mean(), atol=1e-9)


def test_a_turned_hand_moves_the_paper_s_c_most(moved):
    rows = method_summary(moved[0], [])["methods"]
    assert rows["paper"]["turned_hand"] > 0.1
    # The upper arm does not turn; places of the hand move by millimeters.
    assert rows["proximal"]["turned_hand"] < 0.05
    # The wrist leads the hand nowhere.
    assert rows["intent"]["turned_hand"] == 0


def test_the_report_judges_movement_by_what_the_rest_of_it_taught(moved):
    subject, motion = moved
    told = subject.report["methods"]["summary"]
    known = method_summary(subject, natural=[motion])
    for method in ("paper", "proximal"):
        assert told["methods"][method] == pytest.approx(known["methods"][method])
    ours = told["methods"]["intent"]["natural"]
    # What is judged by itself looks better: by how much depends on the person.
    assert ours != known["methods"]["intent"]["natural"]


def test_a_method_is_recommended_for_live_use(moved):
    found = method_summary(moved[0], natural=[moved[1]])
    rows, best = found["methods"], found["recommended"]
    cost = {m: rows[m]["natural"] + rows[m]["turned_hand"] for m in ("paper", "intent")}
    assert best == min(cost, key=cost.get)
    (other,) = cost.keys() - {best}
    # What decides is printed first, also where one of the two says the opposite.
    first, rest = found["why"].split(" (")
    assert f"changes by {cost[best] / 2:.2f} on average" in first
    assert f"that of {other} by {cost[other] / 2:.2f}" in first
    for cause, name in (("natural", "natural reach"), ("turned_hand", "hand turned")):
        a, b = rows[best][cause], rows[other][cause]
        assert f"{name}: {a:.2f} and {b:.2f}" in rest
    # The table may show proximal as the best: why it takes no part is said.
    assert "proximal is shown for comparison only" in rest


def test_without_enough_reaches_no_method_is_recommended(moved):
    """A turned hand alone would speak for intent, whatever its reaches do."""
    subject = moved[0]
    found = method_summary(subject, [])
    assert found["recommended"] is None
    text = str(
        methods_parts({"methods": {**subject.report["methods"], "summary": found}})
    )
    assert "No method is recommended: 0 reaches between points and" in text
    assert "at least 5 of one kind are needed" in text


def test_a_method_whose_c_follows_reaches_is_not_recommended():
    counts = {"between_places": 7, "natural": 0}
    rows = {
        "paper": {"between_places": 0.3, "natural": None, "turned_hand": 2.8},
        "intent": {"between_places": 1.1, "natural": None, "turned_hand": 0.2},
    }
    # By the mean of both causes it would be intent.
    found = _recommended(rows, counts)
    assert found["recommended"] == "paper"
    assert "changes c of intent by 1.10, more than half of its range" in found["why"]
    assert found["why"].endswith("that of paper by 0.30")
    rows["paper"]["between_places"] = 0.8
    found = _recommended(rows, counts)
    assert found["recommended"] is None
    assert "half of its range: paper by 0.80 and intent by 1.10" in found["why"]
    # Nor is it recommended because there is no other.
    del rows["intent"]
    assert _recommended(rows, counts)["recommended"] is None


def test_a_range_smaller_than_a_reach_s_change_is_no_range(moved):
    found = method_summary(moved[0], natural=[moved[1]])
    assert no_range_learned(found) == ""
    for row in found["methods"].values():
        row["between_places"] = row["natural"] = 1.2
    found["methods"]["intent"] |= {"between_places": 1.1, "natural": 1.1}
    assert "by more than its whole range (by 1.1 at least)" in no_range_learned(found)
    found["methods"]["intent"]["between_places"] = 0.9
    found["methods"]["intent"]["natural"] = 0.9
    assert no_range_learned(found) == ""


def test_a_folder_of_before_says_what_there_is(moved, tmp_path):
    subject, motion = moved
    subject.save(tmp_path / "old")
    for name in ("proximal", "intent"):
        (tmp_path / "old" / f"{name}.json").unlink()
    old = Subject.load(tmp_path / "old")
    found = method_summary(old, natural=[motion])
    assert list(found["methods"]) == ["paper"]
    assert found["why"] == "paper is the only method available"
    assert found["methods"]["paper"]["turned_hand"] > 0.1
    del old.report["methods"]
    assert any(
        "before other methods existed" in str(p) for p in calibration_parts(old.report)
    )
