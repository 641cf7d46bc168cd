"""Pages that are made when the documentation is built, so that nothing is copied."""

import os
import re
from functools import partial
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parent
MADE = HERE / "generated"
#: Files of the repository that are pages too.
INCLUDED = {
    "CONTRIBUTING.md": "contributing",
    "SAFETY.md": "safety",
    "CHANGELOG.md": "changelog",
    "benchmarks/README.md": "benchmarks",
    "urdf/README.md": "body",
}
_NAME = r"(?m)^    (\w+) +"  # in the package's help
LINK = re.compile(r"(?<!!)\[([^\]]+)\]\((?!https?://|#)([^)#\s]*)(#[^)\s]*)?\)")


def make_pages() -> None:
    """Write all of them."""
    MADE.mkdir(exist_ok=True)
    for source, name in INCLUDED.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        text = lead_to_pages(text, (ROOT / source).parent, MADE)
        _write(MADE / f"{name}.md", text)
    _write(MADE / "commands.md", commands())
    for name, text in api().items():
        _write(MADE / name, text)
    _write(MADE / "pages.css", style())


def _write(path: Path, text: str) -> None:
    """Leave a file that is right alone: Sphinx reads again what is newer."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def lead_to_pages(text: str, source: Path, page: Path) -> str:
    """Make links to files of the repository lead to the pages that are made of them.

    Links in the text are from the folder `source`; the page is in the folder `page`.
    What is no page is only named.
    """
    return LINK.sub(partial(_link, source=source, page=page), text)


def _link(found: re.Match[str], *, source: Path, page: Path) -> str:
    words, target, part = found[1], found[2], found[3] or ""
    path = (source / target).resolve()
    if not target or not path.is_relative_to(ROOT):
        return found[0]
    inside = path.relative_to(ROOT).as_posix()
    if inside in INCLUDED:
        path = MADE / f"{INCLUDED[inside]}.md"
    elif inside == "README.md":
        path = HERE / "index.md"
    elif not path.is_relative_to(HERE) or path.is_dir():
        return f"{words} (`{inside}`)"
    return f"[{words}]({os.path.relpath(path, page)}{part})"


def commands() -> str:
    """Make a page of every command with its arguments and options, from the program."""
    from ikns.cli.app import command_parser

    app = command_parser()
    parts = [
        "# Commands\n",
        "Exit codes: 0 done, 1 something recorded is not on disk, 2 bad input, 3 the "
        "finger was never active or ended in its safe state, 128 + n signal n.\n",
    ]
    for name in app.commands:
        parts += _command(app.commands[name], f"ikns {name}", 2)
    return "\n".join(parts)


def _command(command: Any, name: str, level: int) -> list[str]:
    own = [f"{'#' * level} {name}\n", _plain(command.help or ""), ""]
    context = command.make_context(name, [], resilient_parsing=True)
    rows = [_row(p, context) for p in command.params if p.name != "help"]
    if rows:
        own += ["| option | what it does |", "|---|---|", *rows, ""]
    for inner, sub in getattr(command, "commands", {}).items():
        own += _command(sub, f"{name} {inner}", level + 1)
    return own


def _row(option: Any, context: Any) -> str:
    taken, words = option.get_help_record(context)
    shown = taken.strip().replace("|", "\\|")
    return f"| `{shown}` | {_plain(words)} |".replace("\n", " ")


def _plain(text: str) -> str:
    return text.strip().replace("<", "\\<").replace("|", "\\|")


def style() -> str:
    """Let what goes on beyond an edge fade there, as in the package's reports."""
    report = (ROOT / "ikns" / "view" / "report.css").read_text(encoding="utf-8")
    (edges,) = re.findall(
        r"@keyframes edges \{.*?^\}$", report, re.DOTALL | re.MULTILINE
    )
    return (
        f":is(pre, .table-wrapper, .math > div):not(:focus-visible) {{\n"
        "  animation: edges linear both; animation-timeline: scroll(self inline);\n}\n"
        f"{edges}\n"
        "/* The formula in it scrolls, beside its number. */\n"
        ".math-wrapper { overflow: visible; }\n"
        "@media print { pre, .table-wrapper, .math > div { animation: none; } }\n"
    )


def api() -> dict[str, str]:
    """Make a page of each section of the package's help, and one that leads to them.

    Returns file names with their texts, in the order in which data pass.
    """
    import ikns

    sections = re.findall(
        r"^([A-Z]\w+)(?:: (.*))?\n((?:    .+\n)+)", ikns.__doc__ or "", re.MULTILINE
    )
    pages = {
        f"python_{title.lower()}.md": _section(title, what, lines)
        for title, what, lines in sections
    }
    parts = [
        "# Python\n",
        "Everything here is `from ikns import ...`, in the order in which data pass.\n",
    ]
    for title, what, lines in sections:
        heading = f"[{title}](python_{title.lower()}.md)"
        parts += [f"## {heading}\n", f"{what[0].upper()}{what[1:]}.\n" if what else ""]
        parts += [_names(lines)]
    listed = [f"{title} <python_{title.lower()}>" for title, _, _ in sections]
    parts += ["```{toctree}\n:hidden:\n", *listed, "```\n"]
    return {"python.md": "\n".join(parts)} | pages


def _section(title: str, what: str, lines: str) -> str:
    import ikns

    name = f"{title}: {what}" if what else title
    parts = [f"# {name}\n", _names(lines), "```{eval-rst}", ".. currentmodule:: ikns\n"]
    for name in re.findall(_NAME, lines):
        kind = "class" if isinstance(getattr(ikns, name), type) else "function"
        parts += [f".. auto{kind}:: {name}"]
        parts += ["   :members:\n" if kind == "class" else ""]
    return "\n".join([*parts, "```\n"])


def _names(lines: str) -> str:
    """Table of names with what each is, leading to where it is described."""
    rows = re.findall(rf"{_NAME}(.+)", lines)
    table = [f"| {{py:obj}}`~ikns.{name}` | {_plain(what)} |" for name, what in rows]
    return "\n".join(["| name | what it is |", "|---|---|", *table, ""])
