"""Instruments that need no simulation: swapped periods, strong filters, the true motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import dynident as di
from dynident.errors import DynidentError, FitError
from dynident.fitting import IV, Filtered, LeastSquares, SwappedPeriods, rows
from dynident.fitting.instrumental.measured_instruments import FixedInstruments
from dynident.model import Model
from dynident.recording import Dataset, Filter, Recording
from synthetic import arm, synthetic

NO_FILTER = Filter()
INNER = (0.5, 5.5)
"""s: away from the ends of every recording here."""
INERTIAL = slice(0, 6)


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction"


@pytest.fixture(scope="module")
def truth(model: Model) -> np.ndarray:
    values = model.given_values()
    values[model.base.rank :] = (1.0, 0.5)
    return values


@dataclass(frozen=True)
class Oracle:
    """The true motion as the instrument."""

    true: Recording
    name: str = "true motion"

    def prepare(self, model, dataset, guess):
        cut = tuple(r.replace(window=r.window or INNER) for r in (*dataset.recordings, self.true))
        own, other = (replace(dataset, recordings=(one,)) for one in cut)
        return FixedInstruments(measured=own, instruments=other, notes=(), noise_share=1.0)


def error(values: np.ndarray, truth: np.ndarray) -> float:
    return float(np.linalg.norm((values - truth)[INERTIAL]) / np.linalg.norm(truth[INERTIAL]))


def test_instruments_that_are_the_regressor_give_least_squares(model, truth):
    recording = synthetic(model, truth, 1, rate_hz=200.0, duration=8.0, position_std=1e-5)
    dataset = Dataset((recording.replace(window=INNER),), NO_FILTER)
    ours = di.fit(model, dataset, IV(Oracle(recording)))
    theirs = di.fit(model, dataset, LeastSquares())
    np.testing.assert_allclose(ours.values, theirs.values, rtol=1e-9, atol=1e-12)
    assert ours.error == pytest.approx(theirs.error, rel=1e-9)


def test_solves_the_instrumental_normal_equations(model, truth):
    true = synthetic(model, truth, 1, rate_hz=200.0, duration=8.0)
    noisy = synthetic(model, truth, 1, rate_hz=200.0, duration=8.0, position_std=3e-5)
    settings = replace(NO_FILTER, difference_order=2)
    dataset = Dataset((noisy.replace(window=INNER),), settings)
    found = di.fit(model, dataset, IV(Oracle(true), weighting="none"))
    ((W, y),) = rows(model, dataset)
    ((V, _),) = rows(model, Dataset((true.replace(window=INNER),), settings))
    W, V, y = W.reshape(-1, model.size), V.reshape(-1, model.size), y.ravel()
    np.testing.assert_allclose(V.T @ (y - W @ found.values), 0.0, atol=1e-9 * np.abs(V.T @ y).max())
    assert found.history is not None
    simulated = np.linalg.norm(y - V @ found.values) / np.linalg.norm(y)
    measured = np.linalg.norm(y - W @ found.values) / np.linalg.norm(y)
    assert found.history.errors_simulated[-1] == pytest.approx(simulated)
    assert found.error == pytest.approx(measured)


@pytest.mark.parametrize(
    "method", [IV(SwappedPeriods()), IV(Filtered(8.0))], ids=["swap", "filter"]
)
def test_noise_that_ruins_least_squares_is_mended(model, truth, method):
    recording = synthetic(model, truth, 2, rate_hz=200.0, duration=32.0, position_std=1e-4)
    dataset = Dataset((recording,), NO_FILTER)
    plain = error(di.fit(model, dataset).values, truth)
    mended = error(di.fit(model, dataset, method).values, truth)
    assert plain > 0.05
    assert mended < plain / 5


@pytest.mark.slow
def test_noise_is_measured_and_carried_to_honest_intervals(model, truth):
    """95 % intervals of 100 noisy recordings of one motion; 8 parameters are counted together."""
    std = np.array([2e-5, 4e-5])
    true = synthetic(model, truth, 3, rate_hz=200.0, duration=6.0)
    quiet = IV(Oracle(true)).fit(model, Dataset((true,), NO_FILTER)).values
    inside, levels, ratio = [], [], []
    for seed in range(100):
        noise = std * np.random.default_rng(seed).standard_normal(true.q.shape)
        dataset = Dataset((true.replace(q=true.q + noise),), NO_FILTER)
        found = IV(Oracle(true)).fit(model, dataset)
        assert found.history is not None
        inside.append(np.abs(found.values - quiet) < 1.96 * found.sigma)
        levels.append(found.history.position_std)
        ratio.append(found.history.textbook_sigma / found.sigma)
    np.testing.assert_allclose(np.mean(levels, axis=0), std, rtol=0.02)
    # 100 draws of strongly correlated parameters: 0.95 within 3 of its standard errors.
    assert 0.90 < np.mean(inside) < 0.99
    # Encoder noise is a second difference in the residual: as if independent it is far too wide.
    assert np.median(ratio) > 5


@pytest.mark.parametrize("position_cutoff", [None, 30.0])
@pytest.mark.slow
def test_intervals_hold_behind_filters_and_decimation(model, truth, position_cutoff):
    filter = Filter(position_cutoff_hz=position_cutoff, cutoff_hz=15.0, rate_hz=50.0)
    true = synthetic(model, truth, 3, rate_hz=200.0, duration=6.0)
    instrument = true.replace(window=(1.0, 5.0))
    # What differences and filters make of the motion itself is not noise.
    quiet = IV(Oracle(instrument)).fit(model, Dataset((instrument,), filter)).values
    scores = []
    for seed in range(40):
        noise = 5e-5 * np.random.default_rng(seed).standard_normal(true.q.shape)
        dataset = Dataset((true.replace(q=true.q + noise, window=(1.0, 5.0)),), filter)
        found = IV(Oracle(instrument)).fit(model, dataset)
        scores.append((found.values - quiet) / found.sigma)
    # Mean square of a standard normal variate over 40 draws: 1 within 4 standard errors (0.9).
    mean_square = np.mean(np.square(scores), axis=0)
    assert np.all(mean_square < 1.9) and np.all(mean_square > 0.4)


def test_bias_of_dry_friction_is_foreseen(truth):
    """Columns that bend within the noise stay biased: the output says by how much."""
    model = Model(arm(), friction_width=0.01) + "viscous_friction" + "coulomb_friction"
    values = np.append(truth, (1.5, 0.8))
    true = synthetic(model, values, 4, rate_hz=200.0, duration=16.0).replace(window=(0.5, 15.5))
    noisy = synthetic(model, values, 4, rate_hz=200.0, duration=16.0, position_std=3e-4)
    found = di.fit(
        model, Dataset((noisy.replace(window=(0.5, 15.5)),), NO_FILTER), IV(Oracle(true))
    )
    assert found.history is not None
    shoulder = model.names.index("Fc@shoulder")
    bias = found.history.expected_bias[shoulder]
    assert np.isfinite(bias) and abs(bias) > 3 * found.history.sigma[shoulder]
    assert found.sigma[shoulder] >= abs(bias)
    assert found.values[shoulder] - 1.5 == pytest.approx(bias, rel=0.2)
    assert any("dry friction" in note for note in found.notes)
    assert any("Fc@shoulder" in note for note in found.notes)


def test_without_a_period_nothing_is_swapped(model, truth):
    recording = synthetic(model, truth, 1, rate_hz=200.0, duration=8.0, period=None)
    with pytest.raises(FitError, match="no recording repeats"):
        di.fit(model, recording, IV(SwappedPeriods()))


def test_less_than_two_periods_are_refused(model, truth):
    recording = synthetic(model, truth, 1, rate_hz=200.0, duration=12.0, period=8.0)
    with pytest.raises(FitError, match="no two whole periods"):
        di.fit(model, recording, IV(SwappedPeriods()))


def test_instruments_that_miss_a_direction_are_a_rank_note(model, truth):
    """An elbow that stands still in the instruments excites less: said, not guessed."""
    recording = synthetic(model, truth, 1, rate_hz=200.0, duration=8.0)
    still = recording.replace(q=np.column_stack([recording.q[:, 0], 0.0 * recording.q[:, 1]]))
    found = di.fit(model, Dataset((recording,), NO_FILTER), IV(Oracle(still)))
    assert any("rank" in note for note in found.notes)
    assert found.basis.rank < model.size


@pytest.mark.parametrize(
    "make",
    [
        lambda: IV(None),  # type: ignore[arg-type]
        lambda: IV(SwappedPeriods(), start="nowhere"),  # type: ignore[arg-type]
        lambda: IV(SwappedPeriods(), tolerance=0.0),
        lambda: Filtered(-1.0),
    ],
)
def test_wrong_settings_get_one_line(make):
    with pytest.raises(DynidentError) as caught:
        make()
    assert "\n" not in str(caught.value)
