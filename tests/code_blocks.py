"""Code on pages of the documentation: what is run, and how what is printed is compared."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[1]
PAGES = sorted(
    path
    for path in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    if not {"_build", "_made"} & set(path.parts)
)


@dataclass(frozen=True)
class Typed:
    """A command on a page, with the lines that it prints and its exit status."""

    program: str
    arguments: list[str]
    printed: list[str]
    status: int


@dataclass(frozen=True)
class CodeBlock:
    """A fenced block of a page.

    Attributes
    ----------
    kind : its language.
    text : its lines.
    file : the name of a file that the paragraph before announces, as "`study.toml`:"; or empty.
    """

    kind: str
    text: str
    file: str

    def commands(self) -> Iterator[Typed]:
        """Yield each command of a console."""
        for one in re.split(r"^\$ ", self.text, flags=re.MULTILINE)[1:]:
            first, *printed = one.splitlines()
            program, *arguments = shlex.split(first, comments=True)
            yield Typed(program, arguments, printed, int("exit status 1" in first))


def blocks(page: Path) -> list[CodeBlock]:
    """Every fenced block of a page."""
    found, before = [], ""
    for token in MarkdownIt().parse(page.read_text()):
        if token.type == "inline":
            before = token.content
        if token.type == "fence":
            named = re.search(r"`([\w.]+\.\w+)`:$", before)
            kind = token.info.strip()
            found.append(CodeBlock(kind, token.content, named[1] if named else ""))
            before = ""
    return found


def told(output: str) -> str:
    """Output less its numbers, blanks and rules, however its lines are broken."""
    return " ".join(re.sub(r"\d[\d.e+-]*", "#", output).replace("─", "").split())
