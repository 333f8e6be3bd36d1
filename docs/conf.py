"""The site: `make docs` builds it into docs/_build/html, which opens without a network."""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
NOTEBOOKS = HERE / "_made" / "notebooks"
sys.path[:0] = [str(HERE), str(ROOT / "toolkit")]

project = "dynident"
copyright = "the authors of dynident, BSD-3-Clause"
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
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
nb_execution_mode = "off"  # as they were run, and are tested to run
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False


def setup(app: Any) -> None:
    """Join the steps of this site to a build."""
    app.connect("builder-inited", _bring_notebooks)
    app.connect("builder-inited", _draw)
    app.connect("source-read", _for_the_site)
    app.connect("html-page-context", _for_everybody, priority=900)  # after the theme
    app.connect("autodoc-process-docstring", _as_numpydoc, priority=400)  # before napoleon


def _bring_notebooks(app: Any) -> None:
    """Copy the notebooks into the site, with their links as they are from there."""
    NOTEBOOKS.mkdir(parents=True, exist_ok=True)
    for path in sorted((ROOT / "notebooks").glob("*.ipynb")):
        notebook = json.loads(path.read_text(encoding="utf-8"))
        for cell in notebook["cells"]:
            if cell["cell_type"] == "markdown":
                cell["source"] = _with_links("".join(cell["source"]), path.parent, NOTEBOOKS)
        text, made = json.dumps(notebook), NOTEBOOKS / path.name
        if not made.exists() or made.read_text(encoding="utf-8") != text:  # or all is read anew
            made.write_text(text, encoding="utf-8")


def _draw(app: Any) -> None:
    """Draw the pictures that are made with the site."""
    from effect_pictures import write_pictures

    write_pictures(HERE / "_made" / "effects")


def _for_the_site(app: Any, docname: str, source: list[str]) -> None:
    """Leave out of a page what only a forge shows: links to folders of the source, and Mermaid.

    Its arrows are a table here, for it is drawn by a script from elsewhere.

    What only the site has is put in: pictures that are made with it.
    """
    folder = Path(app.env.doc2path(docname)).parent
    if folder == NOTEBOOKS:
        return
    text = re.sub(r"```mermaid\n(.*?)```\n", _arrows, source[0], flags=re.DOTALL)
    text = re.sub(
        r"<!-- picture of (\w+) -->", r"![\1 in the residual](_made/effects/\1.png)", text
    )
    if not (HERE / "benchmarks.md").exists():  # `make bench` writes it
        text = text.replace("\nbenchmarks\n", "\n")
    source[0] = _with_links(text, folder, folder)


def _arrows(found: re.Match[str]) -> str:
    """Return the arrows of a Mermaid flowchart as a table: each begin with its ends."""
    ends: dict[str, list[str]] = {}
    for start, stop in re.findall(r"(\w+) --> (\w+)", found[1]):
        ends.setdefault(start, []).append(f"`{stop}`")
    rows = "".join(f"| `{start}` | {', '.join(stops)} |\n" for start, stops in ends.items())
    return f"| room | imports |\n| --- | --- |\n{rows}"


def _with_links(text: str, folder: Path, made: Path) -> str:
    """Return Markdown of a folder with its links as they are on the site, in another folder."""

    def link(found: re.Match[str]) -> str:
        name, mark, anchor = found[2].partition("#")
        target = (folder / name).resolve()
        goes_along = target.is_file() and target.suffix != ".md"  # as a download
        if not (target.is_relative_to(HERE) or goes_along):
            return found[1]
        if target.parent == ROOT / "notebooks":
            target = NOTEBOOKS / target.name  # a page here
        return f"[{found[1]}]({os.path.relpath(target, made)}{mark}{anchor})"

    return re.sub(r"(?<!!)\[([^\]]+)\]\(((?!\w+:|#)[^)\s]+)\)", link, text)


def _for_everybody(app: Any, page: str, template: str, context: dict[str, Any], tree: Any) -> None:
    """Let what is wider than the screen be scrolled by keys, and headings have their level."""
    context["body"] = re.sub(
        r'<(pre(?=>)|div(?= class="table-wrapper))', r'<\1 tabindex="0"', context.get("body", "")
    )
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
