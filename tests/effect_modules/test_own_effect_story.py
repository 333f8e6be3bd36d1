"""A user's class from a file of theirs: considered, ranked, added, saved, loaded and reported."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.effect_modules.user_module import UserModule
from dynident.effects import catalogue
from dynident.errors import FitError
from dynident.recording import write
from study_files import STUDY
from synthetic import ARM, arm, synthetic, true_values
from user_effects import SAG, own_settings

PAGE = Path(__file__).parents[2] / "docs" / "your_own_effects.md"
CLASS, CHECK, STORY = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
HIDDEN = {"Fv__shoulder": 2.0, "Fv__elbow": 1.0}

__all__ = ["own_settings"]
pytestmark = pytest.mark.usefixtures("own_settings")


def study(folder: Path, module: str, text: str, label: str, value: float = 0.6) -> Path:
    """An arm in whose recordings the effect of a module is hidden."""
    (folder / module).write_text(text)
    (folder / "arm.urdf").write_text(ARM)
    UserModule.read(folder / module).run()
    model = di.Model(arm()) + "viscous_friction" + label
    values = true_values(model, **HIDDEN)
    values[model.slices[label]] = value
    for seed, name in enumerate(("train.csv", "test.csv")):
        made = synthetic(model, values, seed, rate_hz=100.0, position_std=1e-5, torque_std=0.05)
        write(made, folder / name)
    path = folder / "study.toml"
    named = f'effects = ["viscous_friction"]\neffect_modules = ["{module}"]'
    path.write_text(STUDY.replace('effects = ["viscous_friction"]', named))
    return path


@pytest.mark.slow
def test_the_page_tells_what_happens(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study(tmp_path, "my_effects.py", CLASS, "cable_drag@elbow")
    names: dict = {"CableDrag": catalogue()["cable_drag"]}
    exec(compile(CHECK, "check", "exec"), names)
    exec(compile(STORY, "story", "exec"), names)
    d, better, again = names["d"], names["better"], names["again"]
    # Named first, alone, and with the value that was hidden.
    assert d.verdict == "explained" and names["found"] == "cable_drag@elbow"
    assert [step.effect.label for step in d.steps] == ["cable_drag@elbow"]
    assert d.after.error < 0.5 * d.before.error
    k = better.model.names.index("c@elbow")
    assert abs(better.values[k] - 0.6) < 4 * better.sigma[k]
    # Saved and loaded.
    assert again.model.names == better.model.names
    assert again.model.effects == better.model.effects
    np.testing.assert_array_equal(again.values, better.values)
    # Reported: its law, its meaning, its unit.
    page = (tmp_path / "report.html").read_text()
    assert "cable_drag@elbow" in page and "N m s/rad" in page
    assert "the cables drag more in some positions than in others" in page


def test_it_is_added_by_the_command_and_simulated(tmp_path, monkeypatch):
    path = study(tmp_path, "mine.py", SAG, "cable_sag@elbow")
    from dynident.study import add_effects

    found = di.load(path, modules="run")
    (sag,) = (found.model + "cable_sag@elbow").effects[-1:]
    add_effects(path, (sag,))
    again = di.load(path)
    assert "cable_sag@elbow" in again.model
    assert 'effect_modules = ["mine.py"]' in path.read_text()
    fitted = di.fit(again.model, again.train)
    from dynident.closed_loop import Mechanism

    values = fitted.values
    mechanism = Mechanism.of_model(again.model, values)
    q, v, a = again.robot.random_motion(3, 50)
    torque = again.model.torque(again.model.block(np.zeros(50), q, v, a), values)
    np.testing.assert_allclose(mechanism.command(np.zeros(50), q, v, a), torque, atol=1e-9)


@pytest.fixture
def saved(tmp_path) -> Path:
    path = study(tmp_path, "mine.py", SAG, "cable_sag@elbow")
    found = di.load(path)
    return di.fit(found.model + "cable_sag@elbow", found.train).save(tmp_path / "fit.json")


def without(kind: str) -> None:
    """As another process is, that knows nothing of the file."""
    from dynident.effects import known_effects

    known_effects.forget_module(catalogue()[kind].__module__)


@pytest.mark.slow
def test_an_estimate_says_what_is_missing(saved):
    assert di.load_estimate(saved).model.effects[-1].label == "cable_sag@elbow"
    without("cable_sag")
    with pytest.raises(FitError) as told:
        di.load_estimate(saved)
    wanted = (
        "effect 'cable_sag' came from mine.py: import it, or name it in effect_modules (--effects)"
    )
    assert str(told.value) == f"{saved}: {wanted}"
    di.load(saved.with_name("study.toml"), modules="run")
    assert "cable_sag@elbow" in di.load_estimate(saved).model


@pytest.mark.slow
def test_the_packages_own_need_no_origin(saved):
    own, foreign = json.loads(saved.read_text())["model"]["effects"][-2:]
    assert "origin" not in own
    assert foreign["origin"]["file"] == "mine.py" and foreign["origin"]["package"] == ""


def refused(saved: Path, origin: object, words: str) -> str:
    """What is said of an estimate with an effect that nobody knows, and this origin."""
    content = json.loads(saved.read_text())
    content["model"]["effects"][-1] |= {"effect": "no_such_effect", "origin": origin}
    other = saved.with_name("other.json")
    other.write_text(json.dumps(content))
    with pytest.raises(FitError, match=words) as told:
        di.load_estimate(other)
    return str(told.value)


@pytest.mark.slow
def test_other_places_are_named_too(saved):
    said = json.loads(saved.read_text())["model"]["effects"][-1]["origin"]
    for origin, words in (
        ({"package": "our-lab"}, "came from the package our-lab: install it"),
        ({"file": ""}, "came from a notebook or a console: define it again before"),
        ({"file": "x" * 500}, "came from x{80}: import"),
    ):
        assert len(refused(saved, said | origin, words).splitlines()) == 1


@pytest.mark.slow
def test_an_origin_that_is_none_is_refused(saved):
    for origin in (None, 7, {}, {"module": 1, "file": "", "package": ""}, []):
        refused(saved, origin, "is not a dynident estimate")


def test_a_notebook_is_told_from_a_file():
    space: dict = {"__name__": "__main__"}
    exec(compile(SAG.replace("cable_sag", "cell_sag"), "<ipython-input-1>", "exec"), space)
    found = di.effects.origin_of(space["CableSag"])
    assert found is not None and found.file == "" and found.module == "__main__"
    assert di.effects.origin_of(catalogue()["backlash"]) is None
