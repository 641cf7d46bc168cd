"""The README is short; what it shows runs (see test_documentation.py)."""

from documentation import ROOT, blocks

README = ROOT / "README.md"


def test_set_up_is_two_commands() -> None:
    commands = [
        line
        for block in blocks("bash", pages=(README,))
        for line in block.text.splitlines()
    ]
    assert len(commands) == 2
    assert all(command.startswith("python3 -m venv ") for command in commands)


def test_it_takes_five_minutes() -> None:
    lines = README.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 120
    assert max(map(len, lines)) <= 120
    (block,) = blocks("python", pages=(README,))
    assert len([line for line in block.text.splitlines() if line]) <= 10
