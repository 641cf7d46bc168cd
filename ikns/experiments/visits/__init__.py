"""Visits on disk: one participant in one experiment, real or simulated.

A visit is a folder ``visits/[<variation>/]sub-<NN>_<experiment>`` of a study::

    visit.json             participant, design, simulated or not, versions
    attempt-0001.parquet   one row: an attempt of a person, written when it ends
    attempts.parquet       or all rows at once: a virtual participant
    sums.sha256            then also checksums, for `sha256sum --check`

Attempts are numbered from 1 in the order in which they were made. None is ever removed;
repeating one adds another. Times are in s, c from 0 to 1. Reading and writing needs
``pip install 'ikns[study]'``.
"""

from ikns.experiments.visits.header import FORMAT
from ikns.experiments.visits.lock import visit_lock
from ikns.experiments.visits.parquet import table_bytes
from ikns.experiments.visits.reading import (
    VisitRecord,
    empty_visits,
    has_attempts,
    list_visits,
    read_visit,
)
from ikns.experiments.visits.rows import (
    EXPERIMENTS,
    counted_attempts,
    tracking_record,
    tracking_row,
)
from ikns.experiments.visits.writing import (
    append_attempt,
    create_visit,
    write_attempts,
    write_visit,
)

__all__ = [
    "EXPERIMENTS",
    "FORMAT",
    "VisitRecord",
    "append_attempt",
    "counted_attempts",
    "create_visit",
    "empty_visits",
    "has_attempts",
    "list_visits",
    "read_visit",
    "table_bytes",
    "tracking_record",
    "tracking_row",
    "visit_lock",
    "write_attempts",
    "write_visit",
]
