"""What the pages tell to type works, and prints what they say."""

from __future__ import annotations

import ast
import glob
import shutil
import tomllib
from pathlib import Path

import pytest

import dynident as di
from code_blocks import PAGES, ROOT, CodeBlock, Typed, blocks, told
from dynident.cli import commands, main
from dynident.closed_loop.experiments.experiment_file import ExperimentFile
from dynident.experiment_design.motion_limits import LimitsFile
from dynident.study.study_file import StudyFile

BLOCKS = [(page.relative_to(ROOT).as_posix(), one) for page in PAGES for one in blocks(page)]
RUN = {
    "README.md": "hidden_effect",
    "docs/first_robot.md": "",
    "docs/howto/impossible_inertias.md": "",
    "docs/howto/many_robots.md": "",
    "docs/howto/noisy_encoders.md": "",
}
"""Pages that are run, first block to last, in a folder with the files of a problem."""
NOT_HERE = ("design", "open", "corrected", "bayes")
"""Words of commands that other tests run: they take long, wait, or need a study of another kind."""


def of_kind(*kinds: str) -> list[tuple[str, CodeBlock]]:
    return [(page, one) for page, one in BLOCKS if one.kind in kinds]


def test_there_is_code() -> None:
    assert len(of_kind("console", "bash")) > 3 and len(of_kind("python")) > 3


def test_every_command_has_these_options() -> None:
    for page, one in of_kind("console"):
        for typed in one.commands():
            name, *arguments = typed.arguments
            command = commands.commands.get(name)
            assert command, f"{page}: {name}"
            command.make_context(name, arguments)


def test_every_name_of_the_package_is_there() -> None:
    for page, one in of_kind("python"):
        for node in ast.walk(ast.parse(one.text)):
            if isinstance(node, ast.Attribute) and ast.unparse(node).startswith("di."):
                found = di
                for part in ast.unparse(node).split("(")[0].split(".")[1:]:
                    assert hasattr(found, part), f"{page}: {ast.unparse(node)}"
                    found = getattr(found, part)
                    if isinstance(found, property):
                        break


def test_every_setting_is_a_key() -> None:
    """Pieces of studies, experiments and limits, with what they leave out put in."""
    for _, one in of_kind("toml"):
        said = tomllib.loads(one.text)
        if "project" in said:  # of a package's own file
            continue
        if "boxes" in said:
            LimitsFile.model_validate(said)
            continue
        for entry in said.get("recordings", ()):
            entry.setdefault("file", "run.csv")
        if any("duration" in entry for entry in said.get("recordings", ())):
            ExperimentFile.model_validate({"robot": "arm.urdf", **said})
        else:
            whole = {"robot": "arm.urdf", "recordings": [{"file": "run.csv"}], **said}
            StudyFile.model_validate(whole)


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN)
def test_the_page_does_what_it_says(page: str, tmp_path: Path, monkeypatch, capfd) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("dynident.progress.EVERY", 1e9)
    (tmp_path / "problems").symlink_to(ROOT / "problems")
    (tmp_path / "arm.urdf").write_text((ROOT / "problems/hidden_effect/arm.urdf").read_text())
    if RUN[page]:
        shutil.copytree(ROOT / "problems" / RUN[page], tmp_path, dirs_exist_ok=True)
    names: dict[str, object] = {}
    for one in blocks(ROOT / page):
        if one.file:
            Path(one.file).write_text(one.text)
        elif one.kind == "python":
            exec(compile(one.text, page, "exec"), names)
        elif one.kind == "console":
            for command in one.commands():
                if not set(NOT_HERE) & set(command.arguments):
                    said = told(run(command, capfd))
                    for line in filter(lambda line: line.strip() != "...", command.printed):
                        assert told(line) in said


def run(command: Typed, capfd) -> str:
    """Run a command as the shell would; return all that it says."""
    assert command.program == "dynident"
    whole = [file for one in command.arguments for file in (sorted(glob.glob(one)) or [one])]
    capfd.readouterr()
    with pytest.raises(SystemExit) as stop:
        main(whole)
    said = capfd.readouterr()
    assert int(stop.value.code or 0) == command.status, said.err
    return said.out + said.err
