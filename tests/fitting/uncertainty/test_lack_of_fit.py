"""A model that repetitions reject says so first, and its intervals hold the lack of fit."""

from __future__ import annotations

import numpy as np
import pytest

import two_link_loop as lab
from dynident import IV, Constrained, Regression
from dynident.errors import RecordingError
from dynident.fitting import Estimate, LeastSquares, Method, SwappedPeriods, fit, load_estimate
from dynident.fitting.uncertainty.lack_of_fit import lack_of_fit, widened
from dynident.model import Model
from dynident.recording import Dataset, Filter, suited_filter
from synthetic import arm, synthetic, true_values

STD = (0.5, 0.2)


def repeated(**more: float) -> Dataset:
    return Dataset(tuple(lab.Lab(torque_std=STD, period=True, **more).recordings(range(1))))


@pytest.fixture(scope="module")
def rejected() -> Estimate:
    return fit(lab.model(), repeated(stribeck=0.4))


def test_a_missing_effect_is_said_in_the_first_line(rejected: Estimate, tmp_path) -> None:
    first = rejected.summary().splitlines()[0]
    assert first.startswith("The model is rejected") and "at shoulder" in first
    assert "cluster sandwich" in rejected.words_of_sigma
    assert load_estimate(rejected.save(tmp_path / "e.json")).headline == rejected.headline


@pytest.mark.parametrize("method", [Constrained(), IV(SwappedPeriods()), Regression("ridge")])
@pytest.mark.slow
def test_whatever_fitted_it_a_model_that_is_rejected_says_so(method: Method) -> None:
    found = fit(lab.model(), repeated(stribeck=0.4), method)
    assert "The model is rejected" in found.headline
    assert "rejected" not in fit(lab.model(), repeated(), method).headline


def test_its_intervals_are_wider_in_every_direction(rejected: Estimate) -> None:
    plain = fit(lab.model(), repeated(stribeck=0.4), LeastSquares(errors="independent"))
    kept = list(rejected.basis.independent)
    ratio = rejected.sigma[kept] / plain.sigma[kept]
    assert np.all(ratio > 1.0) and ratio.max() > 1.5


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_whole_model_is_not_rejected(seed: int) -> None:
    (one,) = lab.Lab(torque_std=STD, period=True).recordings(range(seed, seed + 1))
    found = fit(lab.model(), one)
    assert not found.headline and "colour" in found.words_of_sigma


@pytest.mark.slow
def test_friction_of_a_whole_model_turns_round_when_the_joint_does_behind_fine_encoders() -> None:
    """What repetitions have in common, behind the low-pass that suits and behind the usual one."""
    model, usual = lab.model(0.01), Filter(position_cutoff_hz=40.0, cutoff_hz=18.0, rate_hz=50.0)
    fine = lab.Lab(torque_std=(0.08, 0.016), position_std=3e-6, width=0.01, period=True)
    left = np.zeros((2, 2))
    for one in fine.recordings(range(100, 104)):
        for i, dataset in enumerate(Dataset((one,), f) for f in (suited_filter((one,)), usual)):
            judged = lack_of_fit(model, dataset, fit(model, dataset).values)
            assert judged is not None
            left[i] += judged.systematic**2
    assert np.all(left[0] < (0.25 * left[1][0], 0.7 * left[1][1]))


def rounded(step: float, off: float) -> Dataset:
    """Two repetitions behind encoders with steps (rad), whose positions are moved off them."""
    model, rng = Model(arm()) + "viscous_friction", np.random.default_rng(3)
    truth = true_values(model, Fv__shoulder=1.2, Fv__elbow=0.5)
    one = synthetic(model, truth, 0, rate_hz=250.0, torque_std=0.1)
    q = np.round(one.q / step) * step
    return Dataset((one.replace(q=q + off * rng.standard_normal(q.shape)),))


def test_steps_of_encoders_that_repeat_with_the_motion_reject_no_model() -> None:
    """The same residual, of positions that lie on no lattice, does."""
    model = Model(arm()) + "viscous_friction"
    healthy = fit(model, rounded(2e-4, 0.0))
    assert "rejected" not in healthy.headline
    assert "steps of encoders up to" in healthy.headline
    assert "may be off by more than sigma says" in healthy.headline
    assert "cluster sandwich" in healthy.words_of_sigma
    assert "The model is rejected" in fit(model, rounded(2e-4, 1e-7)).headline


def test_steps_of_encoders_do_not_hide_what_is_more_than_they_leave() -> None:
    model = Model(arm()) + "viscous_friction"
    with_drag = Dataset(
        tuple(
            one.replace(tau=one.tau + 3.0 * np.tanh(np.gradient(one.q, one.t, axis=0) / 0.5))
            for one in rounded(2e-4, 0.0).recordings
        )
    )
    headline = fit(model, with_drag).headline
    assert "The model is rejected" in headline and "steps of encoders up to" in headline


def test_without_repetition_nothing_rejects_a_model() -> None:
    (one,) = lab.Lab(torque_std=STD, stribeck=0.4).recordings(range(1))
    assert "rejected" not in fit(lab.model(), one).headline


def test_less_than_two_periods_are_no_mistake() -> None:
    (one,) = repeated().recordings
    assert not fit(lab.model(), one.replace(period=11.0)).headline


def test_the_wider_of_two_covariances_is_at_least_each() -> None:
    rng = np.random.default_rng(0)
    A, B = rng.normal(size=(2, 4, 6)) * np.geomspace(1e-3, 1e3, 4)[:, None]
    one, other = A @ A.T, B @ B.T
    size = np.sqrt(np.diag(one + other))
    for less in (one, other):
        gap = (widened(one, other) - less) / np.outer(size, size)
        assert np.linalg.eigvalsh(gap)[0] > -1e-9
    np.testing.assert_allclose(widened(one, 0.5 * one), one, rtol=1e-9)


def test_columns_that_are_alike_but_for_rounding_have_a_wider_covariance_too() -> None:
    """Rounding may take the least eigenvalue of a covariance below zero."""
    along = np.array([1.0, 1.0]) / np.sqrt(2.0)
    across = np.array([1.0, -1.0]) / np.sqrt(2.0)
    one = np.outer(along, along) - 1e-17 * np.outer(across, across)
    wider = widened(one, 4.0 * one)
    np.testing.assert_allclose(wider, 4.0 * one, rtol=1e-6, atol=1e-9)


def test_a_period_with_which_nothing_repeats_is_refused_by_a_fit_too() -> None:
    (one,) = repeated().recordings
    assert one.period is not None
    with pytest.raises(RecordingError, match="do not repeat with the given period"):
        fit(lab.model(), one.replace(period=0.7 * one.period))
