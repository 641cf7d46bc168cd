"""Maps of several freedoms, live: solver, loop, session, replay, stream and command."""

import dataclasses
import json
import time

import numpy as np
import pytest
from command_line import check_refused
from test_two_servos import BUSY, servos_at

from ikns.body.chains import chain_joints
from ikns.body.skeleton import Skeleton
from ikns.calibration.subject import Subject
from ikns.calibration.subject_files import FILES
from ikns.cli import main
from ikns.errors import FileError, InvalidInput
from ikns.experiments.conduct.live import live_driver
from ikns.finger import FingerGroup, SimulatedFinger, open_fingers
from ikns.finger.emulator import Servo, Wire
from ikns.live.control.controller import Controller
from ikns.live.control.frame import FrameSolver
from ikns.live.control.recorded import control_table
from ikns.live.control.settings import ControlSettings
from ikns.live.publish import Publisher
from ikns.live.publish.lsl import _channels
from ikns.live.runtime import replay_run, run
from ikns.live.session import check_session, create_session, open_run, read_run
from ikns.live.session.channels import model_channels
from ikns.live.stream import Source
from ikns.live.stream.replay import Replay
from ikns.motion.marker_ik import MarkerIK
from ikns.nullspace.map import NullSpaceMap
from ikns.recording.files import write_c3d
from ikns.recording.recording import Recording

BODY = Skeleton.load()
#: Joints that the freedoms of each chain read, in a map that is written down.
READ = {
    "right_arm": ("right_shoulder_flexion", "right_forearm_pronation"),
    "both_arms": ("right_shoulder_flexion", "left_shoulder_flexion"),
}
FRAMES = 60
#: A busy machine may be late with its frames.
UNHURRIED = {"hold_after": 20.0, "safe_after": 20.0}


def subject(chain, n_dof=2):
    """A person whose outputs each read one joint, from -0.6 to 0.6 rad."""
    points = 0.3 * np.array(list(np.ndindex(2, 2, 2))) - [0.1, 0.7, -0.1]
    joints = chain_joints(chain)
    rows = np.eye(len(joints))[[joints.index(name) for name in READ[chain][:n_dof]]]
    ends = np.full((8, n_dof), 0.6)
    learned = NullSpaceMap.from_arrays(points, np.tile(rows, (8, 1, 1)), -ends, ends)
    return Subject(BODY, learned, chain, {})


def moving(chain, frames=FRAMES):
    """Markers of a body that moves both joints, each in its way, 50 per second."""
    time, markers = np.arange(frames) / 50, []
    first, second = (7 + BODY.joint_names.index(name) for name in READ[chain])
    for t in time:
        q = BODY.neutral()
        q[first] += 0.4 * np.sin(4 * t)
        q[second] += 0.4 * np.cos(3 * t)
        markers.append(BODY.markers_in_world(q))
    return Recording(time, np.array(markers), BODY.marker_set.labels)


def recorded(person, folder, tmp_path, group, settings, *, speed=2.0, **options):
    """Run the loop on the moving body with a session; return its report and run."""
    person.save(tmp_path / "person")
    texts = {
        name: (tmp_path / "person" / name).read_text()
        for name in FILES
        if (tmp_path / "person" / name).exists()
    }
    session = open_run(
        create_session(folder),
        labels=BODY.marker_set.labels,
        joint_names=BODY.joint_names,
        rate=50,
        n_dof=person.null_space_map.n_dof,
        configuration={"settings": settings.table()},
        subject=texts,
    )
    with session, Source(Replay(moving(person.chain), speed=speed)) as source:
        report = run(
            source, person, group, settings=settings, session=session, **options
        )
    return report, read_run(folder)


@pytest.mark.parametrize("chain", READ)
def test_two_freedoms_drive_two_servos_of_a_port_and_replay_bit_for_bit(
    chain, tmp_path
):
    person, servos = subject(chain), [Servo(id=k, baud=1_000_000) for k in (1, 2)]
    heard = []

    class Hears:
        def decision(self, received, decision, markers):
            heard.append(decision)

        def event(self, at, name, text):
            pass

    with Wire(*servos) as wire:
        at = f"dynamixel:{wire.port}?baud=1000000&watchdog=2.5"
        texts = [f"{at}&id=1", f"{at}&id=2&dof=2"]
        group = open_fingers(texts, n_dof=2, safety=BUSY)
        settings = ControlSettings(dofs=group.dofs, **UNHURRIED)
        report, session = recorded(
            person, tmp_path / "session", tmp_path, group, settings, listener=Hears()
        )
    assert report.problem == ""
    assert [servo.torque for servo in servos] == [False, False]
    model = session.model
    for k, servo in enumerate(servos, start=1):
        sent = model[f"flexion_{k}_sent"]
        # What the session says was sent is what the servo accepted, to the tick; it may
        # have got more between two frames, on the way to what was asked.
        ticks = {round(1024 + 2048 * flexion) for flexion in sent[np.isfinite(sent)]}
        goals = {goal for _, goal in servo.goals}
        assert len(goals & ticks) > 10
        asked = 1024 + 2048 * model[f"flexion_{k}_asked"]
        least, most = min(2048, np.nanmin(asked)), max(2048, np.nanmax(asked))
        assert round(least) <= min(goals) <= max(goals) <= round(most)
        # Half the range of c is 0.6 rad; the kernel's pose is within a few tenths of a
        # milliradian of the body that the markers were drawn from.
        angle = np.sin(4 * session.device_time) if k == 1 else None
        if angle is None:
            angle = np.cos(3 * session.device_time)
        expected = 0.5 + 0.4 * angle / 1.2
        np.testing.assert_allclose(model[f"c_{k}"], expected, atol=5e-3)
        asked = [decision.flexions[k - 1] for decision in heard]
        np.testing.assert_array_equal(asked, model[f"flexion_{k}_asked"])
    again = replay_run(session)
    names = ["c_1", "c_2", "flexion_1_asked", "flexion_2_asked", "state"]
    names += ["c_1_uncertainty", "c_2_uncertainty"]
    assert again.different == dict.fromkeys(names, 0)
    assert again.c.shape == again.flexion.shape == (FRAMES, 2)
    assert check_session(tmp_path / "session") == []
    # A replay notices each of them.
    for name in names:
        wrong = {**model, name: model[name] + 1}
        other = replay_run(dataclasses.replace(session, model=wrong))
        assert [n for n, count in other.different.items() if count] == [name]


@pytest.mark.parametrize("which", [1, 2])
def test_a_servo_that_fails_in_the_loop_stops_both(which, tmp_path):
    with servos_at("one port", tmp_path) as (servos, texts):
        group = open_fingers(texts, n_dof=2, safety=BUSY)
        settings, torque = ControlSettings(dofs=group.dofs, **UNHURRIED), []

        def fail(received, flexion, decision):
            torque.append([servo["torque_enable"] for servo in servos])
            if len(torque) == FRAMES // 3:
                servos[which - 1].request(do="alert", name="overheating")

        report, session = recorded(
            subject("right_arm"),
            tmp_path / "session",
            tmp_path,
            group,
            settings,
            speed=1.0,
            on_decision=fail,
        )
    assert torque[10] == [1, 1]
    assert torque[-1] == [0, 0]  # while the loop still ran
    reasons = ("the servo reports overheating", "the servo has lost its torque")
    assert report.stopped in [f"finger {which}: {reason}" for reason in reasons]
    assert replay_run(session).same


def test_a_signal_that_is_lost_holds_and_stops_all():
    """Without its markers the second signal is unknown, though the first is not."""
    person = subject("right_arm")
    hand = [BODY.marker_set.labels.index(name) for name in ("RWRA", "RWRB", "RFIN")]
    markers = moving("right_arm").markers.copy()
    markers[20:, hand] = np.nan
    states = {}
    for dofs in ((1,), (1, 2), (2, 1)):
        solver = FrameSolver(BODY, person.null_space_map, "right_arm")
        controller = Controller(solver, ControlSettings(dofs=dofs))
        controller.machine.arm(0.0)
        states[dofs] = []
        for k, one in enumerate(markers):
            made = controller.frame(one, k / 50, k / 50)
            if made.valid and made.state == "armed":
                controller.machine.activate(k / 50)
            states[dofs].append((made.state, made.rejection, made.flexions))
    assert states[(1, 2)] == states[(2, 1)]  # their order is not theirs
    assert states[(1,)][-1][0] == "active"
    # 40 frames of 20 ms are longer than half a second.
    assert [states[(1, 2)][k][0] for k in (19, 30, -1)] == ["active", "holding", "safe"]
    assert states[(1, 2)][-1][1] == "the right hand is not visible"
    assert states[(1, 2)][30][2] == states[(1, 2)][-1][2]  # both hold
    # What drives nothing has no flexion, and the first has the same with and without.
    assert np.isnan([flexions[1] for *_, flexions in states[(1,)]]).all()
    first = [[flexions[0] for *_, flexions in states[dofs]] for dofs in states]
    assert first[0][:20] == first[1][:20]


def test_names_agree_offline_live_in_sessions_and_streams():
    columns = [channel.name for channel in model_channels([], 2)]
    signals = [name for name in columns if name.startswith("c_") and name[2:].isdigit()]
    person, one = subject("right_arm"), moving("right_arm", 3)
    motion = MarkerIK(BODY).track(one)
    table = control_table(person, motion, recording=one)
    assert table.columns[1:3] == signals == ["c_1", "c_2"]
    assert table.columns[-2:] == ["c_1_uncertainty", "c_2_uncertainty"]
    assert set(table.columns[-2:]) <= set(columns)
    published = [name for name, _ in _channels(2)]
    assert published == ["c_1", "c_2", "flexion_1", "flexion_2", "state", "residual"]
    assert {f"{name}_asked" for name in published[2:4]} <= set(columns)


def test_with_one_freedom_every_name_is_what_it_was():
    # Written down from the version before several fingers.
    assert [channel.name for channel in model_channels(["elbow"])][7:] == [
        *("elbow", "hand_x", "hand_y", "hand_z", "c"),
        *("flexion_asked", "flexion_sent", "flexion_measured"),
        *("residual", "worst_residual", "intermarker_error", "c_uncertainty"),
        *("inside", "state", "solve_time", "latency"),
    ]
    points = {channel.tracked_point for channel in model_channels([])[10:]}
    assert points == {"n/a", "finger"}
    assert [name for name, _ in _channels(1)] == ["c", "flexion", "state", "residual"]
    assert "dofs" not in ControlSettings().table()
    kept = ControlSettings(dofs=(2, 1)).table()
    again = json.loads(json.dumps(kept))
    assert ControlSettings(**again) == ControlSettings(dofs=(2, 1))


def test_what_is_published_has_each_signal_and_flexion():
    sent = []

    class Sink:
        def sample(self, at, values):
            sent.append(values)

        def event(self, at, words):
            pass

        def close(self):
            pass

    person = subject("right_arm")
    settings = ControlSettings(dofs=(1, 2))
    decided = []
    with Publisher("here:", Sink()) as publisher:
        with Source(Replay(moving("right_arm", 5), speed=0)) as source:
            group = [SimulatedFinger(), SimulatedFinger()]
            run(
                source,
                person,
                FingerGroup(group),
                settings=settings,
                listener=publisher,
                on_decision=lambda *told: decided.append(told[2]),
            )
    assert [values.numbers[:4] for values in sent] == [
        (*made.solved.c.tolist(), *made.flexions) for made in decided
    ]


def test_an_experiment_reads_the_first_finger_and_the_panel_shows_all():
    person, fingers = subject("right_arm"), ["sim:dof=2", "sim:"]
    settings = ControlSettings(dofs=(2, 1))
    known: dict[str, object] = {}
    samples = []
    with live_driver(
        lambda: Source(Replay(moving("right_arm", 30))),
        person,
        finger=lambda: open_fingers(fingers, n_dof=2),
        settings=settings,
    ) as driver:
        while not driver.fault:
            known = {k: v for k, v in driver.status().items() if v is not None} | known
            samples += driver.take(time.monotonic())
            time.sleep(0.01)
    assert {"c_1", "flexion_1", "measured_1"} <= set(known)
    assert not {"c_2", "flexion_2"} & set(known)  # those of the trial: c, flexion
    read = [sample.c for sample in samples if np.isfinite(sample.c)]
    # The second joint begins at 0.4 rad, the first at 0, of 1.2 rad.
    assert read[0] == pytest.approx(0.5 + 0.4 / 1.2, abs=0.01)
    assert "finger 2" not in str(known["finger"])


def test_a_session_from_before_several_fingers_replays(tmp_path):
    settings = ControlSettings()
    _, session = recorded(
        subject("right_arm"), tmp_path / "s", tmp_path, None, settings, speed=0
    )
    old = {
        name.replace("c_", "c").replace("flexion_1_", "flexion_"): values
        for name, values in session.model.items()
        if "flexion_2" not in name
    }
    again = replay_run(dataclasses.replace(session, model=old))
    names = ["c1", "c2", "flexion_asked", "state", "c1_uncertainty", "c2_uncertainty"]
    assert again.different == dict.fromkeys(names, 0)
    del old["c2"]
    with pytest.raises(FileError, match="has no column 'c2'"):
        replay_run(dataclasses.replace(session, model=old))


def test_fingers_and_settings_must_name_the_same_freedoms():
    person, fingers = subject("right_arm"), open_fingers(["sim:", "sim:dof=2"])
    with Source(Replay(moving("right_arm", 2), speed=0)) as source:
        with pytest.raises(InvalidInput, match=r"expected fingers for the dofs"):
            run(source, person, fingers)
        with pytest.raises(InvalidInput, match="up to the map's 2, found 3"):
            run(source, person, settings=ControlSettings(dofs=(3,)))
    for wrong in ((), (0,), (1, 1)):
        with pytest.raises(InvalidInput, match="different dofs, counted from 1"):
            ControlSettings(dofs=wrong)


# --- the command ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def two(tmp_path_factory):
    """A folder with ``two``, a map of two freedoms, and ``moving.c3d``."""
    folder = tmp_path_factory.mktemp("two")
    subject("right_arm").save(folder / "two")
    write_c3d(folder / "moving.c3d", moving("right_arm"))
    return folder


def words(two, *more):
    source = f"replay:{two / 'moving.c3d'}?speed=max"
    return ["run", "--subject", str(two / "two"), "--source", source, *more]


def test_the_command_drives_two_fingers_and_its_session_replays(two, tmp_path, capsys):
    session = tmp_path / "session"
    fingers = ["--finger", "sim:", "--finger", "sim:dof=2&effort=0.3"]
    argv = words(two, *fingers, "--session", str(session), "--json")
    assert main(argv) == 0
    assert "no finger follows" not in capsys.readouterr().err
    about = read_run(session).configuration
    assert about["finger"] == ["sim:", "sim:dof=2&effort=0.3"]
    assert about["settings"]["dofs"] == [1, 2]
    assert main(["replay", str(session), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["same"]


@pytest.mark.parametrize(
    ("fingers", "said"),
    [
        ([], "no finger follows c_2;"),
        (["--finger", "sim:dof=2"], "no finger follows c_1;"),
    ],
)
def test_the_command_says_which_signal_no_finger_follows(two, capsys, fingers, said):
    assert main(words(two, "--dry-run", *fingers)) == 0
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "fingers", "said"),
    [
        ("run", ["sim:", "sim:"], "both ask for dof=1"),
        ("run", ["sim:dof=3"], "the map has 2 degrees of freedom"),
        (
            "run",
            ["dynamixel:/dev/z", "dynamixel:/dev/z?dof=2"],
            "are the same servo",
        ),
        ("track", ["sim:", "sim:dof=3"], "the map has 2 degrees of freedom"),
        ("pick", ["sim:", "sim:dof=1"], "both ask for dof=1"),
    ],
)
def test_the_command_refuses_fingers_that_cannot_be(
    two, tmp_path, capfd, command, fingers, said
):
    argv = words(two)
    if command != "run":
        argv[:1] = [command, str(tmp_path / "visit"), "--no-browser"]
        argv += ["--conditions", "ikns"]
    for finger in fingers:
        argv += ["--finger", finger]
    assert said in check_refused(argv, tmp_path, capfd)
