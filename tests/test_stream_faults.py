"""Faults are struck as counted, and counted as struck."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.errors import InvalidInput
from ikns.live.stream import Continuity, Faults, Frame, inject

RATE = 100.0
CHANCE = st.floats(0, 0.2)


@given(
    st.integers(0, 300),
    st.builds(
        Faults,
        drop=CHANCE,
        late=CHANCE,
        repeat=CHANCE,
        swap=CHANCE,
        freeze=CHANCE,
        late_seconds=st.floats(0.05, 0.5),
        freeze_seconds=st.floats(0, 0.2),
    ),
    st.integers(0, 2**32),
)
def test_a_receiver_counts_exactly_what_was_struck(
    n: int, faults: Faults, seed: int
) -> None:
    # Held up by H, a frame is late by H, the one behind it by H less a period, so that
    # half a period under H lies between them.
    continuity = Continuity(RATE, late_after=faults.late_seconds - 0.5 / RATE)
    tally: Counter[str] = Counter()
    held_until = -np.inf
    rng = np.random.default_rng(seed)
    for sent in inject(range(n), faults, RATE, rng, tally):
        due = sent.frame / RATE
        if sent.hold:
            held_until = due + sent.hold
        markers = np.full((1, 3), float(sent.content))
        continuity.add(Frame(sent.frame, due, max(due, held_until), markers))
    counts = continuity.counts
    assert counts.dropped == tally["drop"]
    assert counts.late == tally["late"]
    assert counts.repeated == tally["repeat"]
    assert counts.out_of_order == tally["swap"]
    assert counts.frozen == tally["freeze"]
    assert counts.received == n - tally["drop"] + tally["repeat"]


def test_the_same_seed_strikes_the_same_frames() -> None:
    faults = Faults.parse("drop=0.1,swap=0.1,freeze=0.05:0.02")

    def struck(seed: int) -> list[int]:
        rng = np.random.default_rng(seed)
        return [s.content for s in inject(range(200), faults, RATE, rng, Counter())]

    assert struck(1) == struck(1)
    assert struck(1) != struck(2)


@pytest.mark.parametrize(
    "text",
    ["lost=0.1", "drop", "drop=often", "drop=-1", "drop=0.6,swap=0.6", "drop=0.1:3",
     "late=0.1:soon", "late=0.1:-1", "drop=nan"],
)  # fmt: skip
def test_faults_that_make_no_sense_are_refused(text: str) -> None:
    with pytest.raises(InvalidInput):
        Faults.parse(text)
