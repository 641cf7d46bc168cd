"""Start ``ikns`` many times from one process that has loaded everything already.

Reads a JSON object per line: ``{"warm": argv}`` runs a command here, so that children
find all modules and kernels loaded; ``{"start": argv, "out": path, "err": path}`` runs
one in a child with a session of its own; ``{"poll": pid}`` asks for its exit code. Only
loading is saved: from the first line of the command on, a child is what a user starts.
"""

import contextlib
import io
import json
import os
import signal
import sys
from importlib.metadata import entry_points

__all__: list[str] = []


def main() -> int:
    """Serve until the input is closed; in a child, return what the command returns."""
    (command,) = entry_points(group="console_scripts", name="ikns")
    run = command.load()
    for line in sys.stdin:
        asked, answer = json.loads(line), None
        if "warm" in asked:
            with contextlib.redirect_stdout(io.StringIO()):
                answer = run(asked["warm"])
        elif "poll" in asked:
            pid, status = os.waitpid(asked["poll"], os.WNOHANG)
            answer = os.waitstatus_to_exitcode(status) if pid else None
        else:
            answer = os.fork()
            if answer == 0:
                _become(asked)
                return int(run(asked["start"]) or 0)
        sys.stdout.write(json.dumps(answer) + "\n")
        sys.stdout.flush()
    return 0


def _become(asked: dict) -> None:
    """Take up the streams, the session and the signals of a program of its own."""
    os.setsid()
    streams = ((0, os.devnull, 0), (1, asked["out"], 1), (2, asked["err"], 1))
    for number, path, mode in streams:
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND if mode else os.O_RDONLY
        opened = os.open(path, flags, 0o600)
        os.dup2(opened, number)
        os.close(opened)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.argv[:] = ["ikns", *asked["start"]]


if __name__ == "__main__":
    sys.exit(main())
