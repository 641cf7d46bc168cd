"""What the pages show runs as it stands, or says what it needs."""

import importlib.util
import json
import re
import shutil
import tomllib
from pathlib import Path
from types import ModuleType

import pytest
import small_person
from documentation import PAGES, ROOT, Block, blocks

import ikns
from ikns.cli import main
from ikns.cli.app import command_parser
from ikns.recording.part import between

CONSOLE = blocks("console")
RUNNING = [block for block in blocks("console", "python") if not block.needs]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"][
    "optional-dependencies"
]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
#: Commands with commands of their own.
GROUPS = ("markers", "study")
#: Seconds of free movement; pages play it in real time.
SHORT = 3.0
#: Half a minute each; they have tests of their own.
SLOW = (["docs", "--pictures"], ["demo"])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """``ikns-demo`` as the demo leaves it, of a short protocol."""
    folder = tmp_path_factory.mktemp("desk") / "ikns-demo"
    (folder / "recordings").mkdir(parents=True)
    run = small_person.protocol()
    for trial in run.trials:
        small_person.write(folder / "recordings", trial.name, trial.recording)
    # Long enough to teach a natural posture, and short enough to be played.
    free = between(small_person.on_another_day(run.subject).free.recording, end=SHORT)
    (folder / "recordings" / "free.c3d").unlink()
    small_person.write(folder / "recordings", "free", free)
    small_person.subject().save(folder / "subject")
    return folder


def name(block: Block) -> str:
    return f"{block.page.stem}: {' '.join(block.commands[-1])[:60]}"


@pytest.mark.parametrize(
    "page", dict.fromkeys(block.page for block in RUNNING), ids=lambda page: page.stem
)
def test_the_blocks_of_a_page_run_as_printed(
    page: Path,
    recorded: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """One after the other, in a folder with nothing but what the demo wrote."""
    shutil.copytree(recorded, tmp_path / "ikns-demo")
    monkeypatch.chdir(tmp_path)
    for block in RUNNING:
        if block.page != page:
            continue
        if block.language == "python":
            exec(compile(block.text, str(page), "exec"), {})
            continue
        for line in block.commands:
            run(line, capfd)


def run(line: list[str], capfd: pytest.CaptureFixture[str]) -> None:
    program, *words = line
    if program == "ikns":
        if not any(words[: len(slow)] == slow for slow in SLOW):
            assert main(words) == 0, (line, capfd.readouterr().err)
    elif program == "python":
        option, code = words
        assert option == "-c", line
        exec(compile(code, "<page>", "exec"), {})


@pytest.mark.parametrize("block", CONSOLE, ids=name)
def test_every_command_and_option_shown_is_known(
    block: Block, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    for line in block.commands:
        program, *words = line
        if program == "pip":
            extras = re.findall(r"\[(.*)\]", line[-1])
            assert all(extra in EXTRAS for extra in ",".join(extras).split(",")), line
        elif program == "python":
            named = importlib.util.find_spec(words[1]) if words[0] == "-m" else None
            assert words[0] == "-c" or named or (ROOT / words[0]).is_file(), line
        else:
            assert program == "ikns", line
            command = words[:2] if words[0] in GROUPS else words[:1]
            assert main([*command, "--help"]) == 0, line
            text = capsys.readouterr().out
            for option in (word for word in words if word.startswith("--")):
                assert option.partition("=")[0] in text, line


def test_most_blocks_run_and_every_command_is_shown_somewhere() -> None:
    assert len(RUNNING) >= 10
    lines = [line for block in CONSOLE for line in block.commands]
    shown = {line[1] for line in lines if line[0] == "ikns"}
    commands = set(_commands())
    assert commands - shown <= {"demo"}  # which README's first block runs


def _commands() -> list[str]:
    return list(command_parser().commands)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_link_leads_to_a_file_and_pictures_are_small(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for link in re.findall(r"\]\((?!https?://|#)([^)#]+)", text):
        target = (page.parent / link).resolve()
        assert target.exists(), link
        if target.suffix in (".png", ".gif"):
            assert target.stat().st_size < 2_000_000


def test_links_to_files_lead_to_the_pages_made_of_them() -> None:
    pages = _pages()
    folder = ROOT / "notebooks" / "how_to"
    for given, made in {
        "[a](../../SAFETY.md#hazards)": "[a](../generated/safety.md#hazards)",
        "[a](desk.md)": "[a](desk.md)",
        "[a](../../README.md)": "[a](../index.md)",
        "[a](../../ikns/cli/app.py)": "a (`ikns/cli/app.py`)",
        "[a](https://example.org/SAFETY.md)": "[a](https://example.org/SAFETY.md)",
        "![a](../figures/elbow.gif)": "![a](../figures/elbow.gif)",
    }.items():
        assert pages.lead_to_pages(given, folder, folder) == made


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_picture_of_a_notebook_has_an_alternative_text(path: Path) -> None:
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if any("image/png" in out.get("data", {}) for out in cell.get("outputs", [])):
            assert cell["metadata"]["mystnb"]["image"]["alt"]


def test_pictures_of_the_pages_take_a_megabyte_at_most() -> None:
    sizes = [p.stat().st_size for p in (ROOT / "notebooks" / "figures").iterdir()]
    assert sum(sizes) < 1_000_000


def _pages() -> ModuleType:
    """The module that makes pages when the documentation is built."""
    spec = importlib.util.spec_from_file_location(
        "_pages", ROOT / "notebooks" / "_pages.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_of_commands_has_every_option_of_the_program(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    page = _pages().commands()
    for command in _commands():
        (section,) = re.findall(
            rf"^## ikns {command}\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL
        )
        main([command, "--help"])
        options = set(re.findall(r"--[a-z][a-z-]+", capsys.readouterr().out))
        assert options - {"--help"} <= set(re.findall(r"--[a-z][a-z-]+", section))


def test_the_pages_of_python_have_every_public_name_once_and_an_example() -> None:
    leading, *pages = _pages().api().values()
    described = [
        re.findall(r"^\.\. auto(?:class|function):: (\w+)$", page, re.MULTILINE)
        for page in pages
    ]
    # Each page, and the one that leads to them, lists what is described, in its order.
    linked = [re.findall(r"`~ikns\.(\w+)`", page) for page in (leading, *pages)]
    assert linked == [[name for page in described for name in page], *described]
    assert sorted(linked[0]) == sorted(ikns.__all__)
    for name in ikns.__all__:
        assert ">>> " in getattr(ikns, name).__doc__, name


def test_docs_opens_what_is_built_or_says_how(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    built = tmp_path / "build" / "docs" / "index.html"
    monkeypatch.setattr("ikns.cli.docs.__file__", str(tmp_path / "a" / "b" / "c.py"))
    assert main(["docs", "--no-open"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "sphinx-build" in said
    built.parent.mkdir(parents=True)
    built.write_text("<p>pages</p>")
    assert main(["docs", "--no-open"]) == 0
    assert str(built.resolve()) in capsys.readouterr().out.replace("\n", "")
