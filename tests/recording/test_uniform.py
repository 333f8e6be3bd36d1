import warnings

import numpy as np
import pytest

from dynident.errors import DynidentWarning, RecordingError, without_warnings
from dynident.recording import Recording, differentiate, periods, uniform
from dynident.recording.filters import Filter

W = 2 * np.pi * np.array([0.5, 1.1])


def motion(t):
    return np.sin(W * np.asarray(t)[:, None])


def jittered(samples=4000, seed=0):
    steps = np.random.default_rng(seed).uniform(0.5e-3, 1.5e-3, samples)
    t = np.cumsum(steps)
    return Recording(t, motion(t), 3 * motion(t), ("a", "b"), v=motion(t), name="run")


def test_even_time_stamps_are_left_alone():
    t = np.arange(1000) * 1e-3
    t[1:-1] += np.random.default_rng(0).uniform(-4e-7, 4e-7, 998)
    recording = Recording(t, t, t, ("a",), period=0.25)
    assert uniform(recording) is recording


def test_jitter_is_named_and_removed():
    recording = jittered()
    with pytest.warns(
        DynidentWarning, match=r"run: the time stamps are jittered by 5[01].* % of a step"
    ):
        even = uniform(recording)
    assert even.jitter < 1e-9
    assert even.rate_hz == pytest.approx(recording.rate_hz, rel=1e-9)
    assert even.samples == recording.samples
    np.testing.assert_allclose(even.q, motion(even.t), atol=1e-9)
    np.testing.assert_allclose(even.tau, 3 * motion(even.t), atol=1e-8)
    assert even.v is not None
    np.testing.assert_allclose(even.v, motion(even.t), atol=1e-9)
    assert even.provenance.filter.startswith("resampled to 1")


def test_stale_readings_are_dropped_and_a_rest_is_kept():
    recording = jittered()
    rows = np.arange(recording.samples)
    rows[500::40] -= 1  # the reading before, logged again
    rows[100:200] = 100  # at rest
    q = recording.q[rows]
    stale = recording.replace(q=q, tau=3 * q, v=q)
    with pytest.warns(DynidentWarning, match=r"and 88 rows \(2.2 %\) repeat the reading before"):
        even = uniform(stale)
    late = even.t > recording.t[250]
    np.testing.assert_allclose(even.q[late], motion(even.t[late]), atol=1e-6)
    rest = (even.t > recording.t[110]) & (even.t < recording.t[190])
    np.testing.assert_allclose(even.q[rest], q[150] + 0 * even.q[rest], atol=1e-6)


def test_a_held_command_keeps_its_impulse():
    recording = jittered().replace(torque="held_command")
    with pytest.warns(DynidentWarning, match="jittered"):
        even = uniform(recording)
    assert even.torque == "held_command"
    given = np.cumsum(recording.tau[:-1] * np.diff(recording.t)[:, None], axis=0)[-1]
    kept = np.cumsum(even.tau[:-1] * np.diff(even.t)[:, None], axis=0)[-1]
    np.testing.assert_allclose(kept, given, atol=1e-9)
    # What acts at the new stamps is what acted there: half a sample after the logged command.
    acts = differentiate(even, Filter(ends="keep")).tau
    expected = 3 * motion(even.t - 0.5e-3)
    np.testing.assert_allclose(acts[5:-5], expected[5:-5], atol=0.02)


def test_the_period_becomes_a_whole_number_of_samples():
    t = np.arange(4000) * 1e-3
    recording = Recording(t, t, t, ("a",), period=0.9994, name="run")
    with pytest.warns(DynidentWarning, match=r"the period of 0.9994 s is no whole number"):
        even = uniform(recording)
    assert periods(even.samples, even.rate_hz, 0.9994).rows_per_period == 999
    with pytest.warns(DynidentWarning, match="jittered"):
        even = uniform(jittered().replace(period=0.7))
    assert 0.7 * even.rate_hz == pytest.approx(700, abs=10)
    assert (0.7 * even.rate_hz) % 1 == pytest.approx(0, abs=1e-6) or (
        (0.7 * even.rate_hz) % 1 == pytest.approx(1, abs=1e-6)
    )


def test_long_gaps_are_refused():
    t = np.arange(1000) * 1e-3
    t[500:] += 0.1
    recording = Recording(t, t, t, ("a",), name="run")
    with pytest.raises(RecordingError, match=r"run, row 500: 0.101 s without samples.*in two"):
        uniform(recording)


def test_a_recording_is_resampled_once_and_shared_by_its_windows():
    recording = jittered()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with without_warnings():
            even = uniform(recording)
    with pytest.warns(DynidentWarning, match="run: .*jittered"):  # the first who may be told is
        assert uniform(recording) is even
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert uniform(recording) is even
        window = uniform(recording.replace(window=(1.0, 2.0), name="other"))
    assert window.q is even.q and window.t is even.t
    assert (window.window, window.name) == ((1.0, 2.0), "other")
    assert window.provenance.filter == even.provenance.filter
    with pytest.warns(DynidentWarning, match="jittered"):
        shaken = uniform(recording.replace(q=recording.q + 0.1))
    np.testing.assert_allclose(shaken.q, even.q + 0.1, atol=1e-12)
    with pytest.warns(DynidentWarning, match="jittered"):
        assert uniform(recording.replace(period=0.7)).rate_hz != even.rate_hz


@pytest.mark.parametrize("period", [None, 1.0])
def test_samples_that_are_missing_leave_the_rate_as_it_is(period):
    """A log that loses 2 % of its samples is no slower clock."""
    whole = jittered().replace(t=np.arange(4000) / 500.0, period=period)
    rng = np.random.default_rng(4)
    kept = np.sort(rng.choice(np.arange(1, 3999), 3920, replace=False))
    kept = np.concatenate([[0], kept, [3999]])
    signals = {name: x[kept] for name in ("q", "tau") if (x := getattr(whole, name)) is not None}
    lossy = whole.replace(t=whole.t[kept], v=None, a=None, q_ref=None, **signals)
    with pytest.warns(DynidentWarning, match="78 samples are missing; resampled to 500 Hz"):
        even = uniform(lossy)
    assert even.rate_hz == pytest.approx(500.0, rel=1e-9)
    assert even.samples == 4000
    np.testing.assert_allclose(even.q[kept], lossy.q, atol=1e-12)


def test_readings_that_come_late_are_not_missing():
    """Arrivals in pairs, a long step before a short one, are a jittered clock at its mean rate."""
    whole = jittered()
    t = np.arange(4000) / 500.0
    t[1::2] += 0.9 / 500.0
    with pytest.warns(DynidentWarning, match="are jittered by 90 % of a step"):
        even = uniform(whole.replace(t=t))
    assert even.rate_hz == pytest.approx(500.0, rel=1e-3)


@pytest.mark.parametrize(
    "steps",
    [
        [0.1, 0.1, 2.8],  # bursts of three
        [0.05, 9.95],  # stamped in pairs
        [1.0, 1.0, 1.0, 2.0],  # 800 Hz in whole ms
        [1.0] * 300 + [20.0] * 100,  # slower at rest
    ],
    ids=["bursts", "pairs", "whole ms", "slower at rest"],
)
@pytest.mark.parametrize("shift", [0, 1])
def test_long_steps_that_are_the_rule_are_no_missing_samples(steps, shift):
    t = 1e-3 * np.cumsum(np.roll(np.resize(steps, 4000), shift))
    recording = jittered().replace(t=t)
    with pytest.warns(DynidentWarning, match="run: the time stamps are jittered"):
        even = uniform(recording)
    assert even.rate_hz == pytest.approx(recording.rate_hz, rel=1e-6)
    assert even.samples <= 4000
