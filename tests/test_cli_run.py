import fcntl
import json
import os
import pty
import re
import signal
import struct
import subprocess
import sys
import termios
import time
import urllib.request
from dataclasses import replace

import pytest
from command_line import check_refused, contents

from ikns.cli import main
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
    assert main(["replay", str(session), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["run"] == 2


def test_a_table_for_people(files, capsys):
    assert main(run_argv(files, "--dry-run")) == 0
    out, _ = capsys.readouterr()
    assert "receipt to command" in out
    assert "disarmed to armed" in out


def on_a_terminal(argv, columns):
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
    assert process.returncode == 0, said
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
    lines = on_a_terminal(argv, 80)
    assert any("RUPA" in line and "mm" in line for line in lines), lines


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
        (["--duration", "0"], "expected a duration above 0 s"),
        (["--resume"], "--resume needs the --session"),
        (["--hold-speed", "-1"], "for --hold-speed, found -1"),
        (["--session", "{tmp}/s", "--participant", "Jane Doe"], "letters and digits"),
        (["--session", "{tmp}"], "exists already; use --resume"),
        (["--session", "{tmp}/none", "--resume"], "that `ikns run` recorded"),
        (["--subject", "{tmp}/nobody"], "expected a folder"),
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


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
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
    assert process.returncode == 0, err
    result = json.loads(out)
    assert result["transitions"][-1]["reason"] == "asked to stop"
    assert main(["replay", str(session)]) == 0


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
