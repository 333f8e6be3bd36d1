import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from dynident.errors import RecordingError
from dynident.recording import (
    Filter,
    ParallelFilter,
    Recording,
    central_difference,
    choose_factor,
    default_filter,
    differentiate,
    lowpass,
    moving,
    within,
)


@given(share=st.floats(0.02, 1.5), phase=st.floats(0, 6))
def test_a_sinusoid_keeps_its_phase_and_shrinks_as_butterworth_says(share, phase):
    rate, cutoff = 1000.0, 20.0
    t = np.arange(4000) / rate
    wave = np.sin(2 * np.pi * share * cutoff * t + phase)
    gain = 1 / (1 + share**8)  # |H|^2 of order 4: once forward, once backward
    middle = slice(1000, 3000)
    np.testing.assert_allclose(
        lowpass(wave, rate, cutoff)[middle], gain * wave[middle], atol=0.01 * gain + 1e-4
    )


def test_a_lowpass_has_no_direction_and_acts_on_each_column_alone():
    x = np.random.default_rng(1).standard_normal((3000, 2, 3))
    y = lowpass(x, 500, 30)
    assert y.shape == x.shape
    np.testing.assert_allclose(y[:, 1, 2], lowpass(x[:, 1, 2], 500, 30), atol=1e-12)
    mirrored = lowpass(x[::-1], 500, 30)[::-1]
    np.testing.assert_allclose(mirrored[200:-200], y[200:-200], atol=1e-9)


def test_straight_lines_pass_unchanged():
    line = 3 + 2 * np.arange(2000.0)
    middle = slice(600, -600)  # the ends see the short reflection
    np.testing.assert_allclose(lowpass(line, 1000, 20)[middle], line[middle], rtol=1e-9)
    parallel = ParallelFilter(Filter(cutoff_hz=18, rate_hz=50), 1000)
    np.testing.assert_allclose(parallel.apply(np.full(2000, 3.0)), 3.0, rtol=1e-9)


def test_derivatives_of_a_known_motion():
    rate = 1000.0
    t = 5.0 + np.arange(6000) / rate
    w = 2 * np.pi * np.array([0.5, 1.3])
    q = np.sin(w * t[:, None])
    recording = Recording(t, q, q, ("a", "b"))
    motion = differentiate(recording, Filter(position_cutoff_hz=40, edge_s=(0.5, 0.25)))
    assert motion.first == 500
    assert motion.samples == 6000 - 500 - 250
    np.testing.assert_array_equal(motion.t, t[500:-250])
    w_t = w * motion.t[:, None]
    np.testing.assert_allclose(motion.q, np.sin(w_t), atol=1e-5)
    np.testing.assert_allclose(motion.v, w * np.cos(w_t), atol=3e-4)
    np.testing.assert_allclose(motion.a, -(w**2) * np.sin(w_t), atol=1e-2)


def test_central_differences_are_exact_for_parabolas():
    t = np.arange(50) / 20
    x = np.column_stack([t**2, 1 - 3 * t])
    slope = central_difference(x, 20)
    np.testing.assert_allclose(slope[1:-1], np.column_stack([2 * t, -3 + 0 * t])[1:-1], atol=1e-12)


def test_a_held_command_acts_half_a_sample_later():
    t = np.arange(400) * 0.01
    u = np.sin(2 * np.pi * t)[:, None]
    measured = Recording(t, u, u, ("a",))
    held = differentiate(measured.replace(torque="held_command"), Filter(ends="keep"))
    later = np.sin(2 * np.pi * (t - 0.005))[:, None]
    np.testing.assert_allclose(held.tau[1:], later[1:], atol=6e-4)
    assert held.tau[0] == u[0]
    np.testing.assert_array_equal(differentiate(measured, Filter(ends="keep")).tau, u)


FILTERS = st.builds(
    Filter,
    cutoff_hz=st.one_of(st.none(), st.floats(4, 12)),
    rate_hz=st.one_of(st.none(), st.sampled_from([25.0, 50.0, 125.0])),
    decimation=st.sampled_from(["pick", "chebyshev"]),
)


@settings(max_examples=25)
@given(
    filter=FILTERS,
    period=st.sampled_from([None, 2.0, 1.873]),
    samples=st.integers(9000, 30000),
    size=st.integers(500, 6000),
    seed=st.integers(0, 99),
)
def test_blocks_give_what_the_whole_gives(filter, period, samples, size, seed):
    parallel = ParallelFilter(filter, 1000.0, period)
    noise = np.random.default_rng(seed).standard_normal((samples, 2, 2))
    noise[:, 1, 0] = np.cumsum(noise[:, 1, 0])
    noise[:, 0, 1] = 0.0
    whole = parallel.apply(noise)
    assert whole.shape == (len(parallel.rows(samples)), 2, 2)
    again = np.full_like(whole, np.nan)
    for block in parallel.blocks(samples, size):
        again[block.kept] = parallel.apply_block(noise[block.raw], block)
    np.testing.assert_allclose(again, whole, atol=1e-9 * np.abs(noise).max(), rtol=0)


@given(
    period=st.floats(0.5, 9),
    target=st.floats(20, 100),
    samples=st.integers(2000, 30000),
)
@example(period=3.261358266503783, target=23.0, samples=8154)  # halves that round both ways
def test_kept_rows_fall_on_the_same_phases_in_every_period(period, target, samples):
    period = round(period * 1000) / 1000
    whole = round(period * 1000)
    parallel = ParallelFilter(Filter(rate_hz=target), 1000.0, period)
    rows = parallel.rows(samples)
    assert rows[0] >= 0 and rows[-1] == samples - 1
    assert np.ptp(np.diff(rows)) <= 1
    assert parallel.output_rate_hz == pytest.approx(target, rel=0.25)
    early = rows[rows < samples - whole]
    assert np.isin(early + whole, rows).all()


def test_choice_of_the_factor():
    assert choose_factor(1000, 50, None) == 20
    assert choose_factor(1000, 50, 8.0) == 20
    assert choose_factor(1000, 50, 6.3) == 20  # 6300 = 20 * 315
    assert choose_factor(1000, 50, 6.25) == 20  # no divisor of 6250 within 20 %
    assert choose_factor(1000, 50, 6.27) == 19  # 6270 = 19 * 330
    assert choose_factor(1000, 100, 6.24) == 10
    assert choose_factor(40, 50, 8.0) == 1
    assert ParallelFilter(Filter(rate_hz=50), 1000, 6.25).step == 20.032051282051281


def test_decimation_is_aligned_with_the_last_sample():
    parallel = ParallelFilter(Filter(rate_hz=100), 1000)
    np.testing.assert_array_equal(parallel.rows(24), [3, 13, 23])
    np.testing.assert_array_equal(parallel.times(np.arange(24) / 8), [0.375, 1.625, 2.875])
    assert ParallelFilter(Filter(), 1000).factor == 1


@pytest.mark.parametrize("rate", [1.0, 20.0, 100.0, 200.0, 1000.0, 8000.0])
def test_the_default_filter_suits_every_rate(rate):
    filter = default_filter(rate)
    t = np.arange(3000) / rate
    motion = differentiate(Recording(t, np.sin(t), np.sin(t), ("a",)), filter)
    parallel = ParallelFilter(filter, motion.rate_hz)
    assert len(parallel.apply(motion.tau)) == len(parallel.times(motion.t))
    if rate >= 200:
        expected = (40.0, 18.0, 50.0)
        assert (filter.position_cutoff_hz, filter.cutoff_hz, filter.rate_hz) == expected


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"cutoff_hz": 0.0}, "cutoff_hz = 0.0. choose it above 0 Hz"),
        ({"position_cutoff_hz": float("nan")}, "position_cutoff_hz = nan"),
        ({"rate_hz": -50.0}, "rate_hz = -50.0"),
        ({"cutoff_hz": 30.0, "rate_hz": 50.0}, "30 is not below half of rate_hz = 50"),
        ({"decimation": "fir"}, '\'fir\'.*"pick" or "chebyshev"'),
        ({"edge_s": (0.1, -0.1)}, "not negative"),
    ],
)
def test_filters_that_cannot_be(arguments, message):
    with pytest.raises(RecordingError, match=message):
        Filter(**arguments)


@pytest.mark.parametrize(
    "recipe",
    [
        default_filter(1000.0),
        Filter(position_cutoff_hz=80.0, cutoff_hz=40.0, rate_hz=200.0),
        Filter(cutoff_hz=18.0),
        Filter(position_cutoff_hz=30.0),
        Filter(),
    ],
    ids=["default", "both", "torque and columns", "positions alone", "none"],
)
def test_a_narrowed_filter_takes_noise_from_columns_and_torque_alike(recipe):
    lower, lowest = (recipe.narrowed(share, 1000.0) for share in (0.5, 0.25))
    assert lower.cutoff_hz == pytest.approx(2.0 * lowest.cutoff_hz)
    assert recipe.cutoff_hz is None or lower.cutoff_hz == 0.5 * recipe.cutoff_hz
    for one in (lower, lowest):
        # The positions' low-pass leaves what the other one passes, and the rows show it.
        assert one.position_cutoff_hz >= one.cutoff_hz
        assert one.rate_hz is None or one.rate_hz > 2.0 * one.cutoff_hz


def test_filters_that_do_not_suit_the_recording(arm):
    with pytest.raises(RecordingError, match=r"arm: a cut-off of 125 Hz .* below 125 Hz"):
        differentiate(arm, Filter(position_cutoff_hz=125))
    with pytest.raises(RecordingError, match=r"arm: nothing is left of 3.996 s"):
        differentiate(arm, Filter(edge_s=(2, 2)))
    with pytest.raises(RecordingError, match=r"arm: 10 samples are too few .* at least 13"):
        differentiate(arm.cut(0, 0.04), Filter(position_cutoff_hz=40))
    with pytest.raises(RecordingError, match="cut-off of 600 Hz"):
        ParallelFilter(Filter(cutoff_hz=600), 1000).apply(np.ones(99))


def test_masks():
    t = np.arange(100) / 10
    assert within(t, 2, 3).sum() == 10
    assert within(t - 1e-9, 2, 3)[20]
    np.testing.assert_array_equal(moving(np.array([[-1.0, 0.1]]), 0.2), [[True, False]])


def test_the_transient_is_as_long_as_a_step_shows():
    parallel = ParallelFilter(Filter(cutoff_hz=18), 1000.0)
    step = np.r_[np.zeros(2000), np.ones(2000)]
    off = np.abs(parallel.apply(step) - step) > 0.01
    assert np.flatnonzero(off).max() - 2000 < parallel.transient * 1000


def test_the_default_edges_hide_the_transient():
    t = np.arange(4000) / 1000
    w = 2 * np.pi * np.array([0.4, 1.0])
    q = np.sin(w * t[:, None] + 1.0)
    motion = differentiate(Recording(t, q, q, ("a", "b")), default_filter(1000.0))
    expected = -(w**2) * np.sin(w * motion.t[:, None] + 1.0)
    np.testing.assert_allclose(motion.a, expected, atol=0.01 * (w**2).max())
