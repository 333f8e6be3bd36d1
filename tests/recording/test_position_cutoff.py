"""The low-pass of the positions: noise that it lets through against reversals that it rounds."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from dynident.recording import (
    Dataset,
    Filter,
    Recording,
    SpeedGain,
    central_difference,
    common_filter,
    filtered_alike,
    lowpass,
    suited_filter,
    suited_position_cutoff,
    with_suited_order,
)

Order = Literal[2, 8]
RATE = 1000.0
USUAL = 40.0


def moved(std: float, *, rate: float = RATE, step: float = 0.0, scale: float = 1.0) -> Recording:
    """Two joints behind encoders, of which one turns round beside jumps of its acceleration."""
    t = np.arange(0.0, 12.0, 1.0 / rate)
    x, turns = 3.0 * t, np.rint(3.0 * t / np.pi)
    grows = 2.0 * turns + np.cos(np.pi * turns) * np.sin(x)  # with the speed |cos x|
    swing = np.column_stack([np.sin(x) + 0.1 * (grows - 2.0 * x / np.pi), np.cos(2.0 * t)])
    q = swing + std * np.random.default_rng(1).normal(size=swing.shape)
    q = np.round(q / step) * step if step else q
    return Recording(t, scale * q, np.zeros_like(q), ("shoulder", "elbow"))


@pytest.mark.parametrize("order", [2, 8])
@pytest.mark.parametrize("cutoff", [None, 20.0, 100.0])
def test_noise_of_speeds_is_what_is_said(cutoff: float | None, order: Order) -> None:
    q = np.random.default_rng(0).normal(size=(200_000, 1))
    q = q if cutoff is None else lowpass(q, RATE, cutoff)
    found = central_difference(q, RATE, order)[1000:-1000].std()
    settings = Filter(position_cutoff_hz=cutoff, difference_order=order)
    assert SpeedGain(RATE, settings).noise == pytest.approx(found, rel=0.02)


@pytest.mark.parametrize("order", [2, 8])
@pytest.mark.parametrize("cutoff", [None, 20.0, 100.0, 400.0])
def test_speed_that_is_made_up_at_a_jump_is_what_is_said(
    cutoff: float | None, order: Order
) -> None:
    """The speed is zero, and from an instant on it rises by 1 rad/s in each second."""
    t = np.arange(-2000, 2001) / RATE
    q = np.where(t > 0.0, 0.5 * t**2, 0.0)[:, None]
    q = q if cutoff is None else lowpass(q, RATE, cutoff)
    found = central_difference(q, RATE, order)[2000, 0]
    settings = Filter(position_cutoff_hz=cutoff, difference_order=order)
    assert SpeedGain(RATE, settings).rounding == pytest.approx(found, rel=0.01)


def test_the_finer_the_encoders_the_higher_the_cutoff() -> None:
    stds = (0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
    found = [suited_position_cutoff([moved(std)], 18.0) for std in stds]
    assert found == sorted(found, reverse=True)
    assert found[0] == 8 * USUAL and found[-1] == USUAL


@pytest.mark.parametrize("std", [1e-6, 1e-3])
def test_units_do_not_choose(std: float) -> None:
    ours, others = (suited_position_cutoff([moved(std, scale=k)], 18.0) for k in (1.0, 57.3))
    assert ours == others


def test_steps_of_a_coarse_encoder_are_noise_though_it_hardly_ever_steps() -> None:
    """A joint that stays between two counts for most of the time shows no differences."""
    fast, slow = moved(0.0, step=2e-3), moved(0.0, step=2e-3)
    waits = slow.q[np.searchsorted(slow.t, 8.0)]
    slow = slow.replace(q=np.where(slow.t[:, None] < 8.0, waits, slow.q))
    assert suited_position_cutoff([fast], 18.0) == suited_position_cutoff([slow], 18.0) == USUAL


@pytest.mark.parametrize(
    ("rate", "expected"),
    [(100.0, 40.0), (250.0, 80.0), (500.0, 160.0), (799.99, 320.0), (5000.0, 320.0)],
)
def test_a_slow_clock_bounds_it(rate: float, expected: float) -> None:
    assert suited_filter([moved(0.0, rate=rate)]).position_cutoff_hz == pytest.approx(expected)


@pytest.mark.parametrize("std", [1e-6, 1e-5, 1e-3])
@pytest.mark.parametrize("where", [0.0, 0.3, 1e3])
@pytest.mark.parametrize("dither", [0.0, 1e-7])
def test_joints_that_stand_choose_nothing(std: float, where: float, dither: float) -> None:
    one = moved(std)
    rng = np.random.default_rng(2)
    still = where + dither * rng.integers(0, 2, size=(one.samples, 5))
    q = np.hstack([one.q, still])
    beside = Recording(one.t, q, np.zeros_like(q), tuple("abcdefg"))
    assert suited_position_cutoff([beside], 18.0) == suited_position_cutoff([one], 18.0)


def test_nor_does_the_time_in_which_all_stand() -> None:
    one = moved(1e-6)
    count = 20 * one.samples
    waits = one.q[-1] + 1e-6 * np.random.default_rng(3).normal(size=(count, 2))
    q = np.concatenate([one.q, waits, one.q])
    paused = Recording(np.arange(len(q)) / RATE, q, np.zeros_like(q), one.joints)
    assert suited_position_cutoff([paused], 18.0) == suited_position_cutoff([one], 18.0)


def test_what_is_outside_of_a_window_does_not_count() -> None:
    fine, coarse = moved(1e-6), moved(1e-3)
    q = np.concatenate([coarse.q, fine.q])
    both = Recording(np.arange(len(q)) / RATE, q, np.zeros_like(q), fine.joints)
    windows = (None, (0.0, 12.0), (12.0, 24.0))
    found = [suited_position_cutoff([both.replace(window=one)], 18.0) for one in windows]
    assert found[1:] == [USUAL, 8 * USUAL] and found[0] < 8 * USUAL


@pytest.mark.parametrize("std", [2e-4, 1e-3])
def test_noise_that_a_drive_has_filtered_is_seen(std: float) -> None:
    """Behind 100 Hz hardly any is left near half the rate of the samples."""
    one = moved(0.0)
    noise = lowpass(std * np.random.default_rng(4).normal(size=one.q.shape), RATE, 100.0)
    assert suited_position_cutoff([one.replace(q=one.q + noise)], 18.0) == USUAL


def test_without_a_low_pass_of_the_torque_the_usual_one_stays() -> None:
    assert suited_position_cutoff([moved(0.0)], None) == USUAL


def test_a_recording_that_is_too_short_to_tell_has_the_usual_one() -> None:
    for samples in (2, 13, 300):
        assert suited_position_cutoff([moved(0.0).part(slice(0, samples))], 18.0) == USUAL


def test_of_rates_that_call_for_different_filters_none_is_common() -> None:
    assert common_filter([moved(0.0, rate=100.0), moved(0.0)]) is None
    for rates in ((1000.0, 400.0), (100.0, 101.0)):
        every = [moved(0.0, rate=one) for one in rates]
        assert common_filter(every) == suited_filter(every)


def swinging(std: float, rate: float) -> Recording:
    """Two joints that swing at 1 and 2 Hz, behind encoders with noise of so many rad."""
    t = np.arange(0.0, 12.0, 1.0 / rate)
    q = np.column_stack([np.sin(2.0 * np.pi * t), 0.5 * np.cos(4.0 * np.pi * t)])
    q += std * np.random.default_rng(2).normal(size=q.shape)
    return Recording(t, q, np.zeros_like(q), ("shoulder", "elbow"))


def test_the_finer_the_encoders_the_higher_the_order_of_raw_differences() -> None:
    stds = (0.0, 1e-6, 1e-5, 1e-4, 1e-3)
    found = [with_suited_order(Filter(), [swinging(std, 200.0)]).order for std in stds]
    assert found == sorted(found, reverse=True)
    assert found[0] > found[-1] == 2


def test_what_a_low_pass_of_the_rows_takes_off_does_not_choose_the_order() -> None:
    rough = swinging(1e-4, 200.0)
    assert with_suited_order(Filter(), [rough]).order == 2
    assert with_suited_order(Filter(cutoff_hz=10.0, rate_hz=40.0), [rough]).order >= 6


def one_joint(q: np.ndarray) -> Recording:
    """At 200 samples a second."""
    return Recording(np.arange(len(q)) / 200.0, q, np.zeros_like(q), ("motor",))


@pytest.mark.parametrize(("std", "worse"), [(3e-6, 2), (4e-4, 8)])
def test_an_inertia_is_off_by_less_with_the_chosen_order(std: float, worse: Order) -> None:
    """In the mean over draws of the noise, of what moves 1 kg m2 without friction, at 2 Hz."""
    rng, t = np.random.default_rng(3), np.arange(0.0, 12.0, 0.005)
    true, rows, errors = np.sin(4.0 * np.pi * t)[:, None], slice(8, -8), []
    chosen = with_suited_order(Filter(), [one_joint(true + std * rng.normal(size=true.shape))])
    for _ in range(20):
        q = true + std * rng.normal(size=true.shape)
        for order in (chosen.order, worse):
            a = central_difference(central_difference(q, 200.0, order), 200.0, order)[rows]
            torque = -((4.0 * np.pi) ** 2) * true[rows]
            errors.append(float(np.sum(a * torque) / np.sum(a**2)) - 1.0)
    ours, others = np.abs(np.mean(np.reshape(errors, (-1, 2)), axis=0))
    assert ours < 0.5 * others


@pytest.mark.parametrize(
    "stated",
    [
        Filter(difference_order=2),
        Filter(ends="keep"),
        Filter(position_cutoff_hz=40.0),
    ],
)
def test_an_order_is_chosen_only_where_it_is_left_open(stated: Filter) -> None:
    assert with_suited_order(stated, [swinging(0.0, 200.0)]) is stated


def test_one_order_is_chosen_for_what_is_compared() -> None:
    fine, coarse = (Dataset((swinging(std, 200.0),), Filter()) for std in (0.0, 1e-3))
    assert fine.filter is not None and coarse.filter is not None
    assert fine.filter.order > coarse.filter.order == 2
    first, other = filtered_alike(fine, coarse)
    assert first is fine and other.filter == fine.filter
    assert "differences of order 2" in coarse.filter.description


def test_a_low_pass_of_the_positions_overrules_what_was_chosen_without_one() -> None:
    chosen = Dataset((swinging(1e-3, 200.0),), Filter()).filter
    assert chosen is not None and chosen.suited_order == 2
    assert replace(chosen, position_cutoff_hz=40.0).order == 8


def test_instruments_which_noise_does_not_bias_choose_a_higher_order() -> None:
    rough = 10 * [swinging(1e-4, 200.0)]
    assert with_suited_order(Filter(), rough, 0.0).order > with_suited_order(Filter(), rough).order


def test_an_exact_joint_does_not_choose_for_a_noisy_one() -> None:
    rough = swinging(1e-3, 200.0)
    exact = np.column_stack([rough.q[:, 0], swinging(0.0, 200.0).q[:, 1]])
    assert with_suited_order(Filter(), [rough.replace(q=exact)]).order == 2
