"""The site: `make docs` builds it into docs/_build/html, which opens without a network."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path[:0] = [str(HERE), str(ROOT / "toolkit")]

project = "dynident"
copyright = "the authors of dynident, BSD-3-Clause"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "dynident"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
suppress_warnings = ["ref.python"]  # `n` of several classes, in shapes
myst_heading_anchors = 3
smartquotes = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False


def setup(app: Any) -> None:
    """Join the steps of this site to a build."""
    app.connect("builder-inited", _draw)
    app.connect("source-read", _for_the_site)
    app.connect("html-page-context", _for_everybody, priority=900)  # after the theme
    app.connect("autodoc-process-docstring", _as_numpydoc, priority=400)  # before napoleon


def _draw(app: Any) -> None:
    """Draw the pictures that are made with the site."""
    from effect_pictures import write_pictures

    write_pictures(HERE / "_made" / "effects")


def _for_the_site(app: Any, docname: str, source: list[str]) -> None:
    """Leave out of a page what only a forge shows: Mermaid, and links to folders of the source.

    What only the site has is put in: pictures that are made with it.
    """
    text = re.sub(r"```mermaid\n.*?```\n", "", source[0], flags=re.DOTALL)
    text = re.sub(
        r"<!-- picture of (\w+) -->", r"![\1 in the residual](_made/effects/\1.png)", text
    )
    if not (HERE / "benchmarks.md").exists():  # `make bench` writes it
        text = text.replace("\nbenchmarks\n", "\n")
    folder = Path(app.env.doc2path(docname)).parent

    def link(found: re.Match[str]) -> str:
        target = (folder / found[2].partition("#")[0]).resolve()
        stays = target.is_relative_to(HERE) or target.is_file()  # which goes along as a download
        return found[0] if stays else found[1]

    source[0] = re.sub(r"(?<!!)\[([^\]]+)\]\(((?!\w+:|#)[^)\s]+)\)", link, text)


def _for_everybody(app: Any, page: str, template: str, context: dict[str, Any], tree: Any) -> None:
    """Let code that is wider than the screen be scrolled by keys, and headings have their level."""
    context["body"] = context.get("body", "").replace("<pre>", '<pre tabindex="0">')
    heading = 'role="heading"'
    for name in ("furo_navigation_tree", "toctree"):
        if isinstance(context.get(name), str):
            context[name] = context[name].replace(heading, f'{heading} aria-level="2"')


def _as_numpydoc(
    app: Any, what: str, name: str, found: Any, options: Any, lines: list[str]
) -> None:
    """Put a docstring of this project into the words of reStructuredText.

    What stands behind `name :` in its lists is a meaning, not a type; `|x|` and single backquotes
    are text.
    """
    said = []
    for line in lines:
        parts = re.split(r"(`[^`]+`)", line)
        plain = "".join(
            f"`{part}`" if part.startswith("`") else part.replace("|", "\\|").replace("*", "\\*")
            for part in parts
        )
        key = re.match(r"([\w\\*]+(?:, [\w\\*]+)*) : (.+)", plain)
        said += [key[1], f"    {key[2]}"] if key else [plain]
    lines[:] = said
