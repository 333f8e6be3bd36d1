"""EMPS, a measured benchmark: the published figures.

Of the path that leads to them from the rigid body: `notebooks/claims.py`.
"""

from __future__ import annotations

import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

from dynident import LeastSquares, load
from dynident import fit as fit_model
from dynident.fitting import Estimate
from problem_scripts import script

ROOT = Path(__file__).parents[2]
PROBLEM = ROOT / "problems" / "emps"
FOLDERS = [Path(os.environ.get("DYNIDENT_DATA", ROOT.parent / "shared" / "data"))]
HERE = any((folder / "emps" / "DATA_EMPS.mat").is_file() for folder in FOLDERS)
needs_data = pytest.mark.skipif(
    not HERE, reason="the EMPS record is not in DYNIDENT_DATA or ../shared/data"
)
PUBLISHED = tomllib.loads((PROBLEM / "published.toml").read_text())
closed_loop = script("emps", "closed_loop")


def reproduced(part: str) -> Estimate:
    study = load(PROBLEM / "study.toml")
    model = study.model
    for effect in PUBLISHED[part]["effects"]:
        model = model + effect
    return fit_model(model, study.train, LeastSquares("none", "independent"))


@needs_data
def test_the_symmetric_model_is_reproduced_to_a_hundredth_of_a_percent() -> None:
    found, published = reproduced("symmetric"), PUBLISHED["symmetric"]
    tolerance = PUBLISHED["tolerance"]
    for name, value in published["values"].items():
        assert found.value(name) == pytest.approx(value, rel=tolerance)
    assert found.condition_number == pytest.approx(published["condition_number"], rel=tolerance)
    assert found.error == pytest.approx(published["error"], rel=tolerance)
    # The authors take e'e / (rows - 1) as the variance of the residual, we rows - parameters.
    parameters = len(published["values"])
    theirs = np.sqrt((found.rows - parameters) / (found.rows - 1))
    for name, sigma in published["sigma"].items():
        rounding = 0.5e-4 / sigma  # the digits that they print
        ours = found.sigma[found.names.index(name)] * theirs
        assert ours == pytest.approx(sigma, rel=max(tolerance, rounding))


@needs_data
def test_asymmetric_friction_is_reproduced_to_a_hundredth_of_a_percent() -> None:
    found, published = reproduced("asymmetric"), PUBLISHED["asymmetric"]
    tolerance = PUBLISHED["tolerance"]
    ours = {
        "m.carriage": found.value("m.carriage"),
        "Fv+": found.value("Fv@slider") + found.value("dFv@slider"),
        "Fv-": found.value("Fv@slider") - found.value("dFv@slider"),
        "Fc+": found.value("Fc@slider") + found.value("dFc@slider"),
        "Fc-": found.value("Fc@slider") - found.value("dFc@slider"),
    }
    for name, value in published["values"].items():
        assert ours[name] == pytest.approx(value, rel=tolerance)
    assert found.error == pytest.approx(published["error"], rel=tolerance)


@needs_data
def test_the_record_with_pulses_is_read_by_the_same_columns(tmp_path) -> None:
    from scipy.io import loadmat, savemat

    study = load(PROBLEM / "study.toml")
    content = loadmat(study.train.recordings[0].provenance.file)
    content = {k: v for k, v in content.items() if not k.startswith("__")}
    content["pulses_N"] = np.zeros_like(content["vir"])
    (tmp_path / "emps").mkdir()
    savemat(tmp_path / "emps" / "DATA_EMPS.mat", content)
    for name in ("study.toml", "carriage.urdf"):
        (tmp_path / name).write_text((PROBLEM / name).read_text())
    pulses = load(tmp_path / "study.toml").train.recordings[0]
    assert np.array_equal(pulses.tau, study.train.recordings[0].tau)


def test_missing_data_is_said_with_the_ways_to_get_it(tmp_path, monkeypatch) -> None:
    from dynident.errors import FileError

    for name in ("study.toml", "carriage.urdf"):
        (tmp_path / name).write_text((PROBLEM / name).read_text())
    monkeypatch.delenv("DYNIDENT_DATA", raising=False)
    with pytest.raises(FileError, match=r"DYNIDENT_DATA.*nonlinear-benchmarks"):
        load(tmp_path / "study.toml")


@needs_data
@pytest.mark.slow
def test_the_simulated_loop_is_as_near_to_the_record_as_the_published_one() -> None:
    found = closed_loop.loop_errors(closed_loop.load())
    for quantity, published in PUBLISHED["closed_loop"].items():
        assert found[quantity] <= published, quantity


@needs_data
@pytest.mark.slow
def test_a_noisier_encoder_takes_the_mass_from_least_squares_and_not_from_instruments() -> None:
    study, said = closed_loop.load(), PUBLISHED["noise"]
    true = PUBLISHED["symmetric"]["values"]["m.carriage"]
    noisy = closed_loop.noisier(study)
    mass = fit_model(study.model, noisy, LeastSquares("none")).value("m.carriage")
    assert 1.0 - mass / true == pytest.approx(said["least_squares_loss"], abs=0.05)
    found = fit_model(study.model, noisy, closed_loop.instruments(study))
    assert found.value("m.carriage") == pytest.approx(true, rel=said["instruments_tolerance"])
