"""What the live loop publishes: as the session has it, and at no cost to the loop."""

import json
import struct
import threading
import time
import uuid
from types import SimpleNamespace

import numpy as np
import pytest
import pyxdf
from command_line import check_refused
from test_files_xdf import chunk, xdf

from ikns.body.skeleton import Skeleton
from ikns.calibration.subject import Subject
from ikns.cli import main
from ikns.errors import StreamError
from ikns.finger import SimulatedFinger
from ikns.live.publish import Publisher, open_publisher
from ikns.live.runtime import run
from ikns.live.session import create_session, open_run, read_run
from ikns.live.stream import Source
from ikns.live.stream.lsl_library import lsl
from ikns.live.stream.replay import Replay
from ikns.nullspace.map import NullSpaceMap
from ikns.recording.recording import Recording


@pytest.fixture
def name():
    return f"ikns-{uuid.uuid4().hex[:12]}"


BODY = Skeleton.load()


@pytest.fixture(scope="module")
def subject():
    """A person whose map is written down rather than learned."""
    points = 0.3 * np.array(list(np.ndindex(2, 2, 2))) - [0.1, 0.7, -0.1]
    learned = NullSpaceMap.from_arrays(
        points, np.eye(7)[[1] * 8], np.zeros(8), np.ones(8)
    )
    return Subject(BODY, learned, "right_arm", {})


def moving(n):
    """Markers of a body that swings its right arm, 100 frames per second."""
    frames, time = [], np.arange(n) / 100
    shoulder = BODY.joint_names.index("right_shoulder_flexion")
    for t in time:
        q = BODY.neutral()
        q[7 + shoulder] += 0.2 * np.sin(2 * t)
        frames.append(BODY.markers_in_world(q))
    return Recording(time, np.array(frames), BODY.marker_set.labels)


def session_of(subject, folder):
    return open_run(
        create_session(folder),
        labels=subject.skeleton.marker_set.labels,
        joint_names=subject.skeleton.joint_names,
        rate=100,
        configuration={},
        subject={},
    )


class Recorder:
    """Keeps what a stream sends, as LabRecorder does: from its own inlet, raw."""

    def __init__(self, name):
        pylsl = lsl("a test", this_machine=True)
        (self.info,) = pylsl.resolve_byprop("name", name, 1, 10)
        self.inlet = pylsl.StreamInlet(self.info, recover=False)
        self.xml = self.inlet.info(10).as_xml()
        self.inlet.open_stream(10)
        self.samples, self.offsets = [], []
        self._offset()
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._pull)
        self._thread.start()

    def _offset(self):
        offset = self.inlet.time_correction(10)
        self.offsets.append((lsl("a test").local_clock(), offset))

    def _pull(self):
        while not self._done.is_set():
            try:
                sample, stamp = self.inlet.pull_sample(0.1)
            except RuntimeError:  # the stream has ended
                return
            if sample is not None:
                self.samples.append((stamp, sample))

    def stop(self):
        self._done.set()
        self._thread.join()

    def chunks(self, number):
        """The stream in the format that LabRecorder writes."""
        one = struct.pack("<I", number)
        content = struct.pack("<BI", 4, len(self.samples))
        for stamp, values in self.samples:
            content += struct.pack("<Bd", 8, stamp)
            for value in values:
                if isinstance(value, str):
                    text = value.encode()
                    content += struct.pack("<BI", 4, len(text)) + text
                else:
                    content += struct.pack("<d", value)
        return (
            chunk(2, one + self.xml.encode())
            + chunk(3, one + content)
            + b"".join(chunk(4, one + struct.pack("<dd", *o)) for o in self.offsets)
            + chunk(6, one + b"<?xml version='1.0'?><info></info>")
        )


def test_what_a_recorder_keeps_is_what_the_session_has(subject, name, tmp_path):
    exploring = moving(100)
    folder = tmp_path / "session"
    publisher = open_publisher(f"lsl:{name}", rate=100.0, simulated=True)
    recorders = [Recorder(name), Recorder(f"{name}-events")]
    with publisher, session_of(subject, folder) as session:
        with Source(Replay(exploring, speed=2)) as source:
            run(source, subject, SimulatedFinger(), session=session, listener=publisher)
    for each in recorders:
        each.stop()
    path = tmp_path / "lab.xdf"
    path.write_bytes(xdf(*(r.chunks(k + 1) for k, r in enumerate(recorders))))
    (signal, events), _ = pyxdf.load_xdf(path)
    kept = read_run(folder)

    # Every number is the session's: c and flexion have all digits there, residuals six
    # decimals.
    values = signal["time_series"]
    assert len(values) == len(kept.frame) == 100
    assert publisher.dropped == 0
    table = kept.model
    np.testing.assert_array_equal(values[:, 0], table["c"])
    np.testing.assert_array_equal(values[:, 1], table["flexion_asked"])
    np.testing.assert_array_equal(values[:, 2], table["state"])
    np.testing.assert_allclose(values[:, 3], table["residual"], atol=5.1e-7)

    # Both count from the event "start", 1 ms is what is promised.
    said = [row[0] for row in events["time_series"]]
    assert said[0].startswith("start: ")
    since = signal["time_stamps"] - events["time_stamps"][0]
    np.testing.assert_allclose(since, kept.receive_time, rtol=0, atol=1e-3)
    rows = [(onset, f"{kind}: {value}") for onset, _, kind, value in kept.events]
    assert said[1:] == [words for _, words in rows]
    onsets = events["time_stamps"][1:] - events["time_stamps"][0]
    np.testing.assert_allclose(onsets, [at for at, _ in rows], rtol=0, atol=1e-3)

    channels = signal["info"]["desc"][0]["channels"][0]["channel"]
    assert [c["label"][0] for c in channels] == ["c", "flexion", "state", "residual"]
    assert channels[3]["unit"] == ["meters"]
    about = signal["info"]["desc"][0]["acquisition"][0]
    assert about["simulated"] == ["yes"]
    assert events["info"]["type"] == ["Markers"]


DECISION = SimpleNamespace(
    solved=SimpleNamespace(
        c=np.array([0.5]), residual=0.001, q=np.zeros(31), uncertainty=np.zeros(1)
    ),
    flexions=(0.5,),
    state="active",
    rejection="",
    valid=True,
)


MARKERS = np.zeros((1, 3))


class Stuck:
    """Blocks in the first call until it is let go."""

    def __init__(self):
        self.go, self.got, self.closed = threading.Event(), 0, False

    def sample(self, at, values):
        self.go.wait()
        self.got += 1

    def event(self, at, words):
        self.sample(at, words)

    def close(self):
        self.closed = True


class Dying(Stuck):
    def sample(self, at, values):
        raise OSError("the cable is out.")


def test_a_sink_that_blocks_holds_nobody_up(monkeypatch):
    monkeypatch.setattr("ikns.live.publish.publisher._LAST", 0.05)
    sink, told, slowest = Stuck(), [], 0.0
    publisher = Publisher("x", sink, on_fault=told.append)
    for k in range(5000):
        began = time.perf_counter()
        publisher.decision(k / 100, DECISION, MARKERS)
        slowest = max(slowest, time.perf_counter() - began)
    publisher.event(50.0, "safe", "no pose")  # events still fit
    began = time.perf_counter()
    publisher.close()
    assert time.perf_counter() - began < 5  # 0.05 s, and a machine that is busy
    # A call that waited for the sink would never have come back.
    assert slowest < 1
    assert publisher.sent == 0
    assert publisher.dropped == 5001
    assert told == ["x: no longer published (it blocks)."]
    sink.go.set()


def test_after_a_jam_it_goes_on_and_says_how_many_are_missing():
    sink = Stuck()
    with Publisher("x", sink) as publisher:
        for k in range(3000):
            publisher.decision(k / 100, DECISION, MARKERS)
        sink.go.set()
    assert sink.closed
    assert sink.got == publisher.sent
    assert publisher.sent + publisher.dropped == 3000
    assert 1000 <= publisher.sent <= 1002
    assert publisher.fault == ""


def test_a_sink_that_dies_is_told_once_and_the_run_is_as_without(subject):
    exploring = moving(60)
    told, flexions = [], []
    for publisher in (None, Publisher("x", Dying(), on_fault=told.append)):
        with Source(Replay(exploring, speed=0)) as source:
            heard = []
            report = run(
                source,
                subject,
                listener=publisher,
                on_decision=lambda at, f, d, heard=heard: heard.append(f),
            )
        assert report.frames == 60
        flexions.append(heard)
    publisher.close()
    assert flexions[0] == flexions[1]
    assert told == ["x: no longer published (the cable is out)."]
    assert publisher.sent == 0  # not even the first event
    assert publisher.dropped >= 60


def test_a_name_that_is_taken_is_refused(files, name, capfd):
    argv = [
        *("run", "--subject", str(files / "person"), "--dry-run"),
        *("--source", f"replay:{files / 'free.c3d'}?speed=max"),
        *("--publish", f"lsl:{name}"),
    ]
    with open_publisher(f"lsl:{name}", rate=100.0):
        said = check_refused(argv, files, capfd)
    assert f"found {name} (MISC" in said or f"found {name}-events (Markers" in said
    # Nobody listens, and that is no fault.
    assert main([*argv, "--json"]) == 0
    result = json.loads(capfd.readouterr().out)
    assert result["published"]["dropped"] == 0
    assert result["published"]["sent"] > result["frames"]


def test_a_visit_publishes_its_trials(tmp_path, name):
    from ikns.experiments.conduct import Command, Conductor, TrackingExperiment
    from ikns.experiments.conduct.visit_log import VisitLog
    from ikns.experiments.tracking import schedule

    about = {"experiment": "tracking", "participant": "01", "simulated": True}
    steps = schedule(0, conditions=["keyboard"], training=0, seconds=12.0)
    with open_publisher(f"lsl:{name}", rate=0.0, n_dof=0) as publisher:
        recorder = Recorder(f"{name}-events")
        log = VisitLog(tmp_path / "visit", about)
        conductor = Conductor(
            TrackingExperiment(steps), log, on_event=publisher.visit_event
        )
        start = time.monotonic()
        conductor.add_sample(start, 0.5)
        conductor.submit(Command("begin"))
        for k in range(1710):
            conductor.add_sample(start + k / 100, 0.5)
            conductor.update(start + k / 100)
    recorder.stop()
    key = steps[0].key
    assert [text for _, (text,) in recorder.samples] == [
        f"trial begins: {key}",
        f"trial ends: 1 {key} done",
    ]
    # LSL's clock is time.monotonic, but for a constant of which this knows nothing.
    (begun, _), (ended, _) = recorder.samples
    lines = (tmp_path / "visit" / "log.jsonl").read_text().splitlines()
    logged = [json.loads(line)["time"] for line in lines]
    assert ended - begun == pytest.approx(logged[1] - logged[0], abs=1e-3)


def test_a_scope_that_cannot_be_had_is_refused(name, monkeypatch):
    lsl("a test", this_machine=True)
    monkeypatch.setattr("ikns.live.stream.lsl_library._this_machine", True)
    with pytest.raises(StreamError, match="has limited LSL to this machine"):
        open_publisher(f"lsl:{name}?scope=network", rate=100.0)
