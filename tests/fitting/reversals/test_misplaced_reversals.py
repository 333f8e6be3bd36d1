"""Rows around reversals that filters and sampling put at another moment do not bias a fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import dynident as di
from carriage import COULOMB, MASS, SEEDS, VISCOUS, model, recorded
from dynident.fitting.reversals import joint_speeds, misplaced_reversals
from dynident.fitting.reversals.misplaced_reversals import (
    within_samples,
    without_misplaced_reversals,
)
from dynident.fitting.sampling import sample


def deviations(hz: float, force_std: float) -> np.ndarray:
    """Errors of mass, viscous and Coulomb friction in their sigma, (seeds, 3)."""
    found = []
    for seed in range(SEEDS):
        one = di.fit(model(), recorded(hz, force_std, seed))
        found.append((one.values - [MASS, VISCOUS, COULOMB]) / one.sigma)
    return np.array(found)


@pytest.mark.slow
def test_the_mass_is_right_though_friction_reverses_within_a_sample(monkeypatch) -> None:
    def size() -> float:
        return float(np.sqrt(np.mean(deviations(0.5, 0.02) ** 2)))

    assert size() < 1.3
    monkeypatch.setattr(misplaced_reversals, "_MATTERS", np.inf)
    assert size() > 2.5


@pytest.mark.slow
def test_an_estimate_says_which_rows_it_left_out() -> None:
    found = di.fit(model(), recorded(0.5, 0.05, 0))
    (note,) = (one for one in found.notes if "reversals of slider" in one)
    assert "do not count" in note and "% of its rows" in note
    noisy = di.fit(model(), recorded(0.5, 20.0, 0))
    assert not any("reversals" in one for one in noisy.notes)
    assert noisy.rows > found.rows


@pytest.mark.slow
def test_what_is_left_of_them_is_the_first_thing_said() -> None:
    """Of a motion so fast, and noise so small, that the rows that count are wrong, too."""
    assert "reverses within" not in di.fit(model(), recorded(0.5, 0.05, 0)).headline
    found = di.fit(model(), recorded(2.0, 1e-3, 0))
    assert "gives no 95 % intervals" in found.headline and "N at slider" in found.headline


@pytest.mark.parametrize("settings", [{"ends": "keep"}, {}])
def test_a_recipe_and_a_noisy_recording_keep_every_row(settings) -> None:
    data = recorded(0.5, 20.0 if not settings else 0.05, 1)
    assert data.filter is not None
    data = replace(data, filter=replace(data.filter, **settings))
    assert without_misplaced_reversals(di.fit(model(), data), data) is data


def test_never_are_most_rows_of_a_moving_joint_left_out() -> None:
    data = recorded(2.0, 1e-3, 0)
    found = di.fit(model(), data)
    marked = without_misplaced_reversals(replace(found, torque_std=np.array([1e-4])), data)
    left_out = 1.0 - sample(marked.recordings[0], marked.filter).counting.mean()
    assert marked is data or 0.0 < left_out <= 0.6


def test_long_recordings_are_looked_at_part_by_part(monkeypatch) -> None:
    data = recorded(0.5, 0.05, 2)
    found = di.fit(model(), data)
    whole = without_misplaced_reversals(found, data)
    monkeypatch.setattr(joint_speeds, "BLOCK", 500)
    parts = without_misplaced_reversals(found, data)
    masks = [sample(one.recordings[0], one.filter).counting for one in (whole, parts)]
    assert np.mean(masks[0] != masks[1]) < 0.01
    assert np.mean(~masks[0]) > 0.05


def test_the_mean_over_a_sample_is_that_of_a_steady_acceleration() -> None:
    v = np.array([-0.3, -0.1, 0.02, 0.05, 0.05, 0.05, -1e-9, 4.0])
    found = within_samples(v, 0.03) + np.tanh(v / 0.03)
    for k in range(1, len(v) - 1):
        steps = np.linspace(v[k - 1] + v[k], v[k] + v[k + 1], 20001) / 2.0
        mean = np.trapezoid(np.tanh(steps / 0.03), dx=1.0 / 20000)
        assert found[k] == pytest.approx(mean, abs=1e-3 if k < 7 else 1e-2)
