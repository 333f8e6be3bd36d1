"""Central differences and held commands, to an order of accuracy."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from dynident.errors import RecordingError
from dynident.recording import Filter, Recording, central_difference, differentiate
from dynident.recording.derivatives import (
    ORDERS,
    difference_gain,
    held_gain,
    held_torque,
    held_torque_adjoint,
)

RATE = 100.0


@pytest.mark.parametrize("order", ORDERS)
def test_differences_are_exact_for_polynomials_of_their_order(order: int) -> None:
    t = np.arange(40) / RATE
    slope = central_difference(t**order, RATE, order)
    inside = slice(order // 2, -(order // 2))
    np.testing.assert_allclose(slope[inside], (order * t ** (order - 1))[inside], rtol=1e-9)


@pytest.mark.parametrize("order", ORDERS)
def test_rows_beside_the_ends_have_the_order_that_they_permit(order: int) -> None:
    x = np.random.default_rng(0).normal(size=(30, 3))
    found = central_difference(x, RATE, order)
    for row in range(1, order // 2):
        lower = central_difference(x, RATE, 2 * row)
        np.testing.assert_allclose(found[[row, -1 - row]], lower[[row, -1 - row]], rtol=1e-10)
    np.testing.assert_allclose(found[[0, -1]], RATE * np.stack([x[1] - x[0], x[-1] - x[-2]]))


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("rows", [2, 3, 4, 5, 7])
def test_short_signals_are_differentiated_too(order: int, rows: int) -> None:
    t = np.arange(rows) / RATE
    np.testing.assert_allclose(central_difference(3.0 * t, RATE, order), 3.0)
    np.testing.assert_allclose(held_torque(np.full((rows, 2), 7.0), order), 7.0)


@pytest.mark.parametrize("order", ORDERS)
def test_gains_are_those_of_waves(order: int) -> None:
    for hz in (1.0, 7.0, 23.0, 41.0):
        t = np.arange(400) / RATE
        angle = 2.0 * np.pi * hz / RATE
        slope = central_difference(np.sin(2.0 * np.pi * hz * t), RATE, order)[200]
        expected = RATE * difference_gain(np.array([angle]), order)[0]
        assert slope == pytest.approx(expected * np.cos(2.0 * np.pi * hz * t[200]), abs=1e-9 * RATE)
        held = held_torque(np.sin(2.0 * np.pi * hz * (t + 0.5 / RATE)), order)[200]
        expected = held_gain(np.array([angle]), order)[0]
        assert held == pytest.approx(expected * np.sin(2.0 * np.pi * hz * t[200]), abs=1e-9)


@pytest.mark.parametrize("order", ORDERS)
def test_the_adjoint_carries_torques_to_their_commands(order: int) -> None:
    rng = np.random.default_rng(1)
    command, weights = rng.normal(size=(60, 2)), np.zeros((60, 2))
    weights[10:-10] = rng.normal(size=(40, 2))
    there = np.sum(weights * held_torque(command, order))
    assert there == pytest.approx(np.sum(held_torque_adjoint(weights, order) * command))


@pytest.mark.parametrize(("order", "least", "most"), [(2, 5e-3, 2e-2), (8, 0.0, 2e-5)])
def test_a_mass_that_held_commands_move_weighs_what_it_does(
    order: Literal[2, 8], least: float, most: float
) -> None:
    """Exactly integrated: positions that a held force of up to 4 Hz makes, at 100 Hz."""
    t, mass, step = np.arange(400) / RATE, 2.0, 1.0 / RATE
    force = np.sin(2 * np.pi * t) + np.cos(2 * np.pi * 4.0 * t)
    v = np.concatenate([[0.0], np.cumsum(force[:-1]) * step / mass])
    moved = v[:-1] * step + force[:-1] * step**2 / (2.0 * mass)
    q = np.concatenate([[0.0], np.cumsum(moved)])
    recording = Recording(t, q[:, None], force[:, None], ("slider",), torque="held_command")
    motion = differentiate(recording, Filter(difference_order=order))
    inside = slice(20, -20)
    a, tau = motion.a[inside, 0], motion.tau[inside, 0]
    assert least <= abs(a @ tau / (a @ a) / mass - 1.0) < most


def test_differences_are_of_high_order_behind_a_low_pass() -> None:
    assert Filter().order == 2
    assert Filter(position_cutoff_hz=40.0).order == 8
    assert Filter(position_cutoff_hz=40.0, difference_order=2).order == 2
    assert "differences of order 2" in Filter(difference_order=2).description
    with pytest.raises(RecordingError, match="write 2, 4, 6 or 8"):
        Filter(difference_order=3)  # type: ignore[arg-type]
