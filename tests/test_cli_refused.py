"""What the first hours with the program ran into, each told in one sentence."""

from pathlib import Path

import pytest
from command_line import check_refused

from ikns.cli import main

Refused = pytest.CaptureFixture[str]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("convert {free} {free}", "one that is read as {free}"),
        ("check {free} {free}", "{free}: given twice; give each recording once."),
        ("ucm --subject {person} {free} {free}", "{free}: given twice"),
        ("study study", "found 'study'; see `ikns study --help`."),
        ("chek", "found 'chek'; did you mean 'check'? See `ikns --help`."),
        (
            "calibrate --static {static} --exploration {points} {points} --out new",
            "{points}: given twice for --exploration",
        ),
        (
            "calibrate --static {static} --exploration {points} --natural {free} "
            "--natural {free} --out new",
            "{free}: given twice for --natural",
        ),
    ],
)
def test_what_is_given_twice_is_not_called_empty(
    words: str, says: str, files: Path, capfd: Refused
) -> None:
    names = {name: str(files / f"{name}.c3d") for name in ("static", "points", "free")}
    names["person"] = str(files / "person")
    argv = [word.format(**names) for word in words.split()]
    assert says.format(**names) in check_refused(argv, files, capfd)


def test_a_static_trial_may_be_compared_with_itself(files: Path) -> None:
    static = str(files / "static.c3d")
    assert main(["check", "--static", static, static]) == 0
