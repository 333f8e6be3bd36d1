"""The low-pass of the positions: noise that it lets through against reversals that it rounds."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.recording import (
    Dataset,
    Filter,
    Recording,
    SpeedGain,
    central_difference,
    lowpass,
    suited_filter,
    suited_position_cutoff,
)

RATE = 1000.0
USUAL = 40.0


def moved(std: float, *, rate: float = RATE, step: float = 0.0, scale: float = 1.0) -> Recording:
    """Two joints that turn round at a jump of their acceleration, behind encoders."""
    t = np.arange(0.0, 12.0, 1.0 / rate)
    swing = np.column_stack([np.sin(3.0 * t) + 0.1 * np.abs(np.cos(3.0 * t)), np.cos(2.0 * t)])
    q = swing + std * np.random.default_rng(1).normal(size=swing.shape)
    q = np.round(q / step) * step if step else q
    return Recording(t, scale * q, np.zeros_like(q), ("shoulder", "elbow"))


@pytest.mark.parametrize("cutoff", [None, 20.0, 100.0])
def test_noise_of_speeds_is_what_is_said(cutoff: float | None) -> None:
    q = np.random.default_rng(0).normal(size=(200_000, 1))
    q = q if cutoff is None else lowpass(q, RATE, cutoff)
    found = central_difference(q, RATE)[1000:-1000].std()
    assert SpeedGain(RATE, cutoff).noise == pytest.approx(found, rel=0.02)


@pytest.mark.parametrize("cutoff", [None, 20.0, 100.0])
def test_speed_that_is_made_up_at_a_jump_is_what_is_said(cutoff: float | None) -> None:
    """The speed is zero, and from an instant on it rises by 1 rad/s in each second."""
    t = np.arange(-2000, 2001) / RATE
    q = np.where(t > 0.0, 0.5 * t**2, 0.0)[:, None]
    q = q if cutoff is None else lowpass(q, RATE, cutoff)
    found = central_difference(q, RATE)[2000, 0]
    assert SpeedGain(RATE, cutoff).rounding == pytest.approx(found, rel=0.03)


def test_the_finer_the_encoders_the_higher_the_cutoff() -> None:
    stds = (0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
    found = [suited_position_cutoff([moved(std)], 18.0) for std in stds]
    assert found == sorted(found, reverse=True)
    assert found[0] == 4 * USUAL and found[-1] == USUAL


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


def test_a_slow_clock_bounds_it_and_the_noisiest_recording_counts() -> None:
    assert suited_position_cutoff([moved(0.0, rate=100.0)], 9.0) == 20.0
    assert suited_position_cutoff([moved(0.0, rate=500.0)], 18.0) == 80.0
    together = suited_position_cutoff([moved(0.0), moved(1e-3)], 18.0)
    assert together == USUAL
    standing = moved(0.0).replace(q=np.zeros((len(moved(0.0).t), 2)))
    assert suited_position_cutoff([standing], 18.0) == USUAL


def test_recordings_of_a_dataset_have_one_filter() -> None:
    one = moved(1e-6)
    dataset = Dataset((one, moved(1e-3)))
    assert dataset.filter == suited_filter(dataset.recordings)
    assert {dataset.filter_of(x).position_cutoff_hz for x in dataset.recordings} == {USUAL}
    assert Dataset((one,)).filter_of(one).position_cutoff_hz == 4 * USUAL
    stated = Filter(position_cutoff_hz=30.0)
    assert Dataset((one,), stated).filter == stated
    assert Dataset(()).filter is None


def test_recordings_whose_rates_call_for_different_filters_have_their_own() -> None:
    slow, fast = moved(0.0, rate=100.0), moved(0.0)
    dataset = Dataset((slow, fast))
    assert dataset.filter is None
    assert [dataset.filter_of(one).position_cutoff_hz for one in (slow, fast)] == [20.0, 160.0]
