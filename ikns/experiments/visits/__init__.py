"""Visits on disk: what one participant did in one experiment, real or simulated.

A visit is a folder ``visits/[<variation>/]sub-<NN>_<experiment>`` of a study::

    visit.json             who, which design, simulated or not, which versions
    attempt-0001.parquet   one row: an attempt of a person, on disk when it ends
    attempts.parquet       or all of them at once: a virtual participant

Attempts are numbered from 1 in the order in which they were made; nothing is ever taken
out, and an attempt that is made again is a new one. Times are in s, c from 0 to 1.
Reading and writing needs ``pip install 'ikns[study]'``.
"""

from ikns.experiments.visits.folder import (
    FORMAT,
    VisitRecord,
    append_attempt,
    create_visit,
    list_visits,
    read_visit,
    write_attempts,
    write_visit,
)
from ikns.experiments.visits.parquet import table_bytes
from ikns.experiments.visits.rows import (
    EXPERIMENTS,
    counting,
    tracking_record,
    tracking_row,
)

__all__ = [
    "EXPERIMENTS",
    "FORMAT",
    "VisitRecord",
    "append_attempt",
    "counting",
    "create_visit",
    "list_visits",
    "read_visit",
    "table_bytes",
    "tracking_record",
    "tracking_row",
    "write_attempts",
    "write_visit",
]
