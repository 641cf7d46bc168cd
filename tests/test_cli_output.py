"""What a command shows while it works."""

import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.cli.output import loading, progress, seconds_left, show


@given(
    people=st.integers(5, 50),
    before=st.integers(0, 10),
    pace=st.floats(0.01, 1000.0),
    workers=st.integers(1, 2),
    share=st.floats(0.2, 0.95),
)
def test_the_time_left_is_right_within_a_factor_of_two(
    people: int, before: int, pace: float, workers: int, share: float
) -> None:
    # Both visits of a participant are reported at once, and workers end together.
    rounds = -(-people // workers)
    now = share * rounds * pace
    finished = min(int(share * rounds) * workers, people)
    if finished < max(workers, 0.2 * people):
        return
    found = seconds_left(
        now,
        began=0.0,
        last=int(share * rounds) * pace,
        done=2 * finished,
        left=2 * (people - finished),
    )
    assert found is not None
    true = rounds * pace - now
    # A pace of whole rounds does not see that the last round may be half empty.
    assert true / 2 - pace <= found <= 2 * true + pace


def test_nothing_is_known_before_anything_is_done() -> None:
    assert seconds_left(5.0, began=0.0, last=0.0, done=0, left=4) is None


def test_the_line_that_it_loads_is_gone_before_anything_else(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    loading()
    show({}, "a result", as_json=False)
    assert capsys.readouterr().err == ""  # not a terminal
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    loading()
    show({}, "a result", as_json=False)
    assert capsys.readouterr().err == "loading ...\r\x1b[K"


def test_bars_count_visits_and_not_the_moments_between_reports(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]
    monkeypatch.setattr("ikns.cli.output.time.monotonic", lambda: now[0])
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "100")
    with progress(kernels=False) as report:
        report("simulating", 4, 24)  # four were there before
        now[0] = 60.0
        report("simulating", 5, 24)
        report("simulating", 6, 24)
    # Two visits a minute, and 18 are left.
    assert "0:09:00" in capsys.readouterr().err
