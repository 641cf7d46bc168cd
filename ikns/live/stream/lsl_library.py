"""The LSL library: brought in late, quiet, and kept to this machine where asked.

liblsl reads its settings once, when it is first used; see
https://labstreaminglayer.readthedocs.io/info/lslapicfg.html for their names and places.
"""

from __future__ import annotations

import configparser
import io
import os
import threading
from pathlib import Path
from typing import Any

from ikns.live.stream.optional import bring_in

__all__ = ["lsl", "lsl_settings"]

_once = threading.Lock()
_library: Any = None


def lsl(needed_by: str, *, this_machine: bool = False) -> Any:
    """Return the module pylsl.

    Parameters
    ----------
    needed_by : str
        For the message where pylsl is missing.
    this_machine : bool
        Look for streams and announce them on this machine only. The first call in a
        process decides, and a settings file that names a scope has the last word.

    Raises
    ------
    StreamError
        When pylsl is not installed.
    """
    global _library
    with _once:
        if _library is None:
            module = bring_in(
                "pylsl", needed_by=needed_by, remedy="pip install 'ikns[lsl]'"
            )
            module.set_config_content(lsl_settings(this_machine=this_machine))
            _library = module
        return _library


def lsl_settings(*, this_machine: bool) -> str:
    """Return the user's LSL settings, quiet unless they ask for a log.

    A lost stream is told by us, in one sentence; liblsl would print it as well.
    """
    settings = configparser.ConfigParser(interpolation=None, strict=False)
    settings.optionxform = str  # type: ignore[assignment,method-assign]
    for path in _places():
        if path.is_file():
            settings.read(path)
            break
    wanted = {("log", "level"): "-3"}
    if this_machine:
        wanted |= {
            ("multicast", "ResolveScope"): "machine",
            ("multicast", "ListenAddress"): "127.0.0.1",
            ("ports", "IPv6"): "disable",
            # Eight probes of the clock's offset, here 10 ms apart and not 64.
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


def _places() -> list[Path]:
    """Where liblsl itself would look, in its order."""
    named = os.environ.get("LSLAPICFG")
    return [
        *([Path(named)] if named else []),
        Path("lsl_api.cfg"),
        Path.home() / "lsl_api" / "lsl_api.cfg",
        Path("/etc/lsl_api/lsl_api.cfg"),
    ]
