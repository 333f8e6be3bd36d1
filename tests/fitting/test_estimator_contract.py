"""What every estimator keeps to: the same small problem, and the same demands.

A new estimator is a class with `name` and `fit(model, dataset)`, and a line in `METHODS` here.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import loops
from dynident.errors import FitError, RecordingError
from dynident.fitting import (
    IV,
    Constrained,
    Estimate,
    Filtered,
    LeastSquares,
    Method,
    Regression,
    SwappedPeriods,
    fit,
    load_estimate,
)
from dynident.model import Model
from dynident.recording import Dataset, Noise
from dynident.regression.names import REGRESSIONS
from dynident.robot import Robot

POSITION_STD = 1e-6
METHODS: dict[str, Method] = {
    "least squares": LeastSquares(),
    "ordinary least squares": LeastSquares("none"),
    "constrained": Constrained(),
    "IV, simulated loop": IV(loops.LOOP),
    "IV, other periods": IV(SwappedPeriods()),
    "IV, filtered": IV(Filtered(20.0)),
    **{name: Regression(name) for name in REGRESSIONS if name != "corrected"},
    **{name: Regression(name, "encoders") for name in ("corrected", "factors", "bayes")},
    "factors, noise not known": Regression("factors"),
    "bayes, noise not known": Regression("bayes"),
}
PRIOR_DECIDES = ("factors, noise not known", "bayes, noise not known")
"""Without the noise of the inputs the data do not identify these estimators' reliability."""
IN_UNITS = ("constrained", "IV, simulated loop")
"""These use the given masses and inertias, or simulate a loop: both are in units of torque."""
NO_SIGMA = ("truncated", "ridge", "lasso", "pls", "stepwise", "total", *PRIOR_DECIDES)
TORQUE_UNITS = 1e3
"""Millinewton metres in a newton metre."""
every_method = pytest.mark.parametrize("name", METHODS)


@cache
def model() -> Model:
    return loops.model(coulomb=False)


@cache
def dataset() -> Dataset:
    """Two periods in closed loop; encoders with next to no noise, and that stated."""
    made = loops.dataset(loops.experiment(0, POSITION_STD, seconds=20.0))
    noise = Noise(np.full(2, POSITION_STD), np.full(2, 1e-3))
    return replace(made, noise=noise)


@cache
def fitted(name: str) -> Estimate:
    """The estimate that most of these tests are about."""
    return fit(model(), dataset(), METHODS[name])


@every_method
def test_the_truth_is_recovered(name: str) -> None:
    truth = loops.truth(model())
    most = 0.01 if name in PRIOR_DECIDES else 0.002
    np.testing.assert_allclose(fitted(name).values, truth, atol=most * np.abs(truth).max())


@every_method
def test_an_estimate_says_how_it_came_about(name: str) -> None:
    found = fitted(name)
    assert found.method and found.status and found.rows > model().size
    assert found.error < 0.2 and found.joint_errors.shape == found.torque_std.shape == (2,)
    assert [source.file for source in found.sources] == ["run0.npz"]
    assert found.covariance.shape == (model().size,) * 2
    claimed = np.isfinite(found.sigma)
    assert np.all(claimed) if name not in NO_SIGMA else not np.any(claimed)
    assert np.all(found.sigma[claimed] > 0.0)
    assert found.words_of_sigma in " ".join(found.summary().split())


@every_method
@pytest.mark.slow
def test_units_of_torque_do_not_matter(name: str) -> None:
    plain = fitted(name)
    noise = dataset().noise
    assert noise is not None
    scaled = replace(
        dataset(),
        recordings=tuple(one.replace(tau=TORQUE_UNITS * one.tau) for one in dataset().recordings),
        noise=replace(noise, torque_std=TORQUE_UNITS * noise.torque_std),
    )
    other, method = model(), METHODS[name]
    if name in IN_UNITS:
        other = Model(Robot.from_text(in_units(loops.ARM)), model().effects)
    if isinstance(method, IV) and method.instruments is loops.LOOP:
        method = replace(method, instruments=loops.controller(TORQUE_UNITS))
    found = fit(other, scaled, method)
    assert found.error == pytest.approx(plain.error, rel=1e-6)
    np.testing.assert_allclose(found.values / TORQUE_UNITS, plain.values, rtol=1e-6)
    np.testing.assert_allclose(found.sigma / TORQUE_UNITS, plain.sigma, rtol=1e-5)
    np.testing.assert_allclose(found.torque_std / TORQUE_UNITS, plain.torque_std, rtol=1e-6)


def in_units(text: str) -> str:
    """Return a description whose masses, inertias and efforts are in the scaled units."""
    in_torque = r'((?:<mass value|ixx|iyy|izz|effort)=")([^"]+)"'
    return re.sub(in_torque, lambda m: f'{m[1]}{TORQUE_UNITS * float(m[2])}"', text)


@every_method
@pytest.mark.slow
def test_order_of_joints_does_not_matter(name: str) -> None:
    plain = fitted(name)
    turned, method = ["elbow", "shoulder"], METHODS[name]
    description = loops.robot().description
    assert description is not None
    other = Model(Robot.from_text(description.text, joints=turned), model().effects)
    swapped = replace(
        dataset(), recordings=tuple(one.select(turned) for one in dataset().recordings)
    )
    if isinstance(method, IV) and method.instruments is loops.LOOP:
        loop = replace(loops.LOOP, kp=loops.LOOP.kp[::-1], kd=loops.LOOP.kd[::-1])
        method = replace(method, instruments=loop)
    found = fit(other, swapped, method)
    assert found.error == pytest.approx(plain.error, rel=1e-4)
    for joint in turned:
        wanted = plain.value(f"Fv@{joint}")
        assert found.value(f"Fv@{joint}") == pytest.approx(wanted, rel=1e-3)


@every_method
def test_an_estimate_survives_its_file(name: str, tmp_path: Path) -> None:
    found = fitted(name)
    again = load_estimate(found.save(tmp_path / "estimate.json"))
    assert np.array_equal(again.values, found.values)
    assert np.array_equal(again.covariance, found.covariance)
    assert (again.method, again.status, again.notes) == (found.method, found.status, found.notes)
    assert again.sources == found.sources and again.words_of_sigma == found.words_of_sigma


@every_method
def test_data_that_cannot_carry_the_model_are_refused(name: str) -> None:
    with pytest.raises(FitError, match="no recording"):
        fit(model(), Dataset(()), METHODS[name])
    short = tuple(one.cut(0.0, 0.05) for one in dataset().recordings)
    with pytest.raises((FitError, RecordingError)) as refused:
        fit(model(), replace(dataset(), recordings=short), METHODS[name])
    assert refused.value.where == "run0.npz" and refused.value.remedy
