"""A class of one's own by commands alone, each a process that knows nothing of the one before."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from synthetic import ARM
from user_effects import SAG, own_settings

__all__ = ["own_settings"]
pytestmark = pytest.mark.usefixtures("own_settings")

EXPERIMENT = """\
robot = "arm.urdf"
seed = 3
effect_modules = ["mine.py"]

[[effects]]
effect = "viscous_friction"
values = { Fv = 1.0 }

[[effects]]
effect = "cable_sag@elbow"
values = { c = 0.5 }
hidden = true

[controller]
kind = "pd"
kp = [200.0, 60.0]
kd = [25.0, 4.0]
rate_hz = 250.0

[sensors]
position_std = 1e-5
torque_std = [0.1, 0.05]
"""
RECORDING = """
[[recordings]]
file = "{use}.csv"
use = "{use}"
duration = 8.0
period = 4.0
trajectory = {{ harmonics = 4, speed = 2.0, seed = {seed} }}
"""


def dynident(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command as a process of its own."""
    command = [sys.executable, "-m", "dynident.cli", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def answer(folder: Path, *arguments: str) -> dict:
    done = dynident(folder, *arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_it_is_simulated_considered_ranked_added_saved_loaded_and_reported(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "mine.py").write_text(SAG)
    runs = "".join(RECORDING.format(use=use, seed=k) for k, use in enumerate(("train", "test")))
    (tmp_path / "experiment.toml").write_text(EXPERIMENT + runs)
    answer(tmp_path, "simulate", "experiment.toml", "--out", "data", "--trust")
    study = "data/study.toml"
    text = (tmp_path / study).read_text()
    assert "cable_sag" not in text and "effect_modules" not in text  # it is hidden
    (tmp_path / study).write_text('effect_modules = ["../mine.py"]\n' + text)

    found = answer(tmp_path, "explain", study, "--trust", "--report", "report.html")
    assert found["verdict"] == "explained"
    assert [(s["effect"], s["joint"]) for s in found["steps"]] == [("cable_sag", "elbow")]
    ranked = [(c["effect"], c["joint"]) for c in found["candidates"]]
    assert ranked[0] == ("cable_sag", "elbow") and ("cable_sag", "shoulder") in ranked
    page = (tmp_path / "report.html").read_text()
    assert "a cable drags more in some positions than in others" in page

    added = answer(tmp_path, "add", study, "cable_sag@elbow", "--trust")
    assert added["added"] == ["cable_sag@elbow"]
    assert '"cable_sag@elbow"' in (tmp_path / study).read_text()
    answer(tmp_path, "fit", study, "--out", "fit.json", "--trust")
    effects = json.loads((tmp_path / "fit.json").read_text())["model"]["effects"]
    assert effects[-1]["effect"] == "cable_sag"
    loop = answer(tmp_path, "simulate", study, "--estimate", "fit.json", "--trust")
    assert loop["verdict"] == "follows"
    checked = answer(tmp_path, "check", "fit.json", "--effects", "mine.py", "--trust")
    assert checked["consistent"]


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


def forget() -> None:
    """As another process is, that knows nothing of the file."""
    from dynident.effects import catalogue, known_effects

    known_effects.forget_module(catalogue()["cable_sag"].__module__)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "no such file"),
        ("1 / 0\n", "mine.py:1: ZeroDiv"),
        ("", "came from mine.py"),
    ],
)
def test_files_that_do_not_bring_it_are_one_line(run, saved, tmp_path, content, says) -> None:
    if content is not None:
        (tmp_path / "mine.py").write_text(content)
    done = run("check", saved / "one.json", "--effects", tmp_path / "mine.py", "--trust")
    assert done.status == 2 and done.err.count("\n") == 1 and says in done.err
