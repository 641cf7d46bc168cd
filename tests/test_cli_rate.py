"""``ikns control --mode rate``."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import check_refused, read_csv

import ikns
from ikns.cli import main
from ikns.live.control import RateControl


def line(files: Path, out: Path, *more: str) -> list[str]:
    where = ["--subject", str(files / "person"), str(files / "free.c3d")]
    return ["control", *where, "--out", str(out), *more]


def test_rate_mode_writes_what_the_library_makes(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "control.csv"
    assert main(line(files, out, "--mode", "rate", "--json")) == 0
    result = json.loads(capsys.readouterr().out)
    found = read_csv(out)
    person = ikns.Subject.load(files / "person")
    motion = ikns.MarkerIK(person.skeleton).track(ikns.read(files / "free.c3d"))
    control = RateControl(person.null_space_map, person.skeleton, person.chain)
    expected = control.track(motion)
    # The file has 9 digits.
    np.testing.assert_allclose(found["c"], expected, rtol=1e-8)
    assert result["frames_without_signal"] == np.isnan(expected).sum()
    stopped = (expected == 0) | (expected == 1)
    known = np.isfinite(expected).sum()
    assert result["clipped_share"] == pytest.approx(stopped.sum() / known)


def test_the_default_is_the_position_mode(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plain, named = tmp_path / "plain.csv", tmp_path / "named.csv"
    assert main(line(files, plain)) == 0
    assert main(line(files, named, "--mode", "position")) == 0
    assert plain.read_bytes() == named.read_bytes()


def test_an_unknown_mode_is_refused(
    files: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    argv = line(files, tmp_path / "control.csv", "--mode", "impedance")
    assert "impedance" in check_refused(argv, tmp_path, capfd)
