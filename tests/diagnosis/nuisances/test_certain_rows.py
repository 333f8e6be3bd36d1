"""Rows of a joint that do not count, as it sticks: nothing that is said of the joint is of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.criteria import DEFAULTS
from dynident.diagnosis.nuisances.width_notes import found_widths
from dynident.effects import effects_of
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.held_out import HeldOut, on_recordings, with_noise_of
from dynident.evidence.maps import residual_maps
from dynident.evidence.noise_model import NoiseModel
from dynident.evidence.runs import Run, gather
from dynident.evidence.stacks import Stack
from dynident.fitting.uncertainty.encoder_steps import rounding_power
from dynident.fitting.uncertainty.row_errors import row_covariance
from dynident.model import Model
from dynident.recording import Dataset, Recording
from synthetic import arm, synthetic, true_values

STD = 0.1
"""N m of noise."""
WRONG = 50.0
"""N m that the elbow's torque is off, where its rows do not count."""


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(arm()) + "viscous_friction"


def recording(model: Model, seed: int, wrong: float, period: float | None = 8.0) -> Recording:
    truth = true_values(model, Fv__shoulder=1.2, Fv__elbow=0.5)
    one = synthetic(model, truth, seed, rate_hz=250.0, torque_std=STD, period=period)
    tau = one.tau.copy()
    tau[off(one.t, 0.0), 1] += wrong
    return one.replace(tau=tau)


def off(t: np.ndarray, around: float) -> np.ndarray:
    """Within each period a second, and what filters spread it to."""
    return np.abs((t % 8.0) - 4.0) < 0.5 + around


def without(run: Run) -> Run:
    first = run.replicates[0]
    uncertain = np.zeros(first.tau.shape, dtype=bool)
    uncertain[off(first.t, 0.5), 1] = True
    return replace(run, uncertain=uncertain)


def nowhere(run: Run) -> Run:
    uncertain = np.zeros(run.replicates[0].tau.shape, dtype=bool)
    uncertain[:, 1] = True
    return replace(run, uncertain=uncertain)


def evidence(model: Model, wrong: float, period: float | None = 8.0, count: int = 1) -> Evidence:
    runs = gather(Dataset(tuple(recording(model, k, wrong, period) for k in range(count))))
    return Evidence(model, tuple(without(run) for run in runs))


def judged(of: Evidence) -> HeldOut:
    return on_recordings(of, fit_evidence(of, of.model))


def test_steps_of_encoders_count_where_the_residual_does() -> None:
    """Sharp dry friction jumps with each step around a reversal, and nowhere else."""
    robot, names = arm(), ("viscous_friction", "coulomb_friction")
    model = Model(robot, tuple(e for name in names for e in effects_of(name, robot)), 1e-3)
    truth = true_values(model, Fv__shoulder=1.2, Fv__elbow=0.5, Fc__shoulder=3.0, Fc__elbow=2.0)
    one = synthetic(model, truth, 0, rate_hz=250.0, torque_std=1e-3)
    data = Dataset((one.replace(q=np.round(one.q / 2e-4) * 2e-4),))
    (run,) = gather(data)
    slow = np.abs(run.replicates[0].v) < 0.3
    # The mean over the places between two steps: what one recording has is one of them.
    mean = replace(DEFAULTS, nuisances=replace(DEFAULTS.nuisances, rounding_deviations=0.0))
    of = Evidence(model, (replace(run, uncertain=slow),), criteria=mean)
    fitted = fit_evidence(of, model)
    seen = on_recordings(of, fitted)
    assert seen.ratio is not None and seen.noise_std is not None
    rows = [(one.t, one.certain) for one in seen.runs]
    found = np.sqrt(rounding_power(model, fitted.values, data, mean, rows))
    np.testing.assert_allclose(found, seen.ratio * seen.noise_std, rtol=0.3)
    # The shoulder shows mostly the steps in its inertia, at all speeds.
    assert np.sqrt(rounding_power(model, fitted.values, data, mean))[1] > 2.0 * found[1]


def test_sigma_is_of_the_rows_that_count(model: Model) -> None:
    found = []
    for wrong in (0.0, WRONG):
        of = evidence(model, wrong, period=None, count=2)
        data = Dataset(tuple(run.recording for run in of.runs))
        masks = [run.certain_rows for run in of.runs]
        values = fit_evidence(of, model).values
        covariance, errors = row_covariance(model, data, values, masks)
        assert errors.rows == np.sum(masks[0]) + np.sum(masks[1])
        found.append(np.sqrt(np.diag(covariance)))
        residual = judged(of).residual_rms
        np.testing.assert_allclose(np.sqrt(errors.autocovariance[:, 0]), residual, rtol=0.1)
    np.testing.assert_allclose(found[1], found[0], rtol=0.05)
    every = [np.ones_like(mask) for mask in masks]
    np.testing.assert_allclose(
        row_covariance(model, data, values, every)[0], row_covariance(model, data, values)[0]
    )


def test_maps_show_the_rows_that_count(model: Model) -> None:
    before = judged(evidence(model, WRONG))
    assert np.abs(before.runs[0].residual[:, 1]).max() > 0.5 * WRONG
    for one in residual_maps(model, before, before):
        assert np.abs(one.before).max() < STD
    none = Evidence(model, tuple(nowhere(run) for run in evidence(model, 0.0).runs))
    seen = judged(none)
    assert {one.joint for one in residual_maps(model, seen, seen)} == {"shoulder"}


def test_the_noise_of_others_is_compared_over_the_rows_that_count(model: Model) -> None:
    noise = judged(evidence(model, 0.0))
    of = evidence(model, WRONG, period=None)
    one = judged(of)
    criteria = of.criteria.noise
    half = replace(one, runs=(one.runs[0],) * 4)  # the same, of four times as many rows
    few, many = (with_noise_of(x, noise, criteria) for x in (one, half))
    assert noise.noise_std is not None and few.ratio is not None
    assert few.least_ratio is not None and many.least_ratio is not None
    excess = one.residual_rms**2 - noise.noise_std**2
    rows = one.runs[0].certain.sum(axis=0)
    assert rows[1] < 0.9 * rows[0]
    spread = 1.645 * noise.noise_std**2 * np.sqrt(2.0 * noise.inflation / rows)
    assert (np.abs(excess) < 2 * spread).all(), "rows that do not count are in the residual"
    louder = replace(noise, noise_std=0.5 * one.residual_rms)
    quantile = 3.0 - np.array(with_noise_of(one, louder, criteria).least_ratio) ** 2
    assert quantile[1] / quantile[0] == pytest.approx(
        np.sqrt(noise.inflation[1] / rows[1] / (noise.inflation[0] / rows[0]))
    )
    silent = judged(Evidence(model, tuple(nowhere(run) for run in of.runs)))
    assert np.array(with_noise_of(silent, noise, criteria).ratio)[1] == 0.0


def test_a_recording_or_a_joint_without_rows_that_count(model: Model) -> None:
    of = evidence(model, 0.0, count=2)
    first, second = of.runs
    one, both = judged(of.with_runs((first,))), judged(of.with_runs((first, nowhere(second))))
    assert one.noise_std is not None and both.noise_std is not None
    assert both.noise_std[1] == pytest.approx(one.noise_std[1], rel=0.05)
    none = of.with_runs((nowhere(first), nowhere(second)))
    fitted = fit_evidence(none, model)
    assert np.isfinite(fitted.values).all()
    assert fitted.squares[1] == 0.0
    seen = on_recordings(none, fitted)
    for found in (seen.noise_std, seen.ratio, seen.least_ratio, seen.residual_rms):
        assert found is not None and found[1] == 0.0 and found[0] >= 0.0


@pytest.mark.parametrize("period", [8.0, None])
def test_whitening_carries_nothing_out_of_rows_that_do_not_count(
    model: Model, period: float | None
) -> None:
    """A filter that looks back would see them in the rows after them."""
    colour = np.array([1.0, -0.7, 0.4, -0.2, 0.1])
    noise = NoiseModel(1.0, np.zeros(1), np.ones(1), colour)
    run = evidence(model, 0.0, period).runs[0]
    rng = np.random.default_rng(0)
    signals = rng.standard_normal((len(run.replicates[0].t), 3))
    off_rows = (~run.certain_rows[:, 1])[:, None]
    assert np.any(off_rows) and not np.all(off_rows)

    def white(of: Run, joint: int, wrong: float = 0.0) -> np.ndarray:
        stack = Stack((of,))
        return stack.unfolded(stack.whitened([[[signals + wrong * off_rows]]], joint, noise))

    found = [white(run, 1, wrong) for wrong in (0.0, WRONG)]
    assert np.array_equal(found[0], found[1])
    plain = [white(run, 0, wrong) for wrong in (0.0, WRONG)]
    assert not np.allclose(plain[0], plain[1])
    # Far from these rows all is as it is elsewhere.
    whole = white(replace(run, uncertain=None), 1)
    assert np.mean(np.all(found[0] == whole, axis=-1)) > 0.5


def test_of_a_joint_that_sticks_no_width_is_said_to_be_found() -> None:
    robot = arm()
    names = ("viscous_friction", "coulomb_friction")
    model = Model(robot, tuple(e for name in names for e in effects_of(name, robot)), 0.05)
    of = evidence(model, 0.0)
    wider = model.with_friction_width("elbow", 0.2).with_friction_width("shoulder", 0.2)
    shoulder, elbow = found_widths(of, fit_evidence(of, wider)).notes
    assert "over which dry friction reverses" in shoulder
    assert "by the rows that count" in elbow and "no finding" in elbow
    assert "friction_width =" not in shoulder + elbow  # neither is known
