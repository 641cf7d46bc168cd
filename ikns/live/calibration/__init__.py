"""The calibration protocol with a person in front of live cameras.

`protocol` has the order of steps, without a screen or a clock; `verdict` decides after
each step whether its recording is good enough; `targets` suggests positions for the
hand; `folder` keeps every recording; `procedure` connects them to a source of frames.
"""

from ikns.live.calibration.folder import RecordingsFolder
from ikns.live.calibration.guidance import CalibrationStatus
from ikns.live.calibration.judge import Judge
from ikns.live.calibration.procedure import (
    accepted_movement,
    accepted_recordings,
    check_labels,
    restore,
    run_protocol,
)
from ikns.live.calibration.protocol import (
    Change,
    Key,
    LiveProtocol,
    ProtocolStep,
    paper_steps,
)
from ikns.live.calibration.targets import TargetPoints, direction_in_words
from ikns.live.calibration.verdict import Verdict

__all__ = [
    "CalibrationStatus",
    "Change",
    "Judge",
    "Key",
    "LiveProtocol",
    "ProtocolStep",
    "RecordingsFolder",
    "TargetPoints",
    "Verdict",
    "accepted_movement",
    "accepted_recordings",
    "check_labels",
    "direction_in_words",
    "paper_steps",
    "restore",
    "run_protocol",
]
