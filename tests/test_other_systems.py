"""Where something of Linux is missing, it is done without or said in a sentence.

What only Linux has is taken away here; that the rest works on macOS is not shown.
"""

import ast
import errno
import os
import sys
import tomllib
from pathlib import Path

import pytest

from ikns.errors import InvalidInput, StreamError
from ikns.finger import FingerError
from ikns.finger.inputs import Gamepad
from ikns.finger.serial_port import _exclude_others, port_error_text, port_holder
from ikns.live.runtime.priority import check_realtime, realtime_priority
from ikns.live.stream import loopback, lsl_library

ROOT = Path(__file__).parents[1]
#: Only Linux has these; each has to be named here with the file that does without.
ONLY_LINUX = {
    "sched_getscheduler": "ikns/live/runtime/priority.py",
    "sched_getparam": "ikns/live/runtime/priority.py",
    "sched_setscheduler": "ikns/live/runtime/priority.py",
    "sched_param": "ikns/live/runtime/priority.py",
    "SCHED_RR": "ikns/live/runtime/priority.py",
    "/proc": "ikns/finger/serial_port.py",
    "/proc/locks": "ikns/finger/serial_port.py",
    "/proc/self/fd": "ikns/live/stream/loopback.py",
    "/dev/input/js0": "ikns/finger/inputs.py",
}
#: Of these modules of Python, what macOS lacks too.
NOT_ON_MACOS = {
    *("sched_getaffinity", "sched_setaffinity", "sched_yield", "sched_getscheduler"),
    *("sched_getparam", "sched_setscheduler", "sched_param", "SCHED_RR", "SCHED_FIFO"),
    *("epoll", "inotify", "eventfd", "timerfd_create", "memfd_create", "pidfd_open"),
    *("posix_fallocate", "posix_fadvise", "copy_file_range", "O_TMPFILE", "O_DIRECT"),
    *("SIGRTMIN", "SIGRTMAX", "SIGPWR", "SIGPOLL", "SO_PEERCRED", "SO_BINDTODEVICE"),
    *("getresuid", "setresuid", "CLOCK_BOOTTIME", "F_OFD_SETLK", "prlimit"),
}
#: Folders that macOS has not.
PLACES = ("/proc", "/sys/", "/dev/input", "/dev/shm")


def what_only_linux_has(path):
    """Names and paths of Linux in a file's code, docstrings left out."""
    text = path.read_text("utf-8")
    if not any(word in text for word in (*NOT_ON_MACOS, *PLACES)):
        return
    tree = ast.parse(text)
    said = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in NOT_ON_MACOS:
            yield node.attr
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in said
            and node.value.startswith(PLACES)
        ):
            yield node.value


def test_what_only_linux_has_is_known():
    found = {
        (name, path.relative_to(ROOT).as_posix())
        for path in (ROOT / "ikns").rglob("*.py")
        for name in what_only_linux_has(path)
    }
    assert found == set(ONLY_LINUX.items())


def test_without_real_time_scheduling_it_is_refused_and_the_rest_works(monkeypatch):
    for name in ("sched_getscheduler", "sched_setscheduler", "SCHED_RR"):
        monkeypatch.delattr(os, name)
    with pytest.raises(InvalidInput, match="expected permission to run at real-time"):
        check_realtime()
    before = sys.getswitchinterval()
    with realtime_priority():
        assert sys.getswitchinterval() <= before
    assert sys.getswitchinterval() == before


class NoProc(type(Path())):
    """Paths of a system without /proc."""

    def __new__(cls, path):
        path = str(path)
        return Path("/nowhere" + path if path.startswith("/proc") else path)


def test_without_proc_nobody_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr("ikns.finger.serial_port.Path", NoProc)
    port = tmp_path / "port"
    port.touch()
    assert port_holder(str(port)) is None
    sentence = port_error_text(OSError(errno.EBUSY, "busy"), str(port))
    assert sentence == "another program uses this port, close it first"


def test_without_proc_an_outlet_says_that_it_is_open(monkeypatch):
    monkeypatch.setattr(loopback, "Path", NoProc)
    with loopback.only_from_this_machine() as open_ports:
        pass
    assert open_ports == [0]


def test_on_macos_ports_are_where_they_are_there(monkeypatch):
    missing = OSError(errno.ENOENT, "no such file")
    assert "/dev/serial/by-id" in port_error_text(missing, "/dev/x")
    monkeypatch.setattr(sys, "platform", "darwin")
    assert port_error_text(missing, "/dev/x") == "no such port, see ls /dev/cu.*"
    denied = port_error_text(OSError(errno.EACCES, "denied"), "/dev/x")
    assert "dialout" not in denied


@pytest.mark.parametrize(
    ("name", "excluded"),
    [
        ("/dev/ttys004", False),
        ("/dev/tty.usbserial-A1", True),
        ("/dev/cu.usbmodem1", True),
    ],
)
def test_on_macos_only_a_pseudo_terminal_stays_open_to_others(
    monkeypatch, name, excluded
):
    asked = []
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(os, "ttyname", lambda number: name)
    monkeypatch.setattr("fcntl.ioctl", lambda *request: asked.append(request))
    _exclude_others(7)
    assert bool(asked) == excluded


def test_on_arm_liblsl_is_named_as_what_is_missing(monkeypatch):
    monkeypatch.setattr(lsl_library, "_library", None)
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with pytest.raises(StreamError) as usual:
        lsl_library.lsl("lsl:NAME")
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    with pytest.raises(StreamError, match="liblsl itself for this processor"):
        lsl_library.lsl("lsl:NAME")
    assert "liblsl" not in str(usual.value)


def test_without_a_joystick_of_linux_it_is_said(tmp_path):
    with pytest.raises(FingerError, match="no gamepad there"):
        Gamepad(tmp_path / "js0")


def test_whoever_can_use_it_is_told_so():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    systems = {c for c in project["classifiers"] if c.startswith("Operating System")}
    # Wheels resolve on macOS, but nothing has been run there.
    assert systems == {"Operating System :: POSIX :: Linux"}
    # It has no wheel for Linux on ARM, where everything else of the base has one.
    assert not any("ezc3d" in name for name in project["dependencies"])
