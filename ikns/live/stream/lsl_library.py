"""Load the LSL library on first use, quiet, and optionally for this machine only.

liblsl reads its settings once, on first use; see
https://labstreaminglayer.readthedocs.io/info/lslapicfg.html for their names and files.
"""

from __future__ import annotations

import configparser
import io
import os
import platform
import sys
import threading
from pathlib import Path
from typing import Any

from ikns.live.stream.optional import load_client

_once = threading.Lock()
_library: Any = None
_this_machine = False


def lsl(needed_by: str, *, this_machine: bool = False) -> Any:
    """Return the module pylsl.

    Parameters
    ----------
    needed_by : str
        For the error message when pylsl is missing.
    this_machine : bool
        Search and announce streams on this machine only. The first call in a process
        decides, and a scope in a settings file takes precedence.

    Raises
    ------
    StreamError
        When pylsl is not installed.
    """
    global _library, _this_machine
    with _once:
        if _library is None:
            module = load_client("pylsl", needed_by=needed_by, remedy=_remedy())
            module.set_config_content(lsl_settings(this_machine=this_machine))
            _library, _this_machine = module, this_machine
        return _library


def _remedy() -> str:
    """Say what to install: PyPI's pylsl has no liblsl for Linux on ARM."""
    remedy = "pip install 'ikns[lsl]'"
    if (sys.platform, platform.machine()) == ("linux", "aarch64"):
        remedy += (
            ", and liblsl itself for this processor (conda-forge, or built from "
            "github.com/sccn/liblsl, with its path in PYLSL_LIB)"
        )
    return remedy


def only_this_machine() -> bool:
    """Whether LSL was started for this machine only."""
    return _this_machine


def lsl_settings(*, this_machine: bool) -> str:
    """Return the user's LSL settings, quiet unless they ask for a log.

    A lost stream is reported as an event; liblsl would print it too.
    """
    settings = configparser.ConfigParser(interpolation=None, strict=False)
    settings.optionxform = str  # type: ignore[assignment,method-assign]
    for path in _settings_files():
        if path.is_file():
            settings.read(path)
            break
    wanted = {("log", "level"): "-3"}
    if this_machine:
        wanted |= {
            ("multicast", "ResolveScope"): "machine",
            ("multicast", "ListenAddress"): "127.0.0.1",
            ("ports", "IPv6"): "disable",
            # Eight probes of the clock offset, 10 instead of 64 ms apart.
            ("tuning", "TimeProbeInterval"): "0.01",
        }
    for (section, option), value in wanted.items():
        if not settings.has_section(section):
            settings.add_section(section)
        if not settings.has_option(section, option):
            settings.set(section, option, value)
    text = io.StringIO()
    settings.write(text)
    return text.getvalue()


def _settings_files() -> list[Path]:
    """Return the settings files of liblsl, in its order."""
    named = os.environ.get("LSLAPICFG")
    return [
        *([Path(named)] if named else []),
        Path("lsl_api.cfg"),
        Path.home() / "lsl_api" / "lsl_api.cfg",
        Path("/etc/lsl_api/lsl_api.cfg"),
    ]
