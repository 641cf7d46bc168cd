"""Sessions: everything that happens in a run, on disk within a second.

A session is a Motion-BIDS dataset::

    SESSION/
      dataset_description.json  participants.tsv  participants.json  README.md
      sub-01/motion/
        sub-01_task-ikns_tracksys-markers_run-01_motion.tsv   recorded markers
        sub-01_task-ikns_tracksys-model_run-01_motion.tsv     results per frame
        sub-01_task-ikns_run-01_events.tsv                    events
        ..._motion.json  ..._channels.tsv  ..._channels.json
      sourcedata/sub-01/run-01/                               configuration, subject

Motion-BIDS: Jeung et al. 2024, Sci Data 11:716; the Brain Imaging Data Structure 1.10.
A motion file has one row per frame and no header; its columns are the rows of its
channels file. Missing values are ``n/a``.
"""

from ikns.live.session.channels import Channel, marker_channels, micro, model_channels
from ikns.live.session.check import check_session, mend_session
from ikns.live.session.dataset import (
    create_session,
    discard_run,
    next_run,
    open_run,
    session_lock,
)
from ikns.live.session.export import check_export, export_run
from ikns.live.session.reader import Run, read_run, runs
from ikns.live.session.writer import RunWriter

__all__ = [
    "Channel",
    "Run",
    "RunWriter",
    "check_export",
    "check_session",
    "create_session",
    "discard_run",
    "export_run",
    "marker_channels",
    "mend_session",
    "micro",
    "model_channels",
    "next_run",
    "open_run",
    "read_run",
    "runs",
    "session_lock",
]
