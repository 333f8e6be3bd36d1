import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dynident.errors import RecordingError
from dynident.recording import mismatch, periods, require_repetition


@given(
    whole=st.integers(4, 300), repetitions=st.floats(1.6, 9), rate=st.sampled_from([50.0, 312.5])
)
def test_folded_rows_share_their_phase(whole, repetitions, rate):
    samples = int(whole * repetitions)
    if samples < 1.5 * whole:
        return
    found = periods(samples, rate, whole / rate)
    rows = np.arange(samples)
    folded = found.fold(rows)
    assert folded.shape == (found.count, found.rows)
    assert found.count >= 2
    assert found.rows_per_period == whole
    assert np.ptp(folded % whole, axis=0).max() == 0
    assert folded.max() == samples - 1
    assert len(np.unique(folded)) == folded.size
    assert folded.size >= (samples // whole) * whole or samples < 2 * whole


def test_whole_periods_are_counted_from_the_end():
    found = periods(1000, 50.0, 8.0)  # 20 s
    assert (found.count, found.rows) == (2, 400)
    assert found.index[0, 0] == 200


def test_dropped_edges_do_not_cost_a_period():
    found = periods(795, 50.0, 8.0)  # 16 s without its edges
    assert (found.count, found.rows) == (2, 395)


def test_folds_any_further_dimensions():
    found = periods(100, 10.0, 3.0)
    assert found.fold(np.zeros((100, 2, 5))).shape == (3, 30, 2, 5)


@pytest.mark.parametrize(
    ("samples", "rate", "period", "message"),
    [
        (500, 50.0, 8.0, r"run: 10 s that are used hold no two periods of 8 s. record longer"),
        (500, 50.0, 0.01, r"run: a period of 0.01 s is 0.5 samples at 50 Hz. is it given in s\?"),
        (500, 50.0, 3.333, r"run: .*166.65 samples at 50 Hz, no whole number. resample .*uniform"),
    ],
)
def test_what_cannot_be_folded(samples, rate, period, message):
    with pytest.raises(RecordingError, match=message):
        periods(samples, rate, period, "run")


def test_a_wrong_period_is_refused_and_the_right_one_told():
    t = np.arange(2000) / 100
    w = 2 * np.pi / 4
    q = np.column_stack([np.sin(w * t) + np.cos(3 * w * t), np.sin(2 * w * t)])
    q += 1e-3 * np.random.default_rng(0).standard_normal(q.shape)
    right = periods(2000, 100, 4.0)
    require_repetition(q, right)
    assert mismatch(right.fold(q)) < 0.01
    with pytest.raises(RecordingError, match=r"run: .* they do after 0.8 times that period"):
        require_repetition(q, periods(2000, 100, 5.0), "run")
    drifting = np.cumsum(np.random.default_rng(0).standard_normal((2000, 1)), axis=0)
    with pytest.raises(RecordingError, match=r"% of the motion\). correct"):
        require_repetition(drifting, right)


def test_a_robot_at_rest_repeats():
    require_repetition(np.zeros((100, 2)), periods(100, 10, 5.0))
