import fcntl
import json
import math
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
import urllib.request
from dataclasses import replace

import numpy as np
import pytest
from command_line import check_refused, contents

from ikns.cli import main
from ikns.cli.run_status import _line
from ikns.live.runtime import LoopStatus
from ikns.live.session import read_run
from ikns.recording.files import read, write_c3d

PROGRAM = "import sys; from ikns.cli import main; sys.exit(main(sys.argv[1:]))"


def run_argv(files, *more):
    return [
        "run",
        "--subject",
        str(files / "person"),
        "--source",
        f"replay:{files / 'free.c3d'}?speed=max",
        *more,
    ]


def test_a_run_is_written_and_replays_bit_for_bit(files, tmp_path, capsys):
    session = tmp_path / "session"
    assert main(run_argv(files, "--session", str(session), "--json")) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["frames"] == 50
    assert result["frames_held"] is None  # without --hold-speed
    assert result["source"]["dropped"] == 0
    assert result["transitions"][-1]["after"] == "disarmed"
    out = tmp_path / "run.csv"
    assert main(["replay", str(session), "--export", str(out), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["same"]
    assert again["findings"] == []
    assert out.read_text().count("\n") == 51


def test_a_session_is_resumed_with_a_new_run(files, tmp_path, capsys):
    session = tmp_path / "session"
    assert main(run_argv(files, "--session", str(session), "--dry-run")) == 0
    before = contents(session)
    again = run_argv(files, "--session", str(session), "--resume", "--dry-run")
    assert main(again) == 0
    after = contents(session)
    assert all(after[name] == data for name, data in before.items())
    capsys.readouterr()
    assert main([*again, "--participant", "02"]) == 2
    assert "the session of participant 01, not of 02" in capsys.readouterr().err
    assert contents(session) == after
    assert main(["replay", str(session), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["run"] == 2


def test_a_table_for_people(files, capsys):
    assert main(run_argv(files, "--dry-run", "--hold-speed", "0.001")) == 0
    out, _ = capsys.readouterr()
    assert "receipt to command" in out
    assert "disarmed to armed" in out
    # The hand never rests; the first frame has no speed.
    held = re.search(r"frames held, hand faster than --hold-speed\W+(\d+)", out)
    assert held
    assert int(held[1]) == 49


def test_a_finger_held_for_a_fast_hand_says_so_in_the_line():
    status = LoopStatus(
        *(1.0, 100.0, 100, 0, 1e-3, 1e-3, 2e-3, "", True, 0.5, 0.5, 0.5, 0.01),
        state="active",
        q=np.zeros(7),
        too_fast=True,
    )
    assert "active   held: the hand is fast " in _line(status)
    assert "held" not in _line(replace(status, too_fast=False))


def on_a_terminal(argv, columns, code=0):
    """Lines written over each other on a terminal so many columns wide."""
    ours, theirs = pty.openpty()
    size = struct.pack("HHHH", 24, columns, 0, 0)
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, size)
    environment = {k: v for k, v in os.environ.items() if k != "COLUMNS"}
    said = b""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *argv],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=environment,
    ) as process:
        os.close(theirs)
        while True:
            try:
                said += os.read(ours, 4096)
            except OSError:  # nobody holds the other end any more
                break
    os.close(ours)
    assert process.returncode == code, said
    lines = re.split(r"\r\x1b\[K", said.decode())[1:]
    return [line.splitlines()[0] for line in lines]


@pytest.mark.parametrize("columns", [80, 160])
def test_the_line_on_a_terminal_says_how_it_goes(files, columns):
    argv = run_argv(files, "--dry-run")
    argv[argv.index("--source") + 1] = f"replay:{files / 'free.c3d'}"
    lines = on_a_terminal(argv, columns)
    assert len(lines) > 2
    assert max(map(len, lines)) < columns
    going = next(line for line in lines if line.startswith("active"))
    told = ["c ", "flexion ", "/s ", "p99 ", "residual ", " mm"]
    if columns == 160:
        told += ["worst ", "misses "]
    assert all(word in going for word in told), going
    assert "inside" in going.lower() or "outside" in going.lower()


def test_the_line_names_a_marker_that_is_astray(files, tmp_path):
    recording = read(files / "free.c3d")
    markers = recording.markers.copy()
    markers[:, recording.labels.index("RUPA"), 0] += 0.3
    write_c3d(tmp_path / "astray.c3d", replace(recording, markers=markers))
    argv = run_argv(files, "--dry-run")
    argv[argv.index("--source") + 1] = f"replay:{tmp_path / 'astray.c3d'}"
    lines = on_a_terminal(argv, 80, code=3)
    assert any("RUPA" in line and "mm" in line for line in lines), lines


def hidden_hand(files, folder, shown=slice(0, 0)):
    """A recording whose hand marker is hidden, except in some frames."""
    recording = read(files / "free.c3d")
    markers, column = recording.markers.copy(), recording.labels.index("RFIN")
    markers[:, column] = math.nan
    markers[shown, column] = recording.markers[shown, column]
    write_c3d(folder / "hidden.c3d", replace(recording, markers=markers))
    return folder / "hidden.c3d"


def test_a_run_that_never_moves_says_why_within_a_second(files, tmp_path, capfd):
    session = tmp_path / "session"
    argv = run_argv(files, "--session", str(session), "--duration", "1.0", "--json")
    argv[argv.index("--source") + 1] = f"replay:{hidden_hand(files, tmp_path)}?loop=yes"
    assert main(argv) == 3
    out, err = capfd.readouterr()
    result = json.loads(out)
    # Markers of the thorax are occluded in some frames, too.
    why = "the right hand is not visible"
    assert sum(result["rejections"].values()) == result["frames"]
    assert next(iter(result["rejections"])) == why
    assert all("right hand is not vis" in reason for reason in result["rejections"])
    notices = result["notices"]
    assert any(sentence.endswith(f": {why}.") for sentence in notices)
    # Each reason once, not with every frame.
    assert len(notices) == len({n.partition(": ")[2] for n in notices})
    number = result["rejections"][why]
    assert result["problem"].startswith(
        f"the finger never moved: {number} frames: {why}"
    )
    for sentence in (*notices, result["problem"]):
        assert f"ikns: {sentence}" in err
    told = [event for event in read_run(session).events if event[2] == "notice"]
    assert [event[3] for event in told] == notices
    # Half a second, and the 20 ms between two looks; the rest is a busy machine's.
    assert 0.5 <= told[0][0] <= 1.0


def test_a_run_that_is_over_too_soon_says_why_at_its_end(files, tmp_path, capfd):
    argv = run_argv(files, "--dry-run")
    argv[argv.index("--source") + 1] = (
        f"replay:{hidden_hand(files, tmp_path)}?speed=max"
    )
    assert main(argv) == 3
    out, err = capfd.readouterr()
    assert "frames: the right hand is not visible" in out
    last = err.splitlines()[-1].removeprefix("ikns: ")
    assert last.startswith("the finger never moved: ")
    assert "the finger never moved" not in out  # once


def test_a_run_that_ends_in_its_safe_state_says_so_at_once(files, tmp_path, capfd):
    # Ten frames are good; the watchdog takes half a second of the second that is left.
    recording = hidden_hand(files, tmp_path, slice(0, 10))
    argv = run_argv(files, "--json")
    argv[argv.index("--source") + 1] = f"replay:{recording}"
    assert main(argv) == 3
    out, err = capfd.readouterr()
    result = json.loads(out)
    (safe,) = (c for c in result["transitions"] if c["after"] == "safe")
    assert result["notices"] == [f"FINGER STOPPED: {safe['reason']}."]
    assert result["notices"][0] in err
    stayed = result["transitions"][-1]["time"] - safe["time"]
    assert (
        f"for the last {stayed:.1f} of {result['seconds']:.1f} s" in result["problem"]
    )
    assert "right hand is not visible" in result["problem"]


def test_the_help_names_the_exit_code(capfd):
    assert main(["run", "--help"]) == 0
    assert "Exits with 3" in capfd.readouterr().out


def test_a_replay_that_differs_says_so(files, tmp_path, capsys):
    session = tmp_path / "session"
    assert main(run_argv(files, "--session", str(session), "--dry-run")) == 0
    (path,) = session.rglob("*tracksys-markers*motion.tsv")
    rows = [line.split("\t") for line in path.read_text().splitlines()]
    for row in rows[10:]:
        row[3:] = [
            v if v == "n/a" else f"{float(v) + 0.01 * (i % 2):.6f}"
            for i, v in enumerate(row[3:])
        ]
    path.write_text("".join("\t".join(row) + "\n" for row in rows))
    capsys.readouterr()
    assert main(["replay", str(session), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["different"]["c"] > 0


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--source", "gopher:x"], "unknown source 'gopher:x'"),
        (["--finger", "gpio:7"], "unknown finger 'gpio:7'"),
        (["--finger", "dynamixel:/dev/none"], "no such port"),
        (["--duration", "0"], "--duration must be above 0, found 0."),
        (["--resume"], "--resume needs the --session"),
        (["--hold-speed", "-1"], "for --hold-speed, found -1"),
        (["--hold-speed", "0"], "--hold-speed must be above 0, found 0."),
        (["--max-uncertainty", "0"], "--max-uncertainty must be above 0, found 0."),
        (["--session", "{tmp}/s", "--participant", "Jane Doe"], "letters and digits"),
        (["--participant", "02"], "--participant needs the --session"),
        (["--session", "{tmp}"], "exists already; use --resume"),
        (["--session", "{tmp}/none", "--resume"], "that `ikns run` recorded"),
        (["--subject", "{tmp}/nobody"], "nobody: no such folder; give one"),
    ],
)
def test_bad_input_is_one_sentence(files, tmp_path, capfd, more, says):
    (tmp_path / "kept.txt").write_text("kept")
    given = [word.replace("{tmp}", str(tmp_path)) for word in more]
    assert says in check_refused(run_argv(files, *given), tmp_path, capfd)


@pytest.mark.parametrize("command", ["run", "track"])
def test_real_time_that_is_not_allowed_is_reported(
    files, tmp_path, capfd, monkeypatch, command
):
    def refuse(*_):
        raise PermissionError("Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    argv = run_argv(files, "--realtime")
    if command == "track":
        argv = ["track", str(tmp_path / "visit"), "--conditions", "ikns", *argv[1:]]
    assert "/etc/security/limits.conf" in check_refused(argv, tmp_path, capfd)


def test_a_source_without_the_labels_is_refused(files, data, tmp_path, capfd):
    argv = run_argv(files, "--source", f"replay:{data}/box_lift/markers_analogs.c3d")
    assert "expected markers" in check_refused(argv, tmp_path, capfd)


@pytest.mark.parametrize(
    "number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT]
)
def test_a_signal_ends_a_run_in_order(files, tmp_path, number):
    session = tmp_path / "session"
    argv = run_argv(files, "--session", str(session), "--json")
    argv[argv.index("--source") + 1] = f"replay:{files / 'free.c3d'}?loop=yes"
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *argv],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    ) as process:
        deadline = time.monotonic() + 120
        while time.monotonic() < deadline and process.poll() is None:
            rows = list(session.rglob("*tracksys-model*motion.tsv"))
            if rows and rows[0].stat().st_size > 2000:
                break
            time.sleep(0.05)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    result = json.loads(out)
    last = result["transitions"][-1]
    assert last["reason"] == "stop requested"
    # On a machine that is too busy the finger may be in its safe state by then.
    ended_safe = last["before"] == "safe"
    assert process.returncode == (3 if ended_safe else 128 + number), err
    assert "Traceback" not in err
    assert main(["replay", str(session)]) == 0


def test_a_stopped_finger_is_armed_again_with_a_key(files, tmp_path):
    argv = run_argv(files, "--duration", "60", "--json")
    argv[argv.index("--source") + 1] = f"replay:{files / 'free.c3d'}?loop=yes"
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", IN_FOREGROUND, *argv],
        stdin=theirs,
        stdout=subprocess.PIPE,
        stderr=theirs,
        start_new_session=True,
    ) as process:
        os.close(theirs)
        said = until(ours, "active ")
        os.write(ours, b"R")  # nothing is stopped yet
        os.kill(process.pid, signal.SIGSTOP)
        time.sleep(1.0)
        os.kill(process.pid, signal.SIGCONT)
        said = until(ours, "press Shift+R to arm again")
        # No pose, or no command for the finger: either may be noticed first.
        assert said.count("FINGER STOPPED: ") == 1
        os.write(ours, b"r\n")
        time.sleep(0.5)
        said = until(ours, "\x1b[K")
        assert "active " not in said
        os.write(ours, b"R")
        until(ours, "active ")
        os.kill(process.pid, signal.SIGSTOP)
        time.sleep(1.0)
        os.kill(process.pid, signal.SIGCONT)
        until(ours, "press Shift+R to arm again")
        os.write(ours, b"\x03")  # Ctrl-C
        result = json.loads(process.stdout.read())
        assert "FINGER STOPPED" not in until(ours, "the finger was in its safe state")
    os.close(ours)
    assert process.returncode == 3
    reached = [change["after"] for change in result["transitions"]]
    assert reached.count("armed") == 2
    assert reached[-2:] == ["safe", "disarmed"]


#: As a shell starts a command: the terminal is its own.
IN_FOREGROUND = (
    f"import fcntl, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); {PROGRAM}"
)


def until(terminal, words, seconds=120.0):
    """Read what a program prints until it says something; return all since then."""
    said, end = "", time.monotonic() + seconds
    while words not in said:
        assert time.monotonic() < end, said
        if select.select([terminal], [], [], 1.0)[0]:
            said += os.read(terminal, 4096).decode(errors="replace")
    return said


#: Ctrl-C, three times, as a module of this name begins to load.
CTRL_C_AT_IMPORT = """
import os, signal, sys
from ikns.cli import main

module, sys.argv[1:] = sys.argv[1], sys.argv[2:]

class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == module:
            print(name, file=sys.stderr)
            sys.meta_path.remove(self)
            for _ in range(3):
                os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Watch())
sys.exit(main())  # without arguments, as the console script calls it
"""


@pytest.mark.parametrize(
    "module", ["numpy", "ikns.cli.run", "pinocchio", "numba", "ikns.live.control"]
)
def test_ctrl_c_during_the_imports_is_no_traceback(files, module):
    argv = run_argv(files, "--json")
    done = subprocess.run(
        [sys.executable, "-c", CTRL_C_AT_IMPORT, module, *argv],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stderr.strip() == module
    assert done.returncode == 128 + signal.SIGINT


@pytest.mark.parametrize("to", ["stdout", "both"])
def test_output_that_no_one_reads_ends_it_without_a_word(files, to):
    argv = run_argv(files, "--dry-run", "--json")
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *argv],
        stdout=writing,
        stderr=writing if to == "both" else subprocess.PIPE,
        timeout=120,
    )
    os.close(writing)
    assert done.returncode == 128 + signal.SIGPIPE
    assert not done.stderr


def test_the_body_is_shown_live_on_this_machine(files, monkeypatch, capfd):
    seen = {}

    def look(url):
        # What a browser would ask for first, while the command runs.
        cookies = urllib.request.HTTPCookieProcessor()
        browser = urllib.request.build_opener(cookies)
        with browser.open(url, timeout=30) as page:
            seen[url] = page.read().decode()
        return True

    monkeypatch.setattr("webbrowser.open", look)
    argv = run_argv(files, "--dry-run", "--view", "--json")
    argv[argv.index("--source") + 1] = f"replay:{files / 'free.c3d'}"
    assert main(argv) == 0
    out, err = capfd.readouterr()
    assert json.loads(out)["frames"] == 50
    ((url, page),) = seen.items()
    assert url.startswith("http://127.0.0.1:")
    assert url in err
    assert "Live" in page
