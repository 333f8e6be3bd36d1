"""No dead links in the pages as they are read in the repository."""

from __future__ import annotations

import re
from functools import cache
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote

import pytest
from markdown_it import MarkdownIt

from code_blocks import PAGES, ROOT


def links(page: Path) -> list[str]:
    """What a page links to within the repository."""
    found = []
    for token in MarkdownIt().enable("table").parse(page.read_text()):
        for inner in token.children or ():
            found += [inner.attrs[key] for key in ("href", "src") if key in inner.attrs]
    return [str(one) for one in found if not re.match(r"https?:", str(one))]


@cache
def headings(page: Path) -> set[str]:
    """Anchors of a page's headings, as forges and the site make them."""
    tokens = MarkdownIt().parse(page.read_text())
    titles = [b.content for a, b in pairwise(tokens) if a.type == "heading_open"]
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_what_a_page_links_to_is_there(page: Path) -> None:
    for link in links(page):
        path, _, anchor = unquote(link).partition("#")
        target = page.parent / path if path else page
        assert target.exists(), link
        if anchor and target.suffix == ".md":
            assert anchor in headings(target), link


def test_every_page_is_reached_from_the_readme() -> None:
    seen, left = set(), [ROOT / "README.md"]
    while left:
        page = left.pop().resolve()
        if page not in seen:
            seen.add(page)
            targets = (page.parent / link.partition("#")[0] for link in links(page))
            left += [one for one in targets if one.suffix == ".md"]
    # The site's own front page, and what `make bench` writes.
    here = {page for page in PAGES if page.name not in ("index.md", "benchmarks.md")}
    assert here <= seen
