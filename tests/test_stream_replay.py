"""A recording replayed: every frame, in order, on time; the clock is a stand-in."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ikns.live.stream import Source, open_source, replay
from ikns.live.stream.replay import Replay
from ikns.recording.files import read, write_c3d
from ikns.recording.recording import Recording


class Clock:
    """Time that passes only when somebody sleeps; sleeping overshoots."""

    def __init__(self, overshoot: float = 0.0) -> None:
        self.now = 1000.0
        self.overshoot = overshoot

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds + self.overshoot


def recording(n: int = 20, rate: float = 100.0) -> Recording:
    markers = np.random.default_rng(n).normal(size=(n, 2, 3))
    markers[3 % n, 1] = np.nan
    return Recording(5 + np.arange(n) / rate, markers, ["A", "B"], "made up")


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(replay, "time", made)
    return made


def test_every_frame_of_a_file_comes_once_and_in_order(tmp_path: Path) -> None:
    write_c3d(tmp_path / "free.c3d", recording(300))
    there = read(tmp_path / "free.c3d")
    with open_source(f"replay:{tmp_path / 'free.c3d'}?speed=max") as source:
        frames = list(source)
    assert source.labels == there.labels
    assert source.rate == there.rate
    assert [f.number for f in frames] == list(range(len(there.time)))
    np.testing.assert_array_equal([f.device_time for f in frames], there.time)
    np.testing.assert_array_equal([f.markers for f in frames], there.markers)
    assert source.continuity.counts.dropped == 0
    assert source.ended
    assert source.read(0.0) is None


@pytest.mark.parametrize(
    "name",
    ["stoop/stoop1_t169_f620f800.c3d",
     "ue_adl/ADL001/ADL001_static.csv"],
)  # fmt: skip
def test_real_recordings_replay_whole(data: Path, name: str) -> None:
    there = read(data / name)
    with open_source(f"replay:{data / name}?speed=0") as source:
        frames = list(source)
    np.testing.assert_array_equal([f.markers for f in frames], there.markers)
    np.testing.assert_array_equal([f.device_time for f in frames], there.time)
    assert source.continuity.counts.dropped == 0


@given(st.floats(0.1, 10), st.lists(st.floats(0, 0.05), min_size=20, max_size=20))
def test_deadlines_are_absolute_and_slowness_shows(
    speed: float, busy: list[float]
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        clock = Clock(overshoot=1e-4)
        patch.setattr(replay, "time", clock)
        feed = Replay(recording(), speed=speed)
        received, asked = [], []
        for seconds in busy:
            asked.append(clock.now)
            frame = feed.poll(1e3)
            assert frame is not None
            received.append(frame.receive_time)
            clock.now += seconds
    due = 1000.0 + np.arange(20) / 100 / speed
    # A frame comes when it is due or asked for, whichever is later, and a sleep that
    # overshoots (0.1 ms) adds to that frame alone; 1e-9 for sums near 1000.
    earliest = np.maximum(due, asked)
    assert (np.array(received) >= earliest - 1e-9).all()
    assert (np.array(received) <= earliest + 1e-4 + 1e-9).all()


def test_a_slow_reader_is_late_and_loses_nothing(clock: Clock) -> None:
    source = Source(Replay(recording()), late_after=0.005)
    numbers = []
    for frame in source:
        numbers.append(frame.number)
        clock.now += 0.03  # three periods a frame: each is 20 ms later than the last
    counts = source.continuity.counts
    assert numbers == list(range(20))
    assert (counts.received, counts.dropped, counts.late) == (20, 0, 19)
    assert counts.jitter["largest"] == pytest.approx(19 * 0.02)


def test_reading_gives_up_when_no_frame_is_due(clock: Clock) -> None:
    feed = Replay(recording(rate=10))
    assert feed.poll(0.01) is not None
    start = clock.now
    assert feed.poll(0.01) is None
    assert clock.now == pytest.approx(start + 0.01)
    frame = feed.poll(1.0)
    assert frame is not None
    assert frame.number == 1
    assert frame.receive_time == pytest.approx(start + 0.1)


def test_a_loop_goes_on_counting(clock: Clock) -> None:
    source = Source(Replay(recording(), loop=True))
    frames = [next(source) for _ in range(60)]
    steps = np.diff([f.device_time for f in frames])
    np.testing.assert_allclose(steps, 0.01, rtol=1e-9)
    np.testing.assert_array_equal(frames[41].markers, frames[1].markers)
    counts = source.continuity.counts
    assert (counts.dropped, counts.repeated, counts.late) == (0, 0, 0)


def test_in_real_time_no_frame_comes_before_its_time() -> None:
    source = Source(Replay(recording(rate=200)))
    frames = list(source)
    assert len(frames) == 20
    waited = np.array([f.receive_time - frames[0].receive_time for f in frames])
    assert (waited >= np.arange(20) / 200 - 1e-9).all()


def test_zeros_are_a_gap_live_as_in_files() -> None:
    seen = np.array([0.0, 0.0, 1e-300])  # not exactly zero
    markers = np.stack([np.zeros(3), -np.zeros(3), seen, [0.1, np.nan, 0.2]])
    there = Recording([0.0, 0.01], [markers, markers], ["A", "B", "C", "D"])
    with Source(Replay(there, speed=0)) as source:
        frames = list(source)
    for frame in frames:
        gap = np.isnan(frame.markers)
        assert gap.all(axis=1).tolist() == [True, True, False, True]
        np.testing.assert_array_equal(frame.markers[2], seen)
    # What is played stays as it is.
    np.testing.assert_array_equal(there.markers[0, 0], np.zeros(3))
