"""Angles that are kept within a turn, and joints that turn on: whole turns change nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident.errors import DynidentWarning, RecordingError
from dynident.fitting.instrumental.measured_instruments import SwappedPeriods
from dynident.recording import (
    Dataset,
    Recording,
    as_points,
    periods,
    read,
    require_repetition,
    turning_round,
    usable,
    within_limits,
    write,
)
from dynident.recording.formats import whole_turns as module
from dynident.recording.formats.whole_turns import unwrapped, unwrapped_notes
from dynident.study_draft.timing import period_of

TURN = 2 * np.pi
RATE = 200.0


def turning(turns: float, period: float = 2.0, repetitions: float = 4.0) -> Recording:
    """A joint that goes so many turns in each period, also back on its way; one that slides."""
    t = np.arange(round(repetitions * period * RATE)) / RATE
    w = TURN / period
    angle = turns * w * t + 1.5 * np.sin(w * t) + np.cos(3 * w * t)
    q = np.column_stack([angle, 3.5 * np.sin(w * t)])
    q += 1e-4 * np.random.default_rng(0).standard_normal(q.shape)
    names = ("rotor", "slide")
    return Recording(t, q, q, names, q_ref=q, continuous=("rotor",), period=period, name="run")


def kept_within(one: Recording, low: float, turn: float = TURN) -> Recording:
    """The same as a logger has it that keeps the angle, and its reference, within a turn."""
    q = np.array(one.q)
    q[:, 0] = (q[:, 0] * turn / TURN - low) % turn + low
    return one.replace(q=q, q_ref=q)


@pytest.mark.parametrize(("low", "turn"), [(-np.pi, TURN), (0.0, TURN), (-180.0, 360.0)])
@pytest.mark.parametrize("turns", [0.4, -2.0, 7.3])
def test_angles_go_on_where_they_jumped(
    low: float, turn: float, turns: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_AT_ONCE", 100)
    whole = turning(turns)
    found = unwrapped(kept_within(whole, low, turn), ("revolute", "prismatic"))
    assert found.provenance.unwrapped == ("rotor",)
    apart = found.q[:, 0] / turn - whole.q[:, 0] / TURN
    np.testing.assert_allclose(apart, np.round(apart[0]), atol=1e-9)
    np.testing.assert_array_equal(found.q[:, 1], whole.q[:, 1])
    assert found.q_ref is not None
    np.testing.assert_allclose(found.q_ref, found.q)


def test_a_reference_follows_the_position_that_alone_was_kept_within_a_turn() -> None:
    whole = turning(2.0)
    found = unwrapped(kept_within(whole, -np.pi).replace(q_ref=whole.q), ("continuous",) * 2)
    assert found.q_ref is not None
    np.testing.assert_allclose(found.q_ref, found.q)


def test_a_joint_that_rests_at_the_end_of_its_turn() -> None:
    """Its noise alone makes it jump, forth and back."""
    noise = 1e-3 * np.random.default_rng(0).standard_normal(400)
    q = (noise + TURN) % TURN
    found = unwrapped(Recording(np.arange(400) / RATE, q, q, ("a",)), ("revolute",))
    assert np.ptp(q) > 6.0
    assert np.ptp(found.q) < 0.01


def test_what_is_no_jump_by_whole_turns_stays() -> None:
    t = np.arange(800) / RATE
    stroke = np.where(t > 2.0, TURN, 0.0) + np.sin(t)
    jump = np.where(t > 2.0, 5.0, 0.0) + np.sin(t)
    degrees = np.degrees(4 * np.sin(5 * t))  # up to 5.7 from sample to sample
    fast = 20 * np.sin(25 * t)
    for q, kind in ((stroke, "prismatic"), *((x, "revolute") for x in (jump, degrees, fast))):
        one = Recording(t, q, q, ("a",))
        assert unwrapped(one, (kind,)) is one


def test_reading_says_what_it_has_done(tmp_path: Path) -> None:
    whole = turning(2.0)
    write(kept_within(whole, -np.pi), tmp_path / "run.csv")
    with pytest.warns(DynidentWarning, match=r"run\.csv, column q\.rotor: jumps by whole turns"):
        found = read(tmp_path / "run.csv", kinds=("continuous", "prismatic"))
    assert np.ptp(found.q[:, 0]) > 4 * TURN  # nor is it asked whether that is in degrees
    assert found.continuous == ("rotor",)
    assert found.select(["slide"]).continuous == ()
    notes = unwrapped_notes([(x, found.provenance.unwrapped) for x in ("a", "b")])
    assert notes == (
        "q.rotor jumps by whole turns between samples, and is read as going on (no torque "
        "changes): a, b.",
    )


def test_recordings_come_within_the_limits_of_a_joint() -> None:
    """One started on the other side of the seam, and one never crossed it."""
    t = np.arange(400) / RATE
    truth = [1.0 + 0.8 * np.sin(3 * t), 1.5 + 0.7 * np.cos(3 * t), 2.0 + 0.3 * np.sin(3 * t)]
    low = 1.14 - TURN
    logged = [Recording(t, (q - low) % TURN + low, q, ("a",)) for q in truth]
    each = [unwrapped(one, ("revolute",)) for one in logged]
    found = within_limits(each, {"a": (-2.5, 2.5)})
    for one, q in zip(found, truth, strict=True):
        np.testing.assert_allclose(one.q[:, 0], q, atol=1e-9)
    assert within_limits(logged, {"a": (-2.5, 2.5)})[2] is logged[2]  # nothing has jumped
    degrees = unwrapped(logged[0].replace(q=np.degrees(logged[0].q)), ("revolute",))
    assert degrees.provenance.unwrapped == ("a",)
    degrees = degrees.replace(q=degrees.q + 360.0)
    assert within_limits([degrees], {"a": (-2.5, 2.5)})[0] is degrees


def test_a_motion_that_is_whole_turns_ahead_repeats() -> None:
    one = turning(2.0)
    found = periods(one.samples, RATE, 2.0)
    require_repetition(as_points(one.q, turning_round(one)), found)
    with pytest.raises(RecordingError, match="do not repeat"):
        require_repetition(one.q, found)
    odd = turning(2.4)
    with pytest.raises(RecordingError, match="do not repeat"):
        require_repetition(as_points(odd.q, turning_round(odd)), found)
    assert period_of(one) == 2.0
    assert period_of(one.replace(continuous=())) is None


def test_a_transient_is_seen_although_a_joint_turns_on() -> None:
    one = turning(1.0)
    q = np.array(one.q)
    q[:, 0] += np.exp(-one.t / 0.05)
    stretches = usable(one.replace(q=q)).left_out
    assert stretches
    assert stretches[0].reason == "transient before the motion repeats"


def test_instruments_are_means_over_periods_at_the_same_angle() -> None:
    """Of three periods the others are an odd number of half turns away, or none."""
    one = turning(1.0, repetitions=3.0)
    found = SwappedPeriods().prepare(None, Dataset((one,)), None)  # type: ignore[arg-type]
    instruments = found.instruments.recordings[0]  # type: ignore[union-attr]
    np.testing.assert_allclose(instruments.q, one.q, atol=2e-3)


def test_a_motor_that_turns_about_a_turn_a_sample_is_left_alone() -> None:
    """6000 rpm at 100 Hz: between its ramps every step is a whole turn, and none is a jump."""
    t = np.arange(600) / 100.0
    speed = 628.0 * np.clip(np.minimum(t, 6.0 - t) / 0.1, 0.0, 1.0)
    q = np.cumsum(speed)[:, None] / 100.0
    motor = Recording(t, q, q, ("motor",), name="fast")
    assert unwrapped(motor, ("revolute",)) is motor


def test_what_moved_in_a_gap_is_no_jump() -> None:
    t = np.concatenate([np.arange(200) / 100.0, 4.0 + np.arange(200) / 100.0])
    q = np.where(t < 3.0, 0.0, 6.2)[:, None] + 0.05 * np.sin(t)[:, None]
    gap = Recording(t, q, q, ("joint",), name="gap")
    assert unwrapped(gap, ("revolute",)) is gap


def test_jumps_that_are_no_whole_turns_are_said_and_stay() -> None:
    one = kept_within(turning(7.3), -np.pi)
    q = np.array(one.q)
    crossing = int(np.flatnonzero(np.abs(np.diff(q[:, 0])) > np.pi)[3])
    q[crossing, 0] = 0.0  # a logger that interpolates between both ends
    with pytest.warns(DynidentWarning, match="jumps . times by what is no whole turn"):
        unwrapped(one.replace(q=q), ("revolute", "prismatic"))


def test_angles_in_degrees_are_not_moved_towards_limits_in_rad() -> None:
    some = [kept_within(turning(0.4), -180.0, 360.0), turning(0.1)]
    read_ = [unwrapped(one, ("revolute", "prismatic")) for one in some]
    moved = within_limits(read_, {"rotor": (-3.0, 3.0), "slide": (-5.0, 5.0)})
    for before, after in zip(read_, moved, strict=True):
        np.testing.assert_array_equal(before.q, after.q)


def test_a_reference_alone_that_jumps_names_no_position() -> None:
    whole = turning(0.4)
    one = whole.replace(q_ref=kept_within(whole, -np.pi).q)
    found = unwrapped(one, ("revolute", "prismatic"))
    assert found.provenance.unwrapped == ()
    assert found.q_ref is not None and whole.q_ref is not None
    np.testing.assert_allclose(found.q_ref, whole.q_ref, atol=1e-9)
