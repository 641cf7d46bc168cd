"""The package itself: its help lists the public names in the order of the data."""

import re
import tomllib
from pathlib import Path

import ikns

ROOT = Path(__file__).parents[1]
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


def test_version_and_its_date_are_the_same_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    cited = dict(
        re.findall(r"^(version|date-released): (\S+)$", citation, re.MULTILINE)
    )
    changes = (ROOT / "CHANGELOG.md").read_text("utf-8")
    headings = re.findall(r"^## \[(.+?)\](?: - (\S+))?$", changes, re.MULTILINE)
    assert headings[0] == ("Unreleased", "")
    newest = (cited["version"], cited["date-released"])
    assert headings[1] == newest == max(headings[1:], key=lambda each: each[1])
    assert ikns.__version__ == project["version"] == cited["version"]


def test_extras_are_for_users_and_groups_for_developers() -> None:
    written = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    extras = set(written["project"]["optional-dependencies"])
    assert not extras & set(written["dependency-groups"])
    named = {
        name
        for folder in ("ikns", "notebooks")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".py", ".md", ".ipynb")
        for names in re.findall(
            r"(?:\bikns|'\.)\[([a-z0-9,]+)\]'", path.read_text("utf-8")
        )
        for name in names.split(",")
    }
    assert {"docs", "lsl", "study"} <= named <= extras
