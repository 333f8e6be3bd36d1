"""A class of one's own by commands alone, each of which knows nothing of the one before."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from experiment_files import write_search
from synthetic import ARM
from user_effects import SAG, SAGGING, own_settings, put

__all__ = ["own_settings"]
pytestmark = pytest.mark.usefixtures("own_settings")


def forget() -> None:
    """As another process is, that knows nothing of the file."""
    from dynident.effects import catalogue, known_effects

    known_effects.forget_module(catalogue()["cable_sag"].__module__)


@pytest.mark.slow
def test_it_is_simulated_considered_ranked_added_saved_loaded_and_reported(tmp_path, run) -> None:
    def answer(*arguments: str) -> dict:
        done = run(*arguments, "--trust", "--json")
        assert done.status == 0, done.err
        forget()
        return done.json

    put(tmp_path / "mine.py", SAG)
    hidden = f'effect_modules = ["mine.py"]\n{SAGGING}hidden = true\n'
    write_search(tmp_path, hidden, (("train", 0), ("test", 1)), period=4.0, harmonics=4)
    answer("simulate", "experiment.toml", "--out", "data")
    study = "data/study.toml"
    text = (tmp_path / study).read_text()
    assert "cable_sag" not in text and "effect_modules" not in text  # it is hidden
    (tmp_path / study).write_text('effect_modules = ["../mine.py"]\n' + text)

    found = answer("explain", study, "--report", "report.html")
    assert found["verdict"] == "explained"
    assert [(s["effect"], s["joint"]) for s in found["steps"]] == [("cable_sag", "elbow")]
    ranked = [(c["effect"], c["joint"]) for c in found["candidates"]]
    assert ranked[0] == ("cable_sag", "elbow") and ("cable_sag", "shoulder") in ranked
    page = (tmp_path / "report.html").read_text()
    assert "a cable drags more in some positions than in others" in page

    added = answer("add", study, "cable_sag@elbow")
    assert added["added"] == ["cable_sag@elbow"]
    assert '"cable_sag@elbow"' in (tmp_path / study).read_text()
    answer("fit", study, "--out", "fit.json")
    effects = json.loads((tmp_path / "fit.json").read_text())["model"]["effects"]
    assert effects[-1]["effect"] == "cable_sag"
    assert answer("simulate", study, "--estimate", "fit.json")["verdict"] == "follows"
    assert answer("check", "fit.json", "--effects", "mine.py")["consistent"]


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An estimate with an effect of `mine.py`, made by another process."""
    folder = tmp_path_factory.mktemp("saved")
    (folder / "arm.urdf").write_text(ARM)
    (folder / "mine.py").write_text(SAG)
    script = """
import dynident as di, mine
from synthetic import arm, synthetic, true_values
model = di.Model(arm()) + "viscous_friction" + "cable_sag@elbow"
made = synthetic(model, true_values(model, Fv__elbow=1.0), 0, torque_std=0.05, rate_hz=100.0)
for name, some in (("one", made), ("two", synthetic(model, true_values(model), 1))):
    di.fit(model, some).save(f"{name}.json")
"""
    tests = str(Path(__file__).parents[1])
    script = f"import sys; sys.path[:0] = ['', {tests!r}]\n{script}"
    done = subprocess.run([sys.executable, "-c", script], cwd=folder, check=False, text=True)
    assert done.returncode == 0
    return folder


COMMANDS = {
    "check": ("one.json",),
    "refit": ("one.json", "--out", "new.urdf"),
    "changes": ("one.json", "two.json"),
}


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.slow
def test_a_command_that_takes_an_estimate_can_be_told_of_its_effects(run, saved, name) -> None:
    arguments = [str(saved / a) if a.endswith("json") else a for a in COMMANDS[name]]
    done = run(name, *arguments)
    assert done.status == 2 and done.err.count("\n") == 1
    assert "came from mine.py: import it, or name it in effect_modules (--effects)" in done.err
    mine = str(saved / "mine.py")
    done = run(name, *arguments, "--effects", mine)
    assert done.status == 2 and done.err.count("\n") == 1
    assert done.err.startswith("error: --effects: would run code that is not trusted yet")
    done = run(name, *arguments, "--effects", mine, "--trust", "--json")
    assert done.status == 0, done.err
    forget()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "no such file"),
        ("1 / 0\n", "mine.py:1: ZeroDiv"),
        ("", "came from mine.py"),
    ],
)
@pytest.mark.slow
def test_files_that_do_not_bring_it_are_one_line(run, saved, tmp_path, content, says) -> None:
    if content is not None:
        (tmp_path / "mine.py").write_text(content)
    done = run("check", saved / "one.json", "--effects", tmp_path / "mine.py", "--trust")
    assert done.status == 2 and done.err.count("\n") == 1 and says in done.err
