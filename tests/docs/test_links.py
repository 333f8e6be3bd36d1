"""No dead links: in the pages as they are read in the repository, and in the site."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote

import pytest
from bs4 import BeautifulSoup
from markdown_it import MarkdownIt

from code_blocks import PAGES, ROOT
from dynident.effects import catalogue

pytestmark = pytest.mark.filterwarnings("ignore::bs4.XMLParsedAsHTMLWarning")


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


@pytest.mark.slow
def test_the_site_is_whole_without_a_network(tmp_path: Path) -> None:
    """Warnings of the build are errors; nothing is fetched; links inside lead somewhere."""
    build = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html"]
    folders = [str(ROOT / "docs"), str(tmp_path / "site"), "-d", str(tmp_path / "trees")]
    subprocess.run([*build, *folders], check=True, timeout=300)
    pages = {
        path: BeautifulSoup(path.read_text(), "html.parser")
        for path in (tmp_path / "site").rglob("*.html")
    }
    assert len(pages) > 20
    anchors = {
        path: {str(tag["id"]) for tag in page.find_all(id=True)} for path, page in pages.items()
    }
    for path, page in pages.items():
        fetched = [str(t["src"]) for t in page.find_all(["img", "script"], src=True)]
        fetched += [str(t["href"]) for t in page.find_all("link", href=True)]
        followed = [str(t["href"]) for t in page.find_all("a", href=True)]
        assert not [one for one in fetched if re.match(r"(https?:)?//", one)], path
        for one in (*fetched, *followed):
            name, _, anchor = unquote(one).partition("#")
            if re.match(r"(\w+:|//)", name):
                continue
            target = (path.parent / name.partition("?")[0]).resolve() if name else path
            assert target.exists(), f"{path.name}: {one}"
            if anchor and target in anchors and path.name not in ("search.html", "genindex.html"):
                assert anchor in anchors[target], f"{path.name}: {one}"
    catalogue_page = pages[tmp_path / "site/effects.html"]
    drawn = {Path(str(img["src"])).stem for img in catalogue_page.find_all("img")}
    own = {n for n, kind in catalogue().items() if kind.__module__.startswith("dynident.")}
    assert own <= drawn
