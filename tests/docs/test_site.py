"""The site: it builds, needs no network, and can be read on a desk and on a phone."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest
from bs4 import BeautifulSoup

from browsers import DESK, PHONE, Tab, needs_browser, opened, serious_faults
from code_blocks import ROOT
from dynident.effects import catalogue

STORIES = sorted((ROOT / "notebooks").glob("*.ipynb"))
WIDE = (
    *("effects", "symbols", "reference/study", "accuracy", "api"),
    *(f"_made/notebooks/{path.stem}" for path in STORIES),
)
TRIED = ("index", "first_robot", "reference/experiment", "benchmarks", "notebooks", WIDE[-2])
"""Pages with all that pages have, and short: axe-core takes its time by their length."""
COLOURED = ("index", "reference/experiment")
"""Where colours are tried on a phone, too: no style of the site lets them follow the width."""
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """The built site; warnings of the build are errors."""
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html"]
    folders = [str(ROOT / "docs"), str(folder / "html"), "-d", str(folder / "trees")]
    subprocess.run([*build, *folders], check=True, timeout=300)
    return folder / "html"


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, BeautifulSoup]:
    return {path: BeautifulSoup(path.read_text(), "html.parser") for path in site.rglob("*.html")}


def test_nothing_is_fetched_and_links_inside_lead_somewhere(pages) -> None:
    assert len(pages) > 20
    anchors = {path: {str(t["id"]) for t in page.find_all(id=True)} for path, page in pages.items()}
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


def test_every_effect_has_its_picture(site: Path, pages) -> None:
    drawn = {Path(str(img["src"])).stem for img in pages[site / "effects.html"].find_all("img")}
    own = {n for n, kind in catalogue().items() if kind.__module__.startswith("dynident.")}
    assert own <= drawn


def test_who_imports_whom_is_on_the_site_too(site: Path, pages) -> None:
    text = (ROOT / "docs" / "architecture.md").read_text()
    arrows = set(re.findall(r"^ +(\w+) --> (\w+)$", text, flags=re.MULTILINE))
    first = pages[site / "architecture.html"].find("table")
    rows = [[cell.text for cell in row.find_all("td")] for row in first.find_all("tr")[1:]]
    assert arrows == {(start, stop) for start, stops in rows for stop in stops.split(", ")}


@pytest.mark.parametrize("path", STORIES, ids=lambda path: path.stem[:2])
def test_notebooks_are_pages_with_their_pictures(site: Path, pages, path: Path) -> None:
    page = pages[site / "_made" / "notebooks" / f"{path.stem}.html"]
    cells = [one for one in json.loads(path.read_text())["cells"] if one["cell_type"] == "code"]
    data = [output.get("data", {}) for cell in cells for output in cell["outputs"]]
    assert len(page.select("div.cell_input")) == len(cells)
    drawn = page.select("div.cell_output img")
    assert len(drawn) == sum("image/png" in one and "text/html" not in one for one in data)


@needs_browser
@pytest.mark.parametrize("width", [PHONE, DESK])
def test_pages_fit_the_screen_and_have_no_serious_fault(site: Path, browser, width: int) -> None:
    """No page is wider than the screen; axe-core finds nothing critical or serious."""
    at = {name: (site / f"{name}.html").as_uri() for name in (*WIDE, *TRIED)}
    one = opened(browser, at["index"], width, Tab)
    for name, url in at.items():
        one.go(url)
        one.assert_fits()
        if name in TRIED:
            colours = width == DESK or name in COLOURED
            assert serious_faults(one.page, colours) == [], name
    one.page.context.close()
