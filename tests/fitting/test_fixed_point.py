"""A fit whose columns depend on its result: when its repetitions come no nearer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from dynident.fitting.fixed_point import FixedPoint
from dynident.model import Model
from synthetic import arm

ROUNDS = 30


def rounds_of(found: Callable[[np.ndarray], np.ndarray], tolerance: float = 1e-4) -> int:
    """Repetitions until values agree with what is found with them, or stall."""
    model, fixed_point = Model(arm()), FixedPoint()
    at = model.given_values()
    for k in range(ROUNDS):
        values = found(at)
        if np.linalg.norm(values - at) < tolerance * np.linalg.norm(values) or fixed_point.stalls:
            return k + 1
        at = fixed_point.following(model, at, values)
    return ROUNDS


@pytest.mark.parametrize("rate", [0.2, 0.7])
def test_values_that_come_nearer_are_followed_to_their_end(rate: float) -> None:
    end = 1.1 * Model(arm()).given_values()
    reached = rounds_of(lambda at: end + rate * (at - end))
    expected = np.log(1e-4 / ((1.0 - rate) * 0.1 / 1.1)) / np.log(rate)
    assert expected <= reached <= expected + 2


def test_values_that_jump_to_and_fro_by_a_little_are_not() -> None:
    rng = np.random.default_rng(0)
    end = 1.1 * Model(arm()).given_values()
    size = 5e-4 * np.linalg.norm(end) / np.sqrt(len(end))

    def jumping(at: np.ndarray) -> np.ndarray:
        return end + 0.3 * (at - end) + size * rng.normal(size=len(end))

    assert 6 <= rounds_of(jumping) <= 15


def test_values_that_jump_by_much_are_not_followed_either() -> None:
    """As the angle of a tilt does that no row tells."""
    rng = np.random.default_rng(0)
    given = Model(arm()).given_values()
    assert 6 <= rounds_of(lambda at: given * rng.uniform(0.1, 10.0)) <= 20


def test_values_far_away_that_come_nearer_slowly_are_followed() -> None:
    end = 10.0 * Model(arm()).given_values()
    assert rounds_of(lambda at: end + 0.95 * (at - end)) == ROUNDS


def test_values_far_from_their_end_do_not_stall() -> None:
    """They swing ever wider, and shorter steps bring them together."""
    end = 1.1 * Model(arm()).given_values()
    assert rounds_of(lambda at: end - 1.2 * (at - end)) < ROUNDS


def test_values_that_hardly_move_at_first_are_followed_to_their_end() -> None:
    """As a tilt of milliradians beside heavy bodies, whose angle is fitted in a later round."""
    model, fixed_point = Model(arm()), FixedPoint()
    given = model.given_values()
    for size in (0.0026, *(0.0102 * 0.75**k for k in range(12))):
        assert not fixed_point.stalls
        fixed_point.following(model, given, (1.0 + size) * given)


@pytest.mark.parametrize("rate", [-0.8, -3.0, -9.0])
def test_on_a_line_the_second_step_ends_a_swing(rate: float) -> None:
    """However far it has grown first."""
    given = Model(arm()).given_values()
    end, off = 10.0 * given, []

    def found(at: np.ndarray) -> np.ndarray:
        off.append(float(np.linalg.norm(at - end) / np.linalg.norm(end)))
        return end + rate * (at - end)

    assert rounds_of(found, 1e-9) == 3
    assert off[1] == pytest.approx(-rate * off[0]) and off[-1] < 1e-9


def test_a_step_that_was_cut_is_measured_as_it_was() -> None:
    """As where an estimate cannot be simulated, and a part of the way to it is gone."""
    model, fixed_point = Model(arm()), FixedPoint()
    end = 1.1 * model.given_values()

    def found(at: np.ndarray) -> np.ndarray:
        return end - 9.0 * (at - end)

    at = model.given_values()
    cut = at + 0.25 * (fixed_point.following(model, at, found(at)) - at)
    np.testing.assert_allclose(fixed_point.following(model, cut, found(cut)), end, rtol=1e-12)


def test_values_that_creep_away_from_their_start_are_not_held_back() -> None:
    """Each step is longer than the one before, and none swings."""
    end = Model(arm()).given_values()
    at, model, fixed_point = 1e-3 * end, Model(arm()), FixedPoint()
    for _ in range(25):
        share = at / end
        at = fixed_point.following(model, at, at + 0.9 * at * (1.0 - share))
    np.testing.assert_allclose(at, end, rtol=1e-3)


@pytest.mark.parametrize("rates", [(-9.0, -3.0), (-1.5, 0.6), (-0.9, 0.0)])
def test_values_that_swing_are_brought_together(rates: tuple[float, float]) -> None:
    """Each parameter at a rate of its own, some beyond -1."""
    given = Model(arm()).given_values()
    end, last = 10.0 * given, []
    rate = np.linspace(*rates, len(given))

    def found(at: np.ndarray) -> np.ndarray:
        last.append(float(np.linalg.norm(at - end) / np.linalg.norm(end)))
        return end + rate * (at - end)

    assert rounds_of(found, 1e-3) <= ROUNDS / 2
    assert last[-1] < 5e-3
