"""The package itself: its help lists the public names in the order of the data."""

import re
from pathlib import Path

import ikns

STUB = Path(ikns.__file__).with_suffix(".pyi").read_text(encoding="utf-8")


def test_help_lists_every_public_name_in_the_order_of_the_stub() -> None:
    listed = re.findall(r"^    (\w+)  +\S", ikns.__doc__ or "", flags=re.MULTILINE)
    assert listed == re.findall(r" as (\w+)", STUB)
    assert sorted(listed) == sorted(ikns.__all__)


def test_help_and_stub_have_the_same_sections() -> None:
    titles = re.findall(
        r"^([A-Z]\w+)(?:: .*)?\n    \w", ikns.__doc__ or "", re.MULTILINE
    )
    assert titles == re.findall(r"^# (\w+)$", STUB, re.MULTILINE)
    line = ["Recording", "Skeleton", "Motion", "Map", "Control", "Finger"]
    assert titles[: len(line)] == line
