"""Recordings with more samples than their filter keeps: fewer of them give the same rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.diagnosis.verdict import notes_on
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.fitting.sampling import Sampled, sample
from dynident.model import Model
from dynident.recording import Dataset, Filter, Noise, Recording, default_filter
from synthetic import arm, synthetic, true_values


def model() -> Model:
    made = Model(arm()) + "viscous_friction" + "coulomb_friction"
    return made.with_friction_width("elbow", 0.01)


def recording(
    rate_hz: float = 4000.0,
    period: float | None = 4.0,
    duration: float = 8.0,
    position_std: float = 0.0,
    torque_std: float = 0.0,
) -> Recording:
    return synthetic(
        model(),
        true_values(model(), Fv__shoulder=1.2, Fc__elbow=0.6),
        rate_hz=rate_hz,
        duration=duration,
        period=period,
        position_std=position_std,
        torque_std=torque_std,
    )


def both(one: Recording, settings: Filter | None = None) -> tuple[Sampled, Sampled]:
    whole = sample(one, settings)
    return whole, whole.thinned(1000.0)


@pytest.mark.parametrize(
    ("rate_hz", "period", "duration"),
    [
        (4000.0, 4.0, 8.0),
        (4000.0, None, 8.0),
        (3900.0, None, 8.0),
        (10000.0, 4.0, 8.0),
        (5000.0, 4.01, 8.02),  # 100.25 samples from row to row
        (2000.0, 0.246, 8.0),  # 41
        (5000.0, 1.63, 5.4768),
        (4850.0, None, 8.0),  # 97
    ],
)
def test_rows_are_at_the_same_instants(
    rate_hz: float, period: float | None, duration: float
) -> None:
    whole, thinner = both(recording(rate_hz, period=period, duration=duration))
    uneven = whole.parallel.step % 1 or whole.parallel.step in (41, 97)
    assert thinner.motion.rate_hz == rate_hz if uneven else thinner.motion.rate_hz < 2000.0
    assert thinner.motion.rate_hz >= 1000.0
    assert thinner.count == whole.count
    np.testing.assert_array_equal(thinner.t, whole.t)
    assert thinner.rate_hz == pytest.approx(whole.rate_hz, rel=1e-12)


def test_their_torque_and_motion_are_the_same() -> None:
    whole, thinner = both(recording(torque_std=0.1))
    inside = slice(10, -10)  # at the ends either makes up other samples beyond the record
    for signal, off in (("tau", 1e-4), ("q", 1e-5), ("v", 1e-4), ("a", 1e-3)):
        one, other = getattr(whole, signal)[inside], getattr(thinner, signal)[inside]
        assert np.abs(one - other).max() < off * np.std(one), signal


def test_friction_that_reverses_within_a_sample_is_the_same_but_for_a_thousandth() -> None:
    whole, thinner = both(recording())
    columns = [
        one.filtered(np.tanh(one.motion.v / 0.01))
        for one in (replace(whole, source=whole.motion), thinner)
    ]
    assert np.sqrt(np.mean((columns[0] - columns[1]) ** 2)) < 1e-3


def test_temperatures_are_those_of_the_samples_that_are_left() -> None:
    plain = recording()
    warming = plain.replace(
        temperature=np.linspace(20.0, 30.0, plain.samples)[:, None].repeat(2, 1)
    )
    _, thinner = both(warming)
    block = thinner.block(model())
    assert block.temperature is not None and len(block.temperature) == thinner.motion.samples
    np.testing.assert_allclose(block.temperature[:, 0], 20.0 + 10.0 * block.t / 8.0, atol=1e-9)


@pytest.mark.parametrize(
    "settings",
    [
        {"rate_hz": None},
        {"position_cutoff_hz": None},
        {"cutoff_hz": None},
        {"decimation": "chebyshev"},
        {"ends": "keep"},
        {"position_cutoff_hz": 450.0},
        {"cutoff_hz": 110.0, "rate_hz": 250.0},
    ],
)
def test_recipes_and_fast_filters_see_every_sample(settings: dict) -> None:
    filter = replace(default_filter(4000.0), **settings)
    whole, thinner = both(recording(), filter)
    assert thinner is whole


def test_a_robot_recorded_at_1_khz_keeps_its_samples() -> None:
    whole, thinner = both(recording(1000.0))
    assert thinner is whole


@pytest.mark.parametrize(
    "noise", [None, Noise(position_std=np.full(2, 1e-6), torque_std=np.full(2, 0.1))]
)
def test_a_fit_to_fewer_samples_is_the_same(noise: Noise | None) -> None:
    period = None if noise else 4.0
    every = Dataset((recording(position_std=1e-6, torque_std=0.1, period=period),), noise=noise)
    slow, fast = (
        fit_evidence(Evidence(model(), gather(every, samples_hz=samples_hz)), model())
        for samples_hz in (np.inf, 1000.0)
    )
    sigma = np.sqrt(np.diag(slow.covariance))
    assert np.all(np.abs(fast.values - slow.values) < 0.1 * sigma)
    np.testing.assert_allclose(np.sqrt(np.diag(fast.covariance)), sigma, rtol=0.02)


def test_an_answer_says_that_it_took_fewer_samples() -> None:
    for rate_hz, thinned in ((4000.0, True), (1000.0, False)):
        evidence = Evidence(model(), gather(Dataset((recording(rate_hz),)), samples_hz=1000.0))
        notes = " ".join(notes_on(evidence, None, fit_evidence(evidence, model()), "replicates"))
        assert ("thinned to 1000 Hz" in notes) == ("thinned" in notes) == thinned
