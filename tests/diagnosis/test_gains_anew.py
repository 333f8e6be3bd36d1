"""Gains of drives once an effect is added: those of the model with its effects."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import dynident as di
from dynident.cli import commands
from dynident.diagnosis.recorded_units import made_up_for, with_gains
from dynident.effects import effects_of
from dynident.fitting.drive_gains import (
    DriveGains,
    GainProblem,
    fit_drive_gains,
    in_newton_metres,
)
from dynident.recording import Dataset, Recording, write
from synthetic import ARM, arm, smooth_motion, true_values

GAINS = np.array([20.0, -4.0])
STUDY = """\
robot = "arm.urdf"
effects = ["viscous_friction", "coulomb_friction"]
torque_unit = "A"
drive_gains = { shoulder = 20.0 }
recordings = [{ file = "run*.csv", period = 8.0 }]
"""


@cache
def recordings() -> tuple[di.Model, Dataset]:
    """Currents of an arm whose elbow has Stribeck friction, of which the model knows nothing."""
    model = di.Model(arm()) + "viscous_friction" + "coulomb_friction"
    (hidden,) = effects_of("stribeck_friction@elbow", model.robot)
    true = model + hidden
    friction = {"Fv__shoulder": 1.0, "Fv__elbow": 0.8, "Fc__shoulder": 0.6, "Fc__elbow": 0.7}
    values = np.append(true_values(model, **friction), 1.5)
    made = []
    for seed in (1, 2):
        t, q, v, a = smooth_motion(2, seed, 100.0, 16.0, 8.0, 0.4)
        tau = true.torque(true.block(t, q, v, a), values)
        tau = tau + 0.02 * np.random.default_rng(seed).normal(size=tau.shape)
        made.append(Recording(t, q, tau / GAINS, model.robot.names, period=8.0))
    return model, Dataset(tuple(made))


@cache
def first_gains() -> tuple[GainProblem, DriveGains]:
    """Gains that are fitted before anything is added."""
    model, amperes = recordings()
    problem = GainProblem(model, amperes, {"shoulder": GAINS[0]})
    return problem, fit_drive_gains(problem)


@pytest.mark.slow
def test_gains_are_fitted_anew_with_what_was_added() -> None:
    model, amperes = recordings()
    problem, drives = first_gains()
    newtons = in_newton_metres(amperes, drives, model.robot)
    found = di.diagnose(model, newtons)
    # The gain that was found without the friction is off, which a drive gain may make up for.
    labels = [one.effect.label for one in found.steps]
    assert labels[0] == "stribeck_friction@elbow"
    assert all(one.startswith("drive_gain@") for one in labels[1:])
    shown = with_gains(found, drives, problem)
    assert shown.drives is drives and shown.drives_anew is not None
    off, still_off = (abs(one.gains[1] / GAINS[1] - 1) for one in (drives, shown.drives_anew))
    assert still_off < 0.3 * off
    low, high = sorted(shown.drives_anew.intervals[1])
    assert low < GAINS[1] < high
    titles = [getattr(one, "title", "") for one in shown.tables()]
    assert "Gains of the drives, with the effects added" in titles
    assert shown.to_dict()["drives_anew"]["joints"][1]["gain"] == shown.drives_anew.gains[1]
    assert made_up_for(shown) == tuple(labels[1:])


@pytest.mark.slow
def test_explain_begins_again_where_a_gain_made_up_for_others(tmp_path: Path) -> None:
    """Nor is such a gain of use once the gains are those with the friction."""
    _, amperes = recordings()
    for number, one in enumerate(amperes.recordings):
        write(one, tmp_path / f"run{number}.csv")
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "study.toml").write_text(STUDY)
    answer = CliRunner().invoke(commands, ["explain", str(tmp_path / "study.toml"), "--json"])
    said = json.loads(answer.stdout)
    assert [(one["effect"], one["joint"]) for one in said["steps"]] == [
        ("stribeck_friction", "elbow")
    ]
    assert any("the search was begun again" in one for one in said["notes"])
    gains = [said[key]["joints"][1]["gain"] for key in ("drives", "drives_anew")]
    np.testing.assert_allclose(gains, GAINS[1], rtol=2e-3)


@pytest.mark.slow
def test_gains_stay_where_nothing_was_added() -> None:
    model, amperes = recordings()
    problem, drives = first_gains()
    found = di.diagnose(model, in_newton_metres(amperes, drives, model.robot), most=0)
    shown = with_gains(found, drives, problem)
    assert shown.drives_anew is None and "drives_anew" not in shown.to_dict()
