"""Visits on disk: every bit comes back, and nothing is lost or overwritten."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ikns.errors import FileError, InvalidInput
from ikns.experiments.tracking import (
    Attempt,
    TrackingRecord,
    TrackingStep,
    draw_profile,
)
from ikns.experiments.visits import (
    append_attempt,
    counted_attempts,
    create_visit,
    list_visits,
    read_visit,
    tracking_record,
    tracking_row,
    visit_lock,
    write_attempts,
)
from ikns.experiments.visits.parquet import read_rows, table_bytes
from ikns.experiments.visits.rows import COLUMNS

ABOUT = {"experiment": "tracking", "participant": "01", "simulated": True}
INTEGERS = st.integers(-(2**63), 2**63 - 1)
# Every double there is: NaN of any payload, both zeros, subnormals.
DOUBLES = INTEGERS.map(lambda bits: np.array(bits).view(np.float64).item())
# Text that UTF-8 holds.
TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
VALUES = {
    "int": INTEGERS,
    "float": DOUBLES,
    "text": TEXT,
    "series": arrays(np.int64, st.integers(0, 30)).map(lambda a: a.view(np.float64)),
}


def rows_of(experiment: str) -> st.SearchStrategy[list[dict]]:
    row = {name: VALUES[kind] for name, kind in COLUMNS[experiment].items()}
    return st.lists(st.fixed_dictionaries(row), max_size=4)


def bits(value: object) -> object:
    """What tells two doubles apart, be they NaN or zeros."""
    if isinstance(value, float | np.ndarray):
        return np.asarray(value, dtype=np.float64).tobytes()
    return value


def attempt_row(number: int, key: str = "a", outcome: str = "done") -> dict:
    row = dict.fromkeys(COLUMNS["tracking"], "")
    numbers = {"repeat": 0, "profile_seed": 0, "practised": 0}
    numbers |= {"seconds": 25.0, "align": 5.0, "time": [0.0], "c": [0.5]}
    return row | numbers | {"number": number, "key": key, "outcome": outcome}


@pytest.fixture
def visit(tmp_path: Path) -> Path:
    return create_visit(tmp_path / "visits" / "sub-01_tracking", ABOUT)


@pytest.mark.parametrize("experiment", ["tracking", "picking"])
@given(data=st.data())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_any_attempts_come_back_bit_for_bit(
    experiment: str, data: st.DataObject, tmp_path: Path
) -> None:
    rows = data.draw(rows_of(experiment))
    path = tmp_path / "a.parquet"
    path.write_bytes(table_bytes(experiment, rows))
    back = read_rows(path, experiment)
    assert [{k: bits(v) for k, v in row.items()} for row in back] == [
        {k: bits(v) for k, v in row.items()} for row in rows
    ]


def test_the_same_rows_make_the_same_bytes() -> None:
    rows = [attempt_row(1), attempt_row(2)]
    assert table_bytes("tracking", rows) == table_bytes("tracking", rows)


def test_a_recorded_trial_comes_back_as_it_was(visit: Path) -> None:
    step = TrackingStep("trial", "ikns", "T2", seed=7, repeat=1, seconds=20.0)
    profile = draw_profile("T2", 7, seconds=20.0)
    time = np.linspace(-5, 20, 2501)
    c = np.random.default_rng(0).normal(size=2501)
    c[::7] = np.nan
    record = TrackingRecord(profile, time, profile.at(time), c, "aborted", "a cough")
    attempt = Attempt(step.key, "aborted", "a cough", record)
    append_attempt(visit, tracking_row(1, step, attempt, align=5.0, practised=12))
    (row,) = read_visit(visit).attempts
    back = tracking_record(row)
    for name in ("time", "target", "c", "y"):
        assert getattr(back, name).tobytes() == getattr(record, name).tobytes()
    assert (back.state, back.reason) == ("aborted", "a cough")
    assert (row["practised"], row["align"], row["repeat"]) == (12, 5.0, 1)


def test_a_skipped_step_has_no_samples(visit: Path) -> None:
    step = TrackingStep("trial", "ikns", "T1")
    attempt = Attempt(step.key, "skipped", "tired")
    append_attempt(visit, tracking_row(1, step, attempt, align=5.0, practised=0))
    (row,) = read_visit(visit).attempts
    assert len(row["time"]) == len(row["c"]) == 0
    with pytest.raises(InvalidInput, match="expected an attempt at ikns/trial/T1/0"):
        tracking_row(1, step, Attempt("other", "done"), align=5.0, practised=0)


def test_one_file_or_many_read_alike_in_the_order_of_numbers(tmp_path: Path) -> None:
    rows = [attempt_row(k, key=str(k)) for k in range(1, 13)]
    one, many = (create_visit(tmp_path / name, ABOUT) for name in ("a", "b"))
    write_attempts(one, rows)
    for row in reversed(rows):
        append_attempt(many, row)
    numbers = [[r["number"] for r in read_visit(f).attempts] for f in (one, many)]
    assert numbers == [list(range(1, 13))] * 2


def test_more_columns_and_no_attempts_at_all_come_back(tmp_path: Path) -> None:
    more = {"why": "slip", "grip_n": 3.5, "tries": 2, "held": True}
    one = create_visit(tmp_path / "a", ABOUT)
    write_attempts(one, [attempt_row(1) | more])
    assert {k: read_visit(one).attempts[0][k] for k in more} == more
    none = create_visit(tmp_path / "b", ABOUT)
    write_attempts(none, [])
    assert read_visit(none).attempts == []


def test_no_attempt_and_no_visit_is_overwritten(visit: Path) -> None:
    append_attempt(visit, attempt_row(1))
    before = {p.name: p.read_bytes() for p in visit.iterdir()}
    with pytest.raises(InvalidInput, match="no attempt is overwritten"):
        append_attempt(visit, attempt_row(1, outcome="aborted"))
    with pytest.raises(InvalidInput, match=r"one that holds attempt-0001\.parquet"):
        create_visit(visit, ABOUT)
    (visit.parent / "file").touch()
    with pytest.raises(InvalidInput, match="name of a folder, found a file"):
        create_visit(visit.parent / "file", ABOUT)
    assert {p.name: p.read_bytes() for p in visit.iterdir()} == before


def test_unfinished_files_are_ignored(visit: Path, tmp_path: Path) -> None:
    append_attempt(visit, attempt_row(1))
    (visit / ".attempt-0002.parquet.99.part").write_bytes(b"PAR1 half")
    assert len(read_visit(visit).attempts) == 1
    # A visit whose own table was not finished is begun anew.
    torn = tmp_path / "torn"
    torn.mkdir()
    (torn / ".visit.json.99.part").write_text("{")
    create_visit(torn, ABOUT)
    assert read_visit(torn).attempts == []


def test_visits_are_listed_without_and_then_with_variation(visit: Path) -> None:
    study = visit.parents[1]
    other = create_visit(study / "visits" / "gate" / "sub-01_tracking", ABOUT)
    second = create_visit(study / "visits" / "sub-02_tracking", ABOUT)
    hidden = study / "visits" / ".sub-03_tracking.part"
    create_visit(hidden, ABOUT)
    create_visit(study / "visits" / ".hidden" / "sub-01_tracking", ABOUT)
    (study / "visits" / "sub-04_tracking").mkdir()
    assert list_visits(study) == [visit, second, other]
    with pytest.raises(FileError, match="no such folder; give the folder of a study"):
        list_visits(study / "none")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"format": 2}, "expected a visit of format 1, found 2"),
        ({"experiment": "juggling"}, "of tracking, picking, found juggling"),
        ({"participant": 1}, "a participant as text, found 1"),
        ({"simulated": "no"}, "simulated true or false, found no"),
    ],
)
def test_what_is_not_a_visit_of_this_format_is_refused(
    change: dict, sentence: str, visit: Path
) -> None:
    place = visit / "visit.json"
    place.write_text(json.dumps(json.loads(place.read_text()) | change))
    with pytest.raises(FileError, match=sentence):
        read_visit(visit)
    if "format" not in change:  # which a new visit is given
        with pytest.raises(InvalidInput, match=sentence):
            create_visit(visit.parent / "new", ABOUT | change)


def test_missing_and_damaged_files_are_named(visit: Path) -> None:
    for k in (1, 2, 3):
        append_attempt(visit, attempt_row(k))
    with pytest.raises(FileError, match="a visit of picking, found tracking"):
        read_visit(visit, experiment="picking")
    second = visit / "attempt-0002.parquet"
    whole = second.read_bytes()
    second.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(FileError, match=r"attempt-0002\.parquet: cannot be read"):
        read_visit(visit)
    second.unlink()
    with pytest.raises(FileError, match="1 to 3, found number 2 missing"):
        read_visit(visit)
    second.write_bytes((visit / "attempt-0001.parquet").read_bytes())
    with pytest.raises(FileError, match="1 to 3, found number 1 twice"):
        read_visit(visit)
    for content in ("{", "[]"):
        (visit / "visit.json").write_text(content)
        with pytest.raises(FileError, match=r"visit\.json: (cannot|expected a table)"):
            read_visit(visit)
    (visit / "visit.json").unlink()
    assert list_visits(visit.parents[1]) == [visit]
    with pytest.raises(FileError, match=r"visit\.json is missing"):
        read_visit(visit)
    with pytest.raises(FileError, match=r"visit\.json is missing"):
        append_attempt(visit, attempt_row(4))


def test_rows_of_another_experiment_are_refused(visit: Path) -> None:
    lacking = attempt_row(1)
    del lacking["c"]
    with pytest.raises(InvalidInput, match="found c missing"):
        append_attempt(visit, lacking)
    with pytest.raises(InvalidInput, match="float in the column seconds"):
        append_attempt(visit, attempt_row(1) | {"seconds": "long"})
    with pytest.raises(InvalidInput, match="a value in the column reason"):
        append_attempt(visit, attempt_row(1) | {"reason": None})
    with pytest.raises(InvalidInput, match="found more in some only"):
        write_attempts(visit, [attempt_row(1), attempt_row(2) | {"more": 1}])
    assert [p.name for p in visit.iterdir()] == ["visit.json"]
    picking = {name: "" for name in COLUMNS["picking"]}
    picking |= {"number": 1, "repeat": 0, "practised": 0, "time": 3.0, "limit": 20.0}
    (visit / "a.parquet").write_bytes(table_bytes("picking", [picking]))
    with pytest.raises(FileError, match="in the column trajectory, found none"):
        read_visit(visit)


def test_nothing_but_json_goes_into_the_table(tmp_path: Path) -> None:
    for value in (float("nan"), {1, 2}):
        with pytest.raises(InvalidInput, match="text, numbers and lists"):
            create_visit(tmp_path / "a", ABOUT | {"seed": value})
    assert not (tmp_path / "a").exists()


def test_the_last_final_attempt_at_each_step_counts() -> None:
    went = [
        ("a", "done"),
        ("b", "aborted"),
        ("c", "skipped"),
        ("a", "again"),
        ("b", "timeout"),
        ("d", "success"),
        ("a", "done"),
        ("d", "again"),
        ("e", "aborted"),
    ]
    rows = [attempt_row(k, key, out) for k, (key, out) in enumerate(went, start=1)]
    assert [row["number"] for row in counted_attempts(rows)] == [3, 5, 7]


# --- several programs at once ---------------------------------------------------------

WRITES = """
import json, sys
from ikns.errors import InvalidInput
from ikns.experiments.visits import append_attempt
folder, row = sys.argv[1], json.loads(sys.argv[2])
sys.stdin.readline()  # all begin together
for number in range(1, 21):
    try:
        append_attempt(folder, row | {"number": number})
        print(number)
    except InvalidInput as error:
        assert "no attempt is overwritten" in str(error)
"""


def test_an_attempt_number_is_given_to_one_of_several_processes(visit: Path) -> None:
    rows = [attempt_row(1, key=f"writer {k}") for k in range(3)]
    running = [
        subprocess.Popen(
            [sys.executable, "-c", WRITES, str(visit), json.dumps(row)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for row in rows
    ]
    for process in running:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    told = {}
    for k, process in enumerate(running):
        out, _ = process.communicate(timeout=300)
        assert process.returncode == 0
        for number in map(int, out.split()):
            assert number not in told, "two were told that they wrote it"
            told[number] = f"writer {k}"
    attempts = read_visit(visit).attempts
    assert {row["number"]: row["key"] for row in attempts} == told
    assert len(told) == 20


HOLDS = """
import sys, time
from ikns.experiments.visits import visit_lock
with visit_lock(sys.argv[1]):
    print("held", flush=True)
    sys.stdin.readline()
"""


def test_a_visit_is_conducted_by_one_process(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "visits" / "sub-01_tracking"
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDS, str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(InvalidInput) as refused, visit_lock(folder):
            pass
        assert f"process {holder.pid} on {os.uname().nodename}" in str(refused.value)
        assert "wait until it ends" in str(refused.value)
        create_visit(folder, ABOUT)  # which the lock file does not disturb
        holder.kill()
    # The lock of a process that was killed is taken over, and that is said.
    with visit_lock(folder):
        append_attempt(folder, attempt_row(1))
    said = capsys.readouterr().err
    assert f"was still locked by process {holder.pid}, which has ended" in said
    assert said.count("\n") == 1
    assert {p.name for p in folder.iterdir()} == {"visit.json", "attempt-0001.parquet"}
    with visit_lock(folder):
        pass
    assert capsys.readouterr().err == ""


def test_a_visit_in_which_nothing_was_written_leaves_no_folder(tmp_path: Path) -> None:
    folder = tmp_path / "study" / "visits" / "sub-01_tracking"
    with pytest.raises(KeyError), visit_lock(folder):
        raise KeyError
    assert list(tmp_path.iterdir()) == []
    with visit_lock(folder):
        create_visit(folder, ABOUT)
    assert list_visits(tmp_path / "study") == [folder]
