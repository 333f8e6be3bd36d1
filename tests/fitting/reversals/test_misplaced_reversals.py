"""Rows around reversals that filters and sampling put at another moment do not bias a fit."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import dynident as di
from dynident.fitting.reversals import joint_speeds, misplaced_reversals
from dynident.fitting.reversals.misplaced_reversals import (
    within_samples,
    without_misplaced_reversals,
)
from dynident.fitting.sampling import sample
from dynident.recording import Dataset, Recording, common_filter

CARRIAGE = """<robot name="carriage"><link name="rail"/><link name="carriage"><inertial>
<mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
</inertial></link>
<joint name="slider" type="prismatic"><parent link="rail"/><child link="carriage"/>
<axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="100" velocity="10"/></joint></robot>"""
MASS, VISCOUS, COULOMB, WIDTH = 2.0, 1.0, 3.0, 0.01
RATE_HZ, STEPS, SECONDS, SEEDS = 200.0, 40, 24.0, 24


def model() -> di.Model:
    robot = di.Robot.from_text(CARRIAGE)
    kinds = ("viscous_friction", "coulomb_friction")
    effects = tuple(effect for kind in kinds for effect in di.effects_of(kind, robot))
    return di.Model(robot, effects, friction_width=WIDTH)


@lru_cache
def driven(hz: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Carriages that held commands drive after a reference, integrated in steps of 125 us.

    Parameters
    ----------
    hz : of the slowest of three waves.

    Returns
    -------
    t (T,) s, q (T, seeds) m, command (T, seeds) N, without noise.
    """
    rng = np.random.default_rng(0)
    amplitude, phase = rng.uniform(0.5, 1.0, (3, SEEDS)), rng.uniform(0.0, 2 * np.pi, (3, SEEDS))
    w = 2.0 * np.pi * hz * np.arange(1.0, 4.0)[:, None]
    t, h = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ, 1.0 / RATE_HZ / STEPS
    q = np.sum(0.1 * amplitude * np.sin(phase) / w, axis=0)
    v = np.zeros(SEEDS)
    positions, commands = np.zeros((len(t), SEEDS)), np.zeros((len(t), SEEDS))
    for k, now in enumerate(t):
        there = np.sum(0.1 * amplitude * np.sin(w * now + phase) / w, axis=0)
        speed = np.sum(0.1 * amplitude * np.cos(w * now + phase), axis=0)
        u = 800.0 * (there - q) + 60.0 * (speed - v) + COULOMB * np.tanh(speed / 0.05)
        positions[k], commands[k] = q, u
        for _ in range(STEPS):
            a = (u - VISCOUS * v - COULOMB * np.tanh(v / WIDTH)) / MASS
            v = v + h * a
            q = q + h * v
    return t, positions, commands


def recorded(hz: float, force_std: float, seed: int) -> Dataset:
    t, q, command = driven(hz)
    rng = np.random.default_rng([seed, 1])
    force = command[:, seed] + force_std * rng.normal(size=len(t))
    one = Recording(t, q[:, [seed]], force[:, None], ("slider",), torque="held_command")
    return Dataset((one.replace(window=(1.0, SECONDS)),), common_filter([one]))


def deviations(hz: float, force_std: float) -> np.ndarray:
    """Errors of mass, viscous and Coulomb friction in their sigma, (seeds, 3)."""
    found = []
    for seed in range(SEEDS):
        one = di.fit(model(), recorded(hz, force_std, seed))
        found.append((one.values - [MASS, VISCOUS, COULOMB]) / one.sigma)
    return np.array(found)


def test_the_mass_is_right_though_friction_reverses_within_a_sample(monkeypatch) -> None:
    def size() -> float:
        return float(np.sqrt(np.mean(deviations(0.5, 0.02) ** 2)))

    assert size() < 1.3
    monkeypatch.setattr(misplaced_reversals, "_MATTERS", np.inf)
    assert size() > 2.5


def test_an_estimate_says_which_rows_it_left_out() -> None:
    found = di.fit(model(), recorded(0.5, 0.05, 0))
    (note,) = (one for one in found.notes if "reversals of slider" in one)
    assert "do not count" in note and "% of its rows" in note
    noisy = di.fit(model(), recorded(0.5, 20.0, 0))
    assert not any("reversals" in one for one in noisy.notes)
    assert noisy.rows > found.rows


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
