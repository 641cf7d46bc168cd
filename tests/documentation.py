"""The pages: README and those of the documentation, and the blocks in them."""

import re
import shlex
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PAGES = (
    ROOT / "README.md",
    *sorted(
        path
        for path in (ROOT / "notebooks").rglob("*.md")
        if not {"generated", "paper", "recordings"} & set(path.parts)
    ),
)
#: Above a block that a test cannot run; the words say what it takes.
BLOCK = re.compile(
    r"^(?:<!-- needs: ([^>]+?) -->\n+)?```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL
)


class Block(NamedTuple):
    """A block of code in a page."""

    page: Path
    language: str
    needs: str  # what running it takes beyond the package and its demo; or empty
    text: str

    @property
    def commands(self) -> list[list[str]]:
        """The words of each line, as a shell has them, without its prompt."""
        text = re.sub(r"^\$ ", "", self.text, flags=re.MULTILINE)
        lines = text.replace("\\\n", " ").splitlines()
        return [shlex.split(line) for line in lines if line]


def blocks(*languages: str, pages: tuple[Path, ...] = PAGES) -> list[Block]:
    return [
        Block(page, language, needs, text)
        for page in pages
        for needs, language, text in BLOCK.findall(page.read_text(encoding="utf-8"))
        if language in languages
    ]
