"""Rows around stops of joints that stand count neither in fits nor in errors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

import dynident as di
from dynident.criteria import DEFAULTS
from dynident.evidence.comparison import compare_models
from dynident.fitting.instrumental import Filtered
from dynident.fitting.noisy_inputs import encoder_noise, input_noise
from dynident.fitting.reversals.joint_speeds import JointSpeeds
from dynident.fitting.reversals.standing_joints import (
    few_enough,
    near_stops,
    resting,
    standing_note,
    stands,
    without_stops,
)
from dynident.fitting.sampling import BLOCK, sample
from dynident.moments.factors import factorise
from dynident.recording import Dataset, Filter, Noise, Recording, default_filter, lowpass
from standing_arm import COULOMB, RATE_HZ, STOPPED, given, record, resting_joint
from synthetic import true_values

ELBOW = 1


def sharp() -> di.Model:
    """The model whose elbow reverses as sharply as one that stands does."""
    return given().with_friction_width("elbow", 1e-3)


def standing(*seeds: int) -> Dataset:
    return Dataset(tuple(record(seed, STOPPED) for seed in seeds))


def test_dry_friction_of_a_joint_that_stands_is_found_away_from_its_stops() -> None:
    data = standing(0, 1, 2)
    keeps = replace(data, filter=replace(default_filter(RATE_HZ), ends="keep"))
    found, every = (di.fit(sharp(), one) for one in (data, keeps))
    place = given().names.index("Fc@elbow")
    assert abs(found.values[place] - COULOMB[ELBOW]) < 3.0 * found.sigma[place] < 0.05
    assert found.joint_errors[ELBOW] < 0.5 * every.joint_errors[ELBOW]
    assert any("elbow stands still at many of its stops" in one for one in found.notes)
    assert not any("stands still" in one for one in every.notes)


def test_the_finest_encoders_show_a_stop_beside_which_the_low_pass_rings(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Before a joint starts, its filtered speed is not zero: that is no passage through zero."""

    def seen(stops_below: float) -> list[bool]:
        every = (record(seed, stops_below, position_std=1e-8) for seed in range(3))
        speeds = [JointSpeeds(sample(one, None)) for one in every]
        return stands(speeds, DEFAULTS.sticking).tolist()

    assert seen(0.01) == [False, True] and seen(0.0) == [False, False]
    monkeypatch.setattr(JointSpeeds, "ringing", np.zeros(2))
    assert seen(0.01) == [False, False]


def jerky(hz: float, rests: float) -> tuple[Recording, np.ndarray]:
    """A motion whose elbow swings and stops with a jerk, and its speed (T,) rad/s.

    Parameters
    ----------
    hz : of the swing.
    rests : share of the time that the elbow stands.
    """
    t = np.arange(int(20 * RATE_HZ)) / RATE_HZ
    swing, held = np.sin(2.0 * np.pi * hz * t), np.sin(0.5 * np.pi * rests)
    v = np.sign(swing) * np.maximum(np.abs(swing) - held, 0.0)
    q = np.cumsum(np.stack([np.sin(0.9 * t), v], axis=1), axis=0) / RATE_HZ
    return Recording(t, q, np.ones_like(q), given().robot.names), v


@pytest.mark.parametrize("rests", [0.1, 0.6])
def test_rows_whose_stop_the_low_pass_of_positions_has_rounded_do_not_count(rests: float) -> None:
    """Where a joint stops with a jerk its filtered speed, and so its friction, has a sign still."""
    recording, v = jerky(0.8, rests)
    sampled = sample(recording, None)
    speeds, first = JointSpeeds(sampled), sampled.source.first
    true = np.sign(np.round(v[first : first + sampled.source.samples], 9))
    errors = true - np.sign(sampled.motion.v[:, ELBOW])
    errors = sampled.parallel.apply_each([errors[:, None]])[0][sampled.kept, 0]

    def wrong(rounding: float) -> float:
        """Largest error of the elbow's dry friction, of its level, in rows that count."""
        counts = ~near_stops(speeds, DEFAULTS.sticking, rounding=rounding)[:, ELBOW]
        assert counts.mean() > 0.25
        return float(np.abs(errors[counts]).max())

    assert wrong(speeds.rounding) < 0.035
    assert wrong(0.0) > 0.05


@pytest.mark.parametrize(
    ("rate", "cutoff"), [(2000.0, 40.0), (500.0, 40.0), (100.0, 20.0), (100.0, None)]
)
def test_the_speed_made_up_at_a_stop_is_that_of_a_kink(rate: float, cutoff: float | None) -> None:
    """Of a joint that stands for 2 s, and speeds up and slows down by 1 rad/s in a second each."""
    t = np.arange(int(24 * rate)) / rate
    v = np.maximum(0.0, 1.0 - np.abs(np.mod(t, 4.0) - 2.0))
    q = np.tile(cumulative_trapezoid(v, t, initial=0.0)[:, None], 2)
    low = Filter(position_cutoff_hz=cutoff, cutoff_hz=0.09 * rate, rate_hz=0.25 * rate)
    sampled = sample(Recording(t, q, np.ones_like(q), given().robot.names), low)
    kink = round(9.0 * rate) - sampled.source.first
    assert 1.05 < JointSpeeds(sampled).rounding / sampled.motion.v[kink, 0] < 1.35


@pytest.mark.parametrize("glitch", [0.0, 0.03, 0.1])
def test_a_glitch_does_not_let_a_joint_that_stands_move(glitch: float) -> None:
    one = record(0, STOPPED)
    q = one.q.copy()
    q[4000, ELBOW] += glitch
    (marked,) = without_stops(given(), Dataset((one.replace(q=q),))).recordings
    assert 0.6 < sample(marked, None).counting[:, ELBOW].mean() < 0.85


def test_where_too_few_rows_would_be_left_those_that_are_rounded_count() -> None:
    recording, _ = jerky(2.5, 0.1)
    low = Filter(position_cutoff_hz=20.0, cutoff_hz=8.0, rate_hz=50.0)
    sampled = sample(recording, low)
    speeds = JointSpeeds(sampled)
    rounded = ~near_stops(speeds, DEFAULTS.sticking, rounding=speeds.rounding)[:, ELBOW]
    expected = ~near_stops(speeds, DEFAULTS.sticking)[:, ELBOW]
    assert rounded.mean() < 0.4 < 0.5 < expected.mean()
    data = Dataset((recording,), filter=low)
    (marked,) = without_stops(given(), data, standing=("elbow",)).recordings
    np.testing.assert_array_equal(sample(marked, low).counting[:, ELBOW], expected)


def test_while_one_joint_moves_after_the_other_the_one_that_rests_tells_nothing() -> None:
    data = Dataset(tuple(resting_joint(seed, seed % 2) for seed in range(4)))
    found = di.fit(given(), data)
    for j, name in enumerate(("Fc@shoulder", "Fc@elbow")):
        place = given().names.index(name)
        assert abs(found.values[place] - COULOMB[j]) < 3.0 * found.sigma[place] < 0.05
    marked = without_stops(given(), data)
    for seed, one in enumerate(marked.recordings):
        counting = sample(one, None).counting
        assert not counting[:, seed % 2].any() and counting[:, 1 - seed % 2].mean() > 0.5
    (result,) = di.compare(found, Dataset((resting_joint(9, ELBOW),))).results
    assert np.isnan(result.joint_errors[ELBOW])
    assert result.joint_errors[0] < 0.1 and np.isfinite(result.error)


def test_of_a_joint_that_turns_around_all_the_time_every_row_counts() -> None:
    """Long rests are no part of its share, and some rows must be left."""
    near, rest = np.zeros((2, 1000, 4), dtype=bool)
    near[:300, 0], near[:400, 1], near[:990, 2], near[:, 3] = True, True, True, True
    near[500:, 0] = rest[500:, 0] = rest[:400, 1] = rest[:990, 2] = rest[:, 3] = True
    assert few_enough(near, rest, DEFAULTS.sticking).tolist() == [False, True, False, False]
    near[200:300, 0] = False
    assert few_enough(near, rest, DEFAULTS.sticking)[0]


def test_what_creeps_within_the_noise_of_its_speed_does_not_rest() -> None:
    t = np.arange(8000) / RATE_HZ
    noise = np.random.default_rng(0).normal(size=(len(t), 2))
    q = np.stack([0.5 * np.sin(0.3 * t), np.clip(t - 4.0, 0.0, 4.0)], axis=1)
    for std in (1e-3, 1e-5, 0.0):
        one = Recording(t, q + std * noise, np.ones_like(q), ("shoulder", "elbow"))
        sampled = sample(one, None)
        rest = resting(sampled)
        # Where it turns around slowly it may stay within the noise of a coarse encoder.
        assert rest[:, 0].mean() <= (0.3 if std > 1e-4 else 0.05)
        near = near_stops(JointSpeeds(sampled), DEFAULTS.sticking)
        assert few_enough(near, rest, DEFAULTS.sticking)[0] == (std < 1e-4)
        np.testing.assert_array_equal(rest[sampled.t < 3.5, 1], True)
        assert not rest[(sampled.t > 4.3) & (sampled.t < 7.7), 1].any()
        assert not JointSpeeds(sampled).rests.any()
        still = sample(one.replace(q=0.3 + std * noise), None)
        assert JointSpeeds(still).rests.all() and resting(still).all()


def test_a_comparison_counts_the_rows_that_a_fit_counts() -> None:
    data = standing(0, 1, 2)
    fit = di.fit(given(), data)
    same = di.compare(fit, data)
    np.testing.assert_allclose(same.results[0].joint_errors, fit.joint_errors, rtol=0.02)
    assert "elbow stands still" in same.standing
    assert same.standing in " ".join(str(same).split())


def test_nothing_is_left_out_where_no_joint_stands_or_none_has_dry_friction() -> None:
    moving = Dataset((record(0, 0.0), record(1, 0.0)))
    assert without_stops(given(), moving) is moving
    frictionless = di.Model(given().robot)
    assert without_stops(frictionless, standing(0, 1)).recordings[0].stops == ()
    assert standing_note(moving) == ""


def test_what_was_looked_at_comes_back_and_copies_leave_out_the_same_rows() -> None:
    marked = without_stops(given(), standing(0, 1))
    assert without_stops(given(), marked) is marked
    one = marked.recordings[0]
    counting = sample(one, None).counting
    speeds = JointSpeeds(sample(one.replace(stops=()), None))
    expected = near_stops(speeds, DEFAULTS.sticking, rounding=speeds.rounding)
    np.testing.assert_array_equal(counting[:, ELBOW], ~expected[:, ELBOW])
    assert counting[:, 0].all()
    moved = one.replace(q=one.q + 0.01 * np.sin(one.t)[:, None])
    np.testing.assert_array_equal(sample(moved, None).counting, counting)
    swapped = one.select(tuple(reversed(one.joints)))
    np.testing.assert_array_equal(sample(swapped, None).counting, counting[:, ::-1])


def test_rows_that_do_not_count_are_in_no_factor() -> None:
    (one,) = without_stops(given(), standing(0)).recordings
    sampled = sample(one, None)
    factors = factorise(sampled.rows(given()))
    np.testing.assert_array_equal(factors.counts, sampled.counting.sum(axis=0))
    columns = np.concatenate(list(sample(one.replace(stops=()), None).columns(given())))
    for j, some in enumerate(sampled.counting.T):
        expected = np.linalg.norm(columns[some, j], axis=0)
        np.testing.assert_allclose(
            np.linalg.norm(factors.R[j, :, :-1], axis=0), expected, atol=1e-9 * expected.max()
        )


def test_a_stop_is_one_whichever_part_of_the_recording_it_lies_in(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A recording that is looked at part by part has the stops of the whole."""
    (one,) = standing(3).recordings
    whole = JointSpeeds(sample(one, None))
    expected = near_stops(whole, DEFAULTS.sticking)
    where = "dynident.fitting.reversals.joint_speeds"
    monkeypatch.setattr(f"{where}.BLOCK", BLOCK // 37)
    monkeypatch.setattr(f"{where}._AT_ONCE", 0)
    parts = JointSpeeds(sample(one, None))
    assert len(list(parts.used())) > 20
    np.testing.assert_array_equal(stands([parts], DEFAULTS.sticking), [False, True])
    np.testing.assert_array_equal(near_stops(parts, DEFAULTS.sticking), expected)
    np.testing.assert_allclose(parts.rms, whole.rms, rtol=1e-9)


@pytest.mark.slow
def test_instruments_leave_out_the_same_rows() -> None:
    settings = Filter(position_cutoff_hz=40.0, cutoff_hz=18.0, rate_hz=50.0)
    data = replace(standing(0, 1), filter=settings)
    found = di.fit(sharp(), data, di.IV(instruments=Filtered(20.0)))
    place = given().names.index("Fc@elbow")
    assert abs(found.values[place] - COULOMB[ELBOW]) < 0.05
    assert found.joint_errors[ELBOW] < 0.1


@pytest.mark.slow
def test_a_width_beyond_what_a_joint_stands_at_is_said_with_the_line_that_mends_it() -> None:
    data = standing(0, 1, 2)
    wide, place = di.fit(given(), data), given().names.index("Fc@elbow")
    (note,) = (one for one in wide.notes if "friction_width" in one)
    assert "within which elbow stood" in note and "shoulder = 0.02" in note
    width = float(note.rsplit("elbow = ", 1)[1].split(" ")[0])
    mended = di.fit(given().with_friction_width("elbow", width), data)
    assert not any("friction_width" in one for one in mended.notes)
    off = [abs(one.values[place] - COULOMB[ELBOW]) for one in (wide, mended)]
    assert off[1] < off[0] / 10


@pytest.mark.slow
def test_a_short_recording_of_a_joint_that_is_known_to_stand_loses_its_stops_too() -> None:
    """Fits and comparisons count the same rows, whatever either shows of the joint by itself."""
    train = standing(0, 1, 2)
    (long,) = standing(7).recordings
    short = Dataset((long.cut(0.0, 4.0),))
    assert without_stops(given(), short).recordings[0].stops == ()
    fit = di.fit(sharp(), train)
    assert fit.standing == ("elbow",)
    found = di.compare(fit, short)
    assert found.results[0].joint_errors[ELBOW] < 3.0 * fit.joint_errors[ELBOW]
    models = compare_models({"given": sharp()}, train, short)
    assert models.results[0].joint_errors[ELBOW] < 3.0 * fit.joint_errors[ELBOW]


def test_a_standing_joint_is_remembered_in_the_file(tmp_path: Path) -> None:
    fit = di.fit(sharp(), standing(0, 1))
    fit.save(tmp_path / "fit.json")
    assert di.load_estimate(tmp_path / "fit.json").standing == fit.standing == ("elbow",)


def repeated(seed: int) -> Recording:
    """A motion there and back, so that it joins to itself, three times with noise of its own."""
    (one,) = standing(seed).recordings
    q = np.concatenate([one.q, one.q[-2:0:-1]])
    period, rate = len(q) / RATE_HZ, RATE_HZ
    q = np.concatenate([q, q, q])
    t = np.arange(len(q)) / rate
    model, rng = sharp(), np.random.default_rng([seed, 9])
    values = true_values(given(), Fv__shoulder=1.0, Fc__shoulder=3.0, Fc__elbow=2.0)
    smooth = lowpass(q, rate, 30.0)
    v = np.gradient(smooth, 1.0 / rate, axis=0)
    a = np.gradient(v, 1.0 / rate, axis=0)
    tau = model.torque(model.block(t, smooth, v, a), values)
    q = smooth + 1e-5 * rng.normal(size=q.shape)
    tau = tau + 0.05 * rng.normal(size=q.shape)
    return Recording(t, q, tau, model.robot.names, period=period, name=f"{seed}")


def test_rows_that_count_in_some_repetitions_alone_are_no_noise_of_the_inputs() -> None:
    data = Dataset((repeated(0),))
    marked = without_stops(sharp(), data)
    assert marked.recordings[0].stops and len(marked.recordings[0].stops[ELBOW])
    by_repeats, by_encoders = input_noise(sharp(), data), encoder_noise(sharp(), stated(data))
    place = sharp().names.index("Fc@elbow")
    assert by_repeats.share[place] < 10.0 * by_encoders.share[place]


def stated(data: Dataset) -> Dataset:
    return replace(data, noise=Noise(np.full(2, 1e-5), np.full(2, 0.05)))


@pytest.mark.slow
def test_noise_in_the_rows_that_count_is_no_lack_of_fit() -> None:
    estimate = di.fit(sharp(), Dataset(tuple(repeated(seed) for seed in range(3))))
    assert estimate.standing == ("elbow",)
    assert "rejected" not in estimate.headline
