"""Every notebook runs from top to bottom, and is committed as it ran, with its outputs."""

from __future__ import annotations

import ast
import copy
import os
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

from notebooks.claims import OF_NOTEBOOKS
from notebooks.forked_cells import run_cells

FOLDER = Path(__file__).parents[2] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
LARGEST = 1 << 20  # bytes
CELL_TIMEOUT = 300  # s; a slow machine gets there, a hanging cell does not
MACHINE_PATH = re.compile(r"/(?:work|tmp|root|home|Users)\b|[A-Za-z]:\\\\")
PROGRESS = re.compile(r"(diagnosing|designing): .* \(\d+ s\)")
"""A line of the log, every ten seconds: on a slow machine."""

IN_JUPYTER = FOLDER / "03_closed_loop_instruments.ipynb"
"""The shortest: a kernel takes seconds to begin."""


def each_of(notebooks: list[Path]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("path", notebooks, ids=lambda path: path.stem)


each_notebook = each_of(NOTEBOOKS)


def read(path: Path) -> nbformat.NotebookNode:
    return nbformat.read(path, as_version=4)


def code_cells(notebook: nbformat.NotebookNode) -> list[nbformat.NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.fixture
def fonts(tmp_path: Path) -> Path:
    """Matplotlib's folder, with a list of its own fonts alone."""
    folder = tmp_path / "matplotlib"
    folder.mkdir()
    own = {"MPLCONFIGDIR": str(folder), "MPL_IGNORE_SYSTEM_FONTS": "1"}
    listing = [sys.executable, "-c", "import matplotlib.font_manager"]
    subprocess.run(listing, env={**os.environ, **own}, check=True)
    return folder


def test_there_are_notebooks() -> None:
    assert NOTEBOOKS
    assert all(re.fullmatch(r"\d\d_[a-z0-9_]+", path.stem) for path in NOTEBOOKS)
    assert OF_NOTEBOOKS.keys() <= {path.stem for path in NOTEBOOKS}


@each_of([path for path in NOTEBOOKS if path != IN_JUPYTER])
@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks here")
def test_it_runs_from_top_to_bottom(path: Path, tmp_path: Path, monkeypatch) -> None:
    """And finds what is claimed of the records in it."""
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))  # no start-up files
    sources = [cell.source for cell in code_cells(read(path))]
    if path.stem in OF_NOTEBOOKS:
        sources.append(f"from notebooks import claims\n{OF_NOTEBOOKS[path.stem]}")
    outcomes = run_cells(sources, FOLDER, CELL_TIMEOUT)
    for source, outcome in zip(sources, outcomes, strict=True):
        assert not outcome.failure, f"{source}\n{outcome.failure}"
        assert said_beside_progress(outcome.errors) == [], source


@pytest.mark.slow
def test_jupyter_runs_one_from_top_to_bottom(tmp_path: Path, fonts: Path, monkeypatch) -> None:
    from nbclient import NotebookClient

    # Nothing of the user's own: no start-up files, no history, no list of fonts from before.
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    monkeypatch.setenv("MPLCONFIGDIR", str(fonts))
    notebook = copy.deepcopy(read(IN_JUPYTER))
    for cell in code_cells(notebook):
        cell.outputs, cell.execution_count = [], None
    client = NotebookClient(
        notebook,
        timeout=CELL_TIMEOUT,
        kernel_name="python3",
        resources={"metadata": {"path": str(FOLDER)}},
    )
    client.execute()  # raises CellExecutionError with the cell and its traceback
    for cell in code_cells(notebook):
        assert complaints(cell) == [], cell.source


@each_notebook
def test_it_is_committed_as_it_ran(path: Path) -> None:
    notebook = read(path)
    nbformat.validate(notebook)
    cells = code_cells(notebook)
    # Once, in order, in one go.
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    assert any(cell.outputs for cell in cells)
    for cell in cells:
        assert complaints(cell) == [], cell.source


@each_notebook
def test_it_names_no_machine_and_is_small(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.encode()) < LARGEST
    # Without the pictures: their letters are base64 and mean nothing.
    words = re.sub(r'"image/png": "[^"]*"', "", text)
    found = [line for line in words.splitlines() if MACHINE_PATH.search(line)]
    assert found == []


@each_notebook
def test_it_ends_with_two_exercises_whose_answers_are_folded(path: Path) -> None:
    last = read(path).cells[-1]
    assert last.cell_type == "markdown"
    _, found, exercises = last.source.partition("## Exercises\n")
    assert found
    assert re.findall(r"^\*\*(\d)\. ", exercises, re.MULTILINE) == ["1", "2"]
    assert exercises.count("<details><summary>") == exercises.count("</details>") == 2
    for code in re.findall(r"```python\n(.*?)```", exercises, re.DOTALL):
        ast.parse(code)


def complaints(cell: nbformat.NotebookNode) -> list[str]:
    """Errors and warnings among a cell's outputs."""
    found = [o.evalue for o in cell.outputs if o.output_type == "error"]
    said = "".join(o.text for o in cell.outputs if o.get("name") == "stderr")
    return found + said_beside_progress(said)


def said_beside_progress(errors: str) -> list[str]:
    """Lines on standard error but those that say that long work goes on."""
    return [line for line in errors.splitlines() if not PROGRESS.fullmatch(line)]
