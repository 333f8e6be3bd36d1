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

FOLDER = Path(__file__).parents[2] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
LARGEST = 1 << 20  # bytes
CELL_TIMEOUT = 300  # s; a slow machine gets there, a hanging cell does not
MACHINE_PATH = re.compile(r"/(?:work|tmp|root|home|Users)\b|[A-Za-z]:\\\\")
PROGRESS = re.compile(r"(diagnosing|designing): .* \(\d+ s\)")
"""A line of the log, every ten seconds: on a slow machine."""

each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def read(path: Path) -> nbformat.NotebookNode:
    return nbformat.read(path, as_version=4)


def code_cells(notebook: nbformat.NotebookNode) -> list[nbformat.NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.fixture(scope="session")
def fonts(tmp_path_factory) -> Path:
    """Matplotlib's folder, with a list of its own fonts alone."""
    folder = tmp_path_factory.mktemp("matplotlib")
    own = {"MPLCONFIGDIR": str(folder), "MPL_IGNORE_SYSTEM_FONTS": "1"}
    listing = [sys.executable, "-c", "import matplotlib.font_manager"]
    subprocess.run(listing, env={**os.environ, **own}, check=True)
    return folder


def test_there_are_notebooks() -> None:
    assert NOTEBOOKS
    assert all(re.fullmatch(r"\d\d_[a-z0-9_]+", path.stem) for path in NOTEBOOKS)


@each_notebook
@pytest.mark.slow
def test_it_runs_from_top_to_bottom(path: Path, tmp_path: Path, fonts: Path, monkeypatch) -> None:
    from nbclient import NotebookClient

    # Nothing of the user's own: no start-up files, no history, no list of fonts from before.
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    monkeypatch.setenv("MPLCONFIGDIR", str(fonts))
    notebook = copy.deepcopy(read(path))
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
    """Errors and warnings among a cell's outputs; what says that long work goes on is neither."""
    found = [o.evalue for o in cell.outputs if o.output_type == "error"]
    said = (line for o in cell.outputs if o.get("name") == "stderr" for line in o.text.splitlines())
    return found + [line for line in said if not PROGRESS.fullmatch(line)]
