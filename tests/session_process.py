"""Write a session until killed: ``session_process.py SESSION``; numbers to stdout."""

import sys
import time
from pathlib import Path

from ikns.live.session import open_run
from ikns.live.session.channels import model_channels


def main(session: Path) -> None:
    run = open_run(
        session,
        labels=["A", "B"],
        joint_names=["elbow"],
        rate=100,
        configuration={},
        subject={"map.json": "{}"},
    )
    figures = [0.5] * (len(model_channels(["elbow"])) - 4)
    start = time.monotonic()
    frame = 0
    while True:
        now = time.monotonic() - start
        run.row("markers", [frame, now, now, *[0.1 * k for k in range(6)]])
        run.row("model", figures + [1.0, 2.0, 0.0, 0.0])
        if frame % 50 == 0:
            run.row("events", [now, 0.0, "tick", str(frame)])
        sys.stdout.write(f"{frame} {now}\n")
        sys.stdout.flush()
        frame += 1
        time.sleep(max(0.0, start + frame / 100 - time.monotonic()))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
