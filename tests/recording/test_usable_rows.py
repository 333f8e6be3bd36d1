"""Which rows count: ends that filters make up, standstill, a loop that still settles."""

import tracemalloc

import numpy as np
import pytest

from dynident.errors import RecordingError
from dynident.fitting.least_squares import sources_of
from dynident.fitting.sampling import sample
from dynident.recording import Dataset, Filter, Recording, count_rows, default_filter, usable

T = np.arange(8000) / 1000
USERS = Filter(cutoff_hz=18.0, rate_hz=50.0)


def made(q: np.ndarray, **more) -> Recording:
    q = q if q.ndim == 2 else q[:, None]
    joints = tuple(f"j{k}" for k in range(q.shape[1]))
    return Recording(T[: len(q)], q, np.zeros_like(q) + 1.0, joints, **more)


def swing(t: np.ndarray = T) -> np.ndarray:
    """In mid-motion at both ends, and with a period of 4 s."""
    return np.sin(2 * np.pi * 0.5 * t + 0.7)


@pytest.mark.parametrize("settings", [USERS, Filter(cutoff_hz=8, rate_hz=40), default_filter(1000)])
def test_no_row_near_the_ends_carries_more_noise_than_the_others(settings):
    rng, spread = np.random.default_rng(7), []
    for _ in range(150):
        noise = rng.standard_normal((4000, 1))
        moved = made(swing(T[:4000])).replace(tau=noise)
        spread.append(sample(moved, settings).tau[:, 0])
    by_row = np.std(spread, axis=0)
    inner = np.sqrt(np.mean(by_row[10:-10] ** 2))
    assert by_row[[0, -1]] == pytest.approx(inner, rel=0.25)  # five standard errors of the spread
    kept = sample(moved, Filter(cutoff_hz=18.0, rate_hz=50.0, ends="keep")).tau[:, 0]
    assert len(kept) > len(by_row)


def test_a_published_recipe_keeps_its_ends_only_by_name():
    kept = Filter(cutoff_hz=18.0, rate_hz=50.0, ends="keep")
    assert len(sample(made(swing()), kept).t) == 400
    assert len(sample(made(swing()), USERS).t) < 390
    with pytest.raises(RecordingError, match='"drop" or "keep"'):
        Filter(ends="some")  # type: ignore[arg-type]


def test_standing_still_at_the_ends_is_left_out_and_a_held_pose_is_not():
    moving = np.r_[np.zeros(1000), 1 - np.cos(2 * np.pi * T[:2000] / 2), np.zeros(2000)]
    again = np.r_[1 - np.cos(2 * np.pi * T[:2000] / 2), np.zeros(1000)]
    rng = np.random.default_rng(0)
    one = usable(made(np.r_[moving, again] + 1e-5 * rng.standard_normal(8000)))
    assert one.window == pytest.approx((1.0, 7.0), abs=0.06)
    assert [left.reason for left in one.left_out or ()] == ["standing still"] * 2
    inside = sample(one, USERS)
    assert np.any((inside.t > 3.5) & (inside.t < 4.5))


def test_a_joint_that_moves_alone_keeps_the_rows():
    q = np.column_stack([np.zeros(8000), swing()])
    assert usable(made(q)).window is None


def test_a_window_that_asks_for_standstill_has_it():
    still = np.r_[np.zeros(2000), swing(T[:6000]) - swing(T[:1])]
    assert usable(made(still, window=(0.0, 1.5))).window == (0.0, 1.5)


def test_a_loop_that_still_settles_is_left_out_of_what_repeats():
    settling = swing() + 0.05 * np.exp(-T / 0.15) * np.cos(40 * T)
    rng = np.random.default_rng(1)
    noise = 1e-5 * rng.standard_normal(8000)
    found = usable(made(settling + noise, period=4.0)).left_out
    assert found is not None and len(found) == 1
    left = found[0]
    assert left.reason == "transient before the motion repeats"
    assert 0.5 < left.stop < 1.6  # where the transient has come down to the noise
    assert usable(made(swing() + noise, period=4.0)).left_out == ()
    pushed = swing() + 0.05 * np.exp(-(((T - 2.0) / 0.05) ** 2))
    assert usable(made(pushed + noise, period=4.0)).left_out == ()  # a contact, not a transient


def test_copies_keep_the_rows_of_the_measurement():
    still = np.r_[np.zeros(1500), swing(T[:6500]) - swing(T[:1])]
    (one,) = Dataset((made(still),), USERS).recordings
    shaken = one.replace(q=one.q + 0.01 * np.random.default_rng(2).standard_normal(one.q.shape))
    assert usable(shaken).window == one.window
    np.testing.assert_array_equal(sample(shaken, USERS).t, sample(one, USERS).t)
    again = Dataset((one,), USERS).recordings[0]
    assert again is one


def test_the_provenance_says_how_many_rows_and_why():
    still = np.r_[np.zeros(1500), swing(T[:6500]) - swing(T[:1])]
    dataset = Dataset((made(still),), USERS)
    words = sources_of(dataset)[0].filter
    rows = len(sample(dataset.recordings[0], USERS).t)
    assert f"{rows} of 400 rows used" in words
    assert "the filter sees past the ends (0.168 and 0.168 s)" in words
    assert "standing still from 0 to 1.5" in words
    count = count_rows(dataset.recordings[0], USERS)
    assert (count.used, count.standstill, count.window) == (rows, 75, 0)
    assert count.used + count.standstill + count.ends == 400
    twice = (count + count).to_dict()
    assert twice["used"] == 2 * rows and twice["dropped"]["ends"] == 2 * count.ends
    assert "ends kept" in sources_of(Dataset((made(still),), Filter(ends="keep")))[0].filter


def test_repetitions_are_compared_in_parts():
    t = np.arange(200_000) / 1000
    noise = 1e-5 * np.random.default_rng(3).standard_normal((len(t), 3))
    q = swing(t)[:, None] + 0.05 * (np.exp(-t / 0.15) * np.cos(40 * t))[:, None] + noise
    long = Recording(t, q, q, ("a", "b", "c"), period=100.0)
    tracemalloc.start()
    found = usable(long)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < long.q.nbytes / 2
    # As a comparison of the whole finds it.
    apart = np.abs(long.q[100_000:] - long.q[:100_000])
    least = 5 * np.sqrt(np.mean(apart[50_000:] ** 2, axis=0))
    least = np.maximum(least, 1e-4 * np.ptp(long.q, axis=0))
    last = np.flatnonzero(np.any(apart > least, axis=1))[-1]
    assert found.window == (long.t[last], np.inf)


def test_noise_that_moves_from_its_first_row_and_not_from_its_last_is_all_kept():
    """The first is far from the middle and the last in it: no row is farther from that one."""
    q = np.random.default_rng(3).normal(size=4000)
    q[0], q[-1] = 4.5, 0.0
    one = usable(made(np.clip(q, -4.5, 4.5)))
    assert not one.left_out
