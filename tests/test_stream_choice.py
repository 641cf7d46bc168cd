"""A source that could be one of several is refused, never settled by chance."""

import re
import socket
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from test_stream_lsl import AXES, vendor

from ikns.errors import StreamError
from ikns.live.stream import Source, lsl_search, open_source
from ikns.live.stream.lsl_search import Wanted, find_stream, find_successor


@pytest.fixture
def name() -> str:
    """Name that only this test uses."""
    return f"choice-{uuid.uuid4().hex[:8]}"


def opened(name: str, options: str = "") -> Source:
    return open_source(f"lsl:{name}?scope=machine&timeout=10{options}")


@contextmanager
def pushing(outlet: Any, value: float, rate: float = 100.0) -> Iterator[None]:
    """Send the same sample again and again."""
    stop = threading.Event()

    def push() -> None:
        while not stop.wait(1 / rate):
            outlet.push_sample([value] * 3)

    thread = threading.Thread(target=push)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def refusal(name: str, options: str = "") -> str:
    with pytest.raises(StreamError) as refused:
        opened(name, options)
    return str(refused.value)


def test_two_streams_of_one_name_are_refused_and_one_can_be_chosen(name: str) -> None:
    here = socket.gethostname()
    one = vendor(name, AXES, source_id="suite 3")
    two = vendor(name, AXES, source_id="desk & chair")
    uids = [outlet.get_info().uid() for outlet in (one, two)]
    for _ in range(2):  # whichever answers first
        sentence = refusal(name)
        assert f"expected one LSL stream {name}, found 2: " in sentence
        for source_id, uid in zip(("suite 3", "desk & chair"), uids, strict=True):
            assert f"host {here}, source id {source_id}, uid {uid}" in sentence
    # What the sentence proposes is accepted as it stands.
    proposed = re.search(r"as in lsl:\S+\?(source_id=\S+)\.", sentence)
    assert proposed
    with opened(name, f"&{proposed[1]}") as source:
        for outlet, value in ((one, 1.0), (two, 2.0)):
            outlet.push_sample([value] * 3)
        first = "suite" in proposed[1]
        assert next(source).markers[0, 0] == (1.0 if first else 2.0)
    assert "found 2: " in refusal(name, f"&host={here}")


def test_a_choice_that_fits_no_stream_names_those_that_answer(name: str) -> None:
    outlet = vendor(name, AXES, source_id="suite 3")
    with pytest.raises(StreamError) as refused:
        open_source(f"lsl:{name}?scope=machine&timeout=0.5&source_id=suite%204")
    sentence = str(refused.value)
    assert f"{name} with source id suite 4 to answer within 0.5 s" in sentence
    assert outlet.get_info().uid() in sentence
    with pytest.raises(StreamError, match="of host moon to answer within 0.5 s, found"):
        open_source(f"lsl:{name}?scope=machine&timeout=0.5&host=moon")


def test_a_stream_of_another_type_is_no_second_stream(name: str) -> None:
    outlets = [vendor(name, AXES, kind=k, source_id=k) for k in ("EEG", "MoCap")]
    with opened(name) as source:
        outlets[1].push_sample([3.0] * 3)
        assert next(source).markers[0, 0] == 3.0


@dataclass
class Info:
    """Description of a stream, as far as choosing one needs it."""

    n: str
    s: str
    h: str
    u: str
    t: str = "MoCap"

    def name(self) -> str:
        return self.n

    def source_id(self) -> str:
        return self.s

    def hostname(self) -> str:
        return self.h

    def uid(self) -> str:
        return self.u

    def type(self) -> str:
        return self.t


class Network:
    """Streams that answer, one wave of a search after the other."""

    def __init__(self, *waves: list[Info]) -> None:
        self.waves = list(waves)
        self.asked: list[tuple[str, int, float]] = []

    def resolve_bypred(self, query: str, least: int, timeout: float) -> list[Info]:
        self.asked.append((query, least, timeout))
        return self.waves.pop(0) if len(self.waves) > 1 else self.waves[0]


LAB = Info("lab", "cams", "tower", "u1")


@pytest.mark.parametrize(
    ("others", "wanted", "says"),
    [
        ([Info("hall", "cams", "tower", "u2")], Wanted(), "by its name, as in lsl:"),
        ([Info("lab", "", "tower", "u2")], Wanted("lab"), "lsl:lab?source_id=cams."),
        ([Info("lab", "cams", "attic", "u2")], Wanted("lab"), "lsl:lab?host="),
        (
            [Info("lab", "cams", "attic", "u2")],
            Wanted("lab", "cams"),
            "&source_id=cams.",
        ),
        ([Info("lab", "cams", "tower", "u2")], Wanted("lab"), "so end all but one."),
        (
            [Info("lab", "cams", "tower", "u2"), Info("lab", "x", "tower", "u3")],
            Wanted("lab"),
            "found 3: ",
        ),
    ],
)
def test_a_refusal_says_how_to_choose(
    others: list[Info], wanted: Wanted, says: str
) -> None:
    network = Network([LAB], [*others, LAB])
    with pytest.raises(StreamError) as refused:
        find_stream(network, wanted, timeout=5.0)
    sentence = str(refused.value)
    assert says in sentence
    assert all(f"uid {info.u}" in sentence for info in (LAB, *others))


def test_the_second_stream_may_answer_late() -> None:
    # The first search returns with the first answer, whoever that is.
    network = Network([LAB], [LAB, LAB])
    assert find_stream(network, Wanted("lab"), timeout=5.0) is LAB
    (_, least, first), (_, more, then) = network.asked
    assert least == 1
    assert more > 1
    assert first == pytest.approx(0.97 * 5.0)
    assert then == pytest.approx(0.97 * lsl_search.SETTLE)
    # One that has ended since is none.
    gone = Info("lab", "left", "tower", "u9")
    assert find_stream(Network([gone], [LAB]), Wanted("lab"), timeout=5.0) is LAB


def test_who_wants_one_source_waits_for_it() -> None:
    other = Info("lab", "desk", "tower", "u2")
    network = Network([other], [other], [other, LAB])
    assert find_stream(network, Wanted("lab", "cams"), timeout=5.0) is LAB


@pytest.mark.parametrize(
    ("there", "found"),
    [
        ([], None),
        ([Info("lab", "cams", "tower", "u2")], "u2"),
        ([Info("lab", "cams", "tower", "u2"), Info("lab", "x", "attic", "u3")], "u2"),
        ([Info("lab", "cams", "tower", "u2"), Info("lab", "cams", "tower", "u3")], ""),
        ([Info("lab", "desk", "tower", "u2")], ""),
        ([Info("lab", "cams", "attic", "u2")], ""),
        ([Info("lab", "desk", "tower", "u2", "EEG")], None),
    ],
)
def test_after_a_loss_no_other_stream_is_taken(
    there: list[Info], found: str | None
) -> None:
    network = Network(there)
    if found == "":
        with pytest.raises(StreamError) as refused:
            find_successor(network, LAB, timeout=1.0)
        assert "to come back, found " in str(refused.value)
        assert all(info.u in str(refused.value) for info in there)
    else:
        info = find_successor(network, LAB, timeout=1.0)
        assert (info.u if info else None) == found


def test_another_source_of_the_name_is_reported_and_not_read(name: str) -> None:
    lost = vendor(name, AXES, source_id="cams")
    with opened(name) as source:
        lost.push_sample([1.0] * 3)
        assert next(source).markers[0, 0] == 1.0
        del lost
        other = vendor(name, AXES, source_id="left over")
        with pushing(other, 9.0):
            wait_for(source, "source id left over")
            back = vendor(name, AXES, source_id="cams")
            with pushing(back, 1.0):
                wait_for(source, "the stream is back.")
                assert next(source).markers[0, 0] == 1.0


def wait_for(source: Source, words: str) -> None:
    """Read until an event has these words; nothing may be read before."""
    give_up = time.monotonic() + 30
    while not any(words in event.text for event in source.events):
        assert time.monotonic() < give_up, list(source.events)
        frame = source.read(0.05)
        assert frame is None or frame.markers[0, 0] == 1.0


def test_a_rate_that_is_not_named_is_counted_and_reported(name: str) -> None:
    outlet = vendor(name, AXES, rate=0.0)
    stop = threading.Event()

    def push() -> None:  # stamps as a camera at 40 Hz would set them
        assert outlet.wait_for_consumers(20)
        for k in range(10_000):
            outlet.push_sample([1.0 + k] * 3, 1000 + k / 40)
            if stop.wait(0.002):
                return

    thread = threading.Thread(target=push)
    thread.start()
    try:
        with opened(name) as source:
            # 41 stamps in a second, to the rounding of 1e3 + 1 in double precision.
            assert source.rate == pytest.approx(40.0, abs=1e-9)
            assert (
                "no nominal rate; 40.0 frames/s were counted" in source.events[0].text
            )
            steps = np.diff([next(source).number for _ in range(20)])
            assert (steps == 1).all()
    finally:
        stop.set()
        thread.join()


def test_a_stream_without_rate_and_frames_is_refused(name: str) -> None:
    outlet = vendor(name, AXES, rate=0.0)
    with pytest.raises(StreamError, match="found a rate of 0 and 0 frames within 1 s"):
        open_source(f"lsl:{name}?scope=machine&timeout=1")
    del outlet
