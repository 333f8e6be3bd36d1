"""Shares of residuals whose composition is known: what is there is found, what is not is not."""

from __future__ import annotations

import numpy as np
import pytest

from residuals import bristles, drift, record, rough_friction, shared_gear, shares_of, tight_cable

STATE, MOTION, PAST, OTHERS, TIME = (
    "position and velocity",
    "acceleration and load",
    "past",
    "other joints",
    "time",
)
SEEDS = range(20)

pytestmark = pytest.mark.slow  # twenty regressions a test


@pytest.mark.parametrize(
    ("law", "inputs", "found"),
    [
        (rough_friction, STATE, 0.8),
        (shared_gear, OTHERS, 0.8),
        (tight_cable, OTHERS, 0.5),
        (drift, TIME, 0.8),
    ],
)
def test_a_law_is_found_in_the_inputs_that_it_has(law, inputs: str, found: float) -> None:
    """Most of it: a regression learns from noisy rows and never finds more than is there."""
    made = [shares_of(record(seed, {law: 0.6})) for seed in SEEDS[:4]]
    for one in made:
        share = one.by[inputs]
        assert share.told and share.value < 0.6 + 3 * share.error
    assert np.mean([one.by[inputs].value for one in made]) > found * 0.6
    others = [s for one in made for name, s in one.by.items() if name != inputs]
    assert sum(s.told for s in others) <= 1


def test_hysteresis_is_in_the_past_and_not_in_the_acceleration() -> None:
    """After a reversal the way since then is nearly v^2 / 2a: the better of the two goes first."""
    made = [shares_of(record(seed, {bristles: 0.7})) for seed in SEEDS[:4]]
    assert all(one.by[PAST].told for one in made)
    assert np.mean([one.by[PAST].value for one in made]) > 0.25
    assert max(one.by[MOTION].value for one in made) < 0.1
    assert not any(one.by[OTHERS].told or one.by[TIME].told for one in made)


def test_two_laws_are_told_apart_and_add_up() -> None:
    made = [shares_of(record(seed, {rough_friction: 0.4, shared_gear: 0.3})) for seed in SEEDS[:4]]
    for name, share in ((STATE, 0.4), (OTHERS, 0.3)):
        values = [one.by[name].value for one in made]
        assert all(one.by[name].told for one in made)
        assert 0.7 * share < np.mean(values) < share + 0.05
    for one in made:
        told = sum(s.value for s in one.by.values() if s.told)
        assert told + one.rest.value == pytest.approx(1.0)


@pytest.mark.parametrize("correlation_s", [0.0, 0.2, 1.0])
def test_noise_of_any_colour_depends_on_nothing(correlation_s: float) -> None:
    made = [shares_of(record(seed, {}, correlation_s=correlation_s), rows=300) for seed in SEEDS]
    claimed = sum(any(s.told for s in one.by.values()) for one in made)
    assert claimed <= 1


def test_a_motion_that_repeats_is_no_way_to_look_up_noise_that_repeats() -> None:
    """What comes again with the motion, but is no function of anything: nothing is learnt of it."""
    claimed = 0
    for seed in SEEDS:
        one = record(seed, {}, duration=32.0, period=8.0)
        period = round(8.0 * 50.0)
        noise = np.convolve(one.residual[:period, 0], np.ones(10) / 3, mode="same")
        one.residual[:, 0] = np.tile(noise, 4)
        claimed += any(s.told for s in shares_of(one, rows=300).by.values())
    assert claimed <= 1


@pytest.mark.parametrize("first", ["told", "nothing"])
def test_a_set_that_is_asked_again_is_asked_beside_what_is_told_by_then(first: str) -> None:
    """And is asked once where that is as before."""
    one = record(3, {bristles: 0.7} if first == "told" else {})
    either = shares_of(one, rows=300, order=((MOTION, PAST), (MOTION, PAST)))
    (better, share), (other, _) = either.by.items()
    assert share.told is (first == "told")
    assert either == shares_of(one, rows=300, order=((better,), (other,)))


def test_with_the_noise_taken_off_shares_are_of_what_is_systematic() -> None:
    one = record(3, {rough_friction: 0.5})
    everything, systematic = shares_of(one), shares_of(one, noise=0.5)
    assert systematic.by[STATE].value == pytest.approx(2 * everything.by[STATE].value, rel=0.15)
    assert systematic.rest.value < 0.3 < everything.rest.value


def test_nothing_beside_the_noise_has_no_shares() -> None:
    with pytest.raises(AssertionError):
        shares_of(record(3, {}), noise=2.0)
    silent = record(3, {})
    silent.residual[:] = 0.0
    with pytest.raises(AssertionError):
        shares_of(silent)
