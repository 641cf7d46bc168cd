"""The calibration protocol with a person in front of live cameras.

`protocol` is the order of steps, without a screen or a clock; `verdict` says after each
step whether it is good enough; `guide` where the hand should go next; `folder` keeps
every recording; `procedure` ties them to a source of frames.
"""

from ikns.live.calibration.folder import RecordingsFolder
from ikns.live.calibration.guidance import Status
from ikns.live.calibration.guide import Guide, in_words
from ikns.live.calibration.judge import Judge
from ikns.live.calibration.procedure import (
    accepted_recordings,
    carry_out,
    check_labels,
    recall,
)
from ikns.live.calibration.protocol import Change, Key, LiveProtocol, Step, paper_steps
from ikns.live.calibration.verdict import Verdict

__all__ = [
    "Change",
    "Guide",
    "Judge",
    "Key",
    "LiveProtocol",
    "RecordingsFolder",
    "Status",
    "Step",
    "Verdict",
    "accepted_recordings",
    "carry_out",
    "check_labels",
    "in_words",
    "paper_steps",
    "recall",
]
