"""Least squares: known truth recovered, whatever the blocks, units and weights."""

from __future__ import annotations

import numpy as np
import pytest

from chains import chain
from dynident import fit as fit_model
from dynident.errors import FitError, RecordingError
from dynident.fitting import LeastSquares, essential_parameters, load_estimate, rows, sampling
from dynident.model import Model
from dynident.moments import factorise
from dynident.recording import Dataset, Filter, Recording
from dynident.robot import Robot
from synthetic import arm, smooth_motion, synthetic, true_values

QUIET = Filter(position_cutoff_hz=None, cutoff_hz=None, rate_hz=100.0, edge_s=(0.02, 0.02))


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction" + "coulomb_friction"


@pytest.fixture(scope="module")
def truth(model: Model) -> np.ndarray:
    return true_values(model, Fv__shoulder=1.2, Fv__elbow=0.5, Fc__shoulder=1.5, Fc__elbow=0.6)


@pytest.fixture(scope="module")
def noisy(model: Model, truth: np.ndarray) -> Dataset:
    return Dataset(tuple(synthetic(model, truth, s, torque_std=0.2) for s in range(3)), QUIET)


def test_factors_of_any_blocks_give_the_same_answer_as_one_dense_solve() -> None:
    rng = np.random.default_rng(3)
    columns, torque = rng.normal(size=(500, 2, 6)), rng.normal(size=(500, 2))
    torque[:, 1] *= 7.0
    for cuts in ([], [1, 3, 10, 450], list(range(100, 500, 100))):
        pairs = zip(np.split(columns, cuts), np.split(torque, cuts), strict=True)
        factors = factorise(pairs)
        values = rng.normal(size=6)
        dense = torque - columns @ values
        assert np.allclose(factors.residual_norms(values), np.linalg.norm(dense, axis=0))
        assert np.allclose(factors.torque_norms, np.linalg.norm(torque, axis=0))
        R = factors.pooled(np.array([1.0, 0.1]))
        stacked = np.vstack([columns[:, 0], 0.1 * columns[:, 1]])
        assert np.allclose(R[:6, :6].T @ R[:6, :6], stacked.T @ stacked)


@pytest.mark.slow
def test_blocks_of_a_long_chain_take_no_more_memory_than_those_of_an_arm() -> None:
    long = Model(chain(24))
    samples = 3 * sampling.BLOCK
    times = np.arange(samples) / 1000.0
    q = 0.1 * np.sin(times[:, None] + np.arange(24))
    recording = Recording(times, q, np.ones_like(q), long.robot.names)
    ready = sampling.sample(recording, Filter(cutoff_hz=100.0, rate_hz=500.0))
    columns = next(ready.columns(long))
    assert columns.shape[1:] == (24, long.size)
    assert 2 * columns.size * 8 < 1.1 * 2**27, "half of the samples are kept"


def test_noise_free_truth_is_recovered(model: Model, truth: np.ndarray) -> None:
    data = Dataset((synthetic(model, truth, 1), synthetic(model, truth, 2)), QUIET)
    estimate = fit_model(model, data)
    assert estimate.error < 2e-4
    assert np.allclose(estimate.values, truth, rtol=2e-3, atol=2e-3)


def test_joints_of_unequal_noise_are_weighted(model: Model, truth: np.ndarray) -> None:
    """With one joint fifty times noisier, weights must bring the error down."""
    errors = {"none": 0.0, "joint": 0.0}
    for seed in range(4):
        one = synthetic(model, truth, seed)
        rng = np.random.default_rng([seed, 9])
        tau = one.tau + rng.normal(size=one.tau.shape) * np.array([5.0, 0.1])
        data = Dataset((one.replace(tau=tau),), QUIET)
        for weighting in ("none", "joint"):
            found = fit_model(model, data, LeastSquares(weighting))  # type: ignore[arg-type]
            errors[weighting] += float(np.sum((found.value("Fv@elbow") - 0.5) ** 2))
    assert errors["joint"] < 0.5 * errors["none"]


@pytest.mark.slow
def test_intervals_cover_the_truth(model: Model, truth: np.ndarray) -> None:
    """White torque noise, nothing missing: 95 % intervals hold in 95 % of 60 x 8 cases or so."""
    inside = []
    for seed in range(60):
        data = Dataset((synthetic(model, truth, seed, torque_std=0.3, duration=8.0),), QUIET)
        found = fit_model(model, data)
        kept = found.identified
        inside.append(np.abs(found.values - truth)[kept] < 1.96 * found.sigma[kept])
    # Standard error of the rate is about 0.013 (parameters of one fit are correlated).
    assert 0.90 < np.mean(inside) < 0.985


def test_units_of_torque_and_order_of_joints_do_not_matter(
    model: Model, truth: np.ndarray, noisy: Dataset
) -> None:
    plain = fit_model(model, noisy)
    thousand = Dataset(tuple(r.replace(tau=1000 * r.tau) for r in noisy.recordings), noisy.filter)
    scaled = fit_model(model, thousand)
    assert np.allclose(scaled.values, 1000 * plain.values, rtol=1e-8)
    assert scaled.error == pytest.approx(plain.error, rel=1e-10)
    swapped = arm()
    swapped = Robot.from_text(swapped.description.text, joints=["elbow", "shoulder"])  # type: ignore[union-attr]
    other = Model(swapped, model.effects)
    turned = Dataset(tuple(r.select(["elbow", "shoulder"]) for r in noisy.recordings), noisy.filter)
    found = fit_model(other, turned)
    assert found.error == pytest.approx(plain.error, rel=1e-9)
    for name in ("Fv@elbow", "Fc@shoulder"):
        assert found.value(name) == pytest.approx(plain.value(name), rel=1e-7)


def test_what_is_not_excited_is_said_and_stays_as_given(model: Model, truth: np.ndarray) -> None:
    t, q, v, a = smooth_motion(2, 0, 500.0, 8.0, 8.0)
    still = np.zeros_like(q)
    q[:, 1], v[:, 1], a[:, 1] = 0.3, 0.0, 0.0
    tau = model.torque(model.block(t, q, v, a), truth) + 0 * still
    one = synthetic(model, truth, 0, duration=8.0).replace(q=q, tau=tau)
    found = fit_model(model, Dataset((one,), QUIET))
    assert found.basis.rank < model.size
    assert any("do not excite" in note and "Fv@elbow" in note for note in found.notes)
    elbow = model.names.index("Fv@elbow")
    assert not found.identified[elbow]
    assert found.values[elbow] == model.given_values()[elbow]
    assert found.error < 1e-3


def test_the_estimate_survives_its_file(model: Model, noisy: Dataset, tmp_path) -> None:
    found = fit_model(model + "stribeck_friction@elbow", noisy)
    path = found.save(tmp_path / "estimate.json")
    again = load_estimate(path)
    assert again.model.names == found.model.names
    assert again.model.effects == found.model.effects
    assert np.array_equal(again.values, found.values)
    assert np.array_equal(again.covariance, found.covariance)
    assert again.summary() == found.summary()


def test_a_file_that_is_no_estimate_is_refused(tmp_path) -> None:
    for text in ("{}", "[1]", "nonsense", '{"format": "dynident-estimate-1"}'):
        path = tmp_path / "wrong.json"
        path.write_text(text)
        with pytest.raises(FitError, match="not a dynident estimate"):
            load_estimate(path)


def test_the_robot_written_has_the_inverse_dynamics_identified(
    model: Model, noisy: Dataset, tmp_path
) -> None:
    found = fit_model(model, noisy)
    path = found.write_robot(tmp_path / "identified.urdf")
    again = Robot.from_file(path)
    _, q, v, a = smooth_motion(2, 5, 50.0, 4.0, 4.0)
    rigid = Model(arm())
    wanted = rigid.torque(rigid.block(np.zeros(len(q)), q, v, a), found.values[: rigid.size])
    assert np.allclose(again.inverse_dynamics(q, v, a), wanted, rtol=1e-10, atol=1e-10)


def test_shape_parameters_are_refined(model: Model) -> None:
    full = model + "stribeck_friction@elbow"
    full = full.with_shapes((full.effects[-1].shaped(0.13),))
    truth = true_values(full, Fv__elbow=0.5, Fc__elbow=0.6, Fs__elbow=0.8)
    data = Dataset(tuple(synthetic(full, truth, s, torque_std=0.02) for s in range(2)), QUIET)
    found = fit_model(model + "stribeck_friction@elbow", data)
    assert found.model.effects[-1].shape[0] == pytest.approx(0.13, rel=0.1)
    assert found.value("Fs@elbow") == pytest.approx(0.8, rel=0.1)
    assert "converged" in found.status


def test_a_gain_is_found_though_its_column_depends_on_the_answer(model: Model) -> None:
    full = model + "drive_gain@elbow"
    truth = true_values(full, Fv__elbow=0.5, Fc__elbow=0.6, e__elbow=0.15)
    data = Dataset(tuple(synthetic(full, truth, s) for s in range(2)), QUIET)
    assert fit_model(full, data).value("e@elbow") == pytest.approx(0.15, abs=2e-3)


def test_essential_parameters_drop_what_is_not_there(model: Model) -> None:
    full = model + "quadratic_drag"
    truth = true_values(full, Fv__shoulder=1.2, Fv__elbow=0.5, Fc__shoulder=1.5, Fc__elbow=0.6)
    data = Dataset(tuple(synthetic(full, truth, s, torque_std=0.5) for s in range(2)), QUIET)
    found = essential_parameters(full, factorise(rows(full, data)))
    assert {"Fq@shoulder", "Fq@elbow"} <= set(found.dropped)
    assert "Fc@shoulder" in found.names
    assert np.all(found.sigma <= 0.3 * np.abs(found.values))
    assert found.error_before <= found.error_after < 1.01 * found.error_before


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tau": np.zeros((4001, 2))}, "zero throughout"),
    ],
)
def test_hopeless_data_are_refused(model: Model, truth: np.ndarray, change, words) -> None:
    one = synthetic(model, truth, 0, duration=8.0).replace(**change)
    with pytest.raises(FitError, match=words):
        fit_model(model, Dataset((one,), QUIET))


def test_too_short_a_recording_is_refused(model: Model, truth: np.ndarray) -> None:
    one = synthetic(model, truth, 0).cut(0.0, 0.05).replace(period=None)
    with pytest.raises(RecordingError, match="rows are left"):
        fit_model(model, Dataset((one,), QUIET))
    with pytest.raises(FitError, match="no recording"):
        fit_model(model, Dataset(()))
