"""A joint that sticks at its reversals: nothing is said to be missing there."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

import dynident as di
from dynident.diagnosis.nuisances.sticking import (
    left_out_at,
    seen_alike,
    sticking_joints,
    sticking_notes,
    without_reversals,
    without_sticking,
)
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.fitting.reversals.joint_speeds import JointSpeeds
from dynident.fitting.reversals.standing_joints import near_stops, without_stops
from dynident.fitting.sampling import sample
from dynident.recording import Dataset, Recording, default_filter
from dynident.reporting.headline import headline
from standing_arm import COULOMB, RATE_HZ, STOPPED, WIDTH, given, record
from synthetic import synthetic, true_values


def evidence(stands: float) -> Evidence:
    return Evidence(given(), gather(Dataset(tuple(record(seed, stands) for seed in (0, 1)))))


def test_recordings_whose_reversals_cannot_be_left_out_are_not_the_same_seen_otherwise() -> None:
    """A low cut-off spreads a reversal over so many rows that too few would be left."""
    data = Dataset(tuple(record(seed, STOPPED) for seed in (0, 1)))
    usual = Evidence(given(), gather(data))
    without = without_reversals(usual, ("elbow",))
    lower = [
        Evidence(
            given(), gather(replace(data, filter=default_filter(RATE_HZ).narrowed(share, RATE_HZ)))
        )
        for share in (0.7, 0.05)
    ]
    (seen,) = seen_alike(lower, without)
    assert left_out_at(seen) == ("elbow",)
    assert len(seen_alike(lower, usual)) == len(seen_alike(lower, without, None, "shoulder")) == 2
    assert len(seen_alike(lower, without, None, "elbow")) == 1


def test_fits_and_the_diagnosis_leave_out_the_same_rows_of_a_joint_that_stands() -> None:
    """Also of recordings of unlike speed, beside one in which no reversal is rounded."""
    usual, slow = record(0, STOPPED), record(1, STOPPED)
    middle = slow.q.mean(axis=0)
    both = usual, slow.replace(q=middle + 0.5 * (slow.q - middle))
    fitted = without_stops(given(), Dataset(both))
    diagnosed = without_reversals(Evidence(given(), gather(Dataset(both))), ("elbow",))
    for one, run in zip(fitted.recordings, diagnosed.runs, strict=True):
        np.testing.assert_array_equal(sample(one, None).counting, run.certain_rows)


def test_a_joint_that_never_stands_has_no_stop_that_could_be_rounded() -> None:
    moving = evidence(0.0)
    (one, *_) = moving.runs
    (less, *_) = without_reversals(moving, ("elbow",)).runs
    plain = near_stops(JointSpeeds(one.replicates[0]), moving.criteria.sticking, 0.0, [1])
    np.testing.assert_array_equal(less.certain_rows, ~plain)


def test_only_the_joint_that_stands_sticks() -> None:
    for stands, expected in ((STOPPED, ("elbow",)), (0.0, ())):
        of = evidence(stands)
        fitted = fit_evidence(of, of.model)
        assert sticking_joints(of, fitted) == expected
        without, held = without_sticking(of, None, fitted)
        assert held is None
        assert (without is of) == (not expected)
        assert without_sticking(without, None, fitted)[0] is without


@pytest.mark.parametrize(
    ("rate_hz", "torque", "sticks"),
    [
        (100.0, "held_command", True),
        (100.0, "measured", False),
        (1000.0, "held_command", False),
        (4000.0, "measured", False),
    ],
)
def test_reversals_that_are_sampled_count_however_fine_the_encoder(
    rate_hz: float, torque: Literal["measured", "held_command"], sticks: bool
) -> None:
    """One sample within the noise of the speed is no standing; none within the width is coarse."""
    model, each = given(), []
    truth = true_values(model, Fv__shoulder=1.0, Fc__shoulder=COULOMB[0], Fc__elbow=COULOMB[1])
    for seed in range(2):
        noise = 1e-7 * np.random.default_rng(seed).normal(size=(round(16 * rate_hz) + 1, 2))
        one = synthetic(model, truth, seed, rate_hz=rate_hz, torque_std=0.05)
        each.append(one.replace(q=one.q + noise, torque=torque))
    of = Evidence(model, gather(Dataset(tuple(each))))
    assert bool(sticking_joints(of, fit_evidence(of, model))) == sticks


def rested(recording: Recording, still: slice | None = None) -> Recording:
    """The same after a second at rest, and before another; or with an elbow that is idle."""
    rows = round(RATE_HZ)
    q, tau = (
        np.concatenate([np.repeat(x[:1], rows, 0), x, np.repeat(x[-1:], rows, 0)])
        for x in (recording.q, recording.tau)
    )
    if still is not None:
        q[:, still] = q[0, still]
    noise = 1e-5 * np.random.default_rng(9).normal(size=q.shape)
    return recording.replace(t=np.arange(len(q)) / RATE_HZ, q=q + noise, tau=tau)


@pytest.mark.parametrize(("still", "sticks"), [(None, ()), (slice(1, 2), ("elbow",))])
def test_a_rest_at_an_end_is_no_sticking_and_one_throughout_a_recording_is(
    still: slice | None, sticks: tuple[str, ...]
) -> None:
    """What holds an idle joint is whatever others ask for; a recording may begin at rest."""
    each = tuple(rested(record(seed, 0.0), still) for seed in range(3))
    of = Evidence(given(), gather(Dataset((*each, record(5, 0.0)))))
    assert sticking_joints(of, fit_evidence(of, of.model)) == sticks


def test_rows_around_reversals_count_no_more_and_the_others_do() -> None:
    """Coulomb friction is right without them, and off with them."""
    of = evidence(STOPPED)
    without = without_reversals(of, ("elbow",))
    at = of.model.names.index("Fc@elbow")
    sharp = of.model.with_friction_width("elbow", 0.1 * WIDTH)
    before, after = (fit_evidence(e, sharp) for e in (of, without))
    assert abs(after.values[at] - COULOMB[1]) < 0.3 * abs(before.values[at] - COULOMB[1])
    assert after.values[at] == pytest.approx(COULOMB[1], abs=4 * np.sqrt(after.covariance[at, at]))
    left_out = ~np.concatenate([run.certain_rows for run in without.runs])
    assert not left_out[:, 0].any()
    assert 0.05 < left_out[:, 1].mean() < 0.4
    assert sticking_notes(of) == ()
    (note,) = sticking_notes(without)
    assert note.startswith("elbow stands still")
    (note,) = sticking_notes(without_reversals(of, ("shoulder", "elbow")))
    assert note.startswith("shoulder and elbow stand still") and "of each joint's rows" in note


@pytest.mark.slow
def test_stops_are_seen_in_all_samples_of_a_fast_recording() -> None:
    """They are over in a few samples, if columns are evaluated at fewer."""
    fast = Dataset(tuple(record(seed, 0.01, rate_hz=5000.0) for seed in (0, 1)))
    found, rows = [], []
    for samples_hz in (np.inf, 1000.0):
        of = Evidence(given(), gather(fast, samples_hz=samples_hz))
        found.append(sticking_joints(of, fit_evidence(of, of.model)))
        rows.append([run.certain_rows for run in without_reversals(of, ("elbow",)).runs])
    assert found == [("elbow",)] * 2
    np.testing.assert_array_equal(*rows)


def test_noise_of_the_speed_is_that_of_encoder_and_filter() -> None:
    clean = record(0, 0.0)
    noise = 1e-4 * np.random.default_rng(3).normal(size=clean.q.shape)
    without, noisy = (sample(clean.replace(q=clean.q + more), None) for more in (0.0, noise))
    expected = np.std(noisy.motion.v - without.motion.v, axis=0)
    np.testing.assert_allclose(JointSpeeds(noisy).noise, expected, rtol=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("stribeck", "found"), [(0.0, []), (1.0, ["stribeck_friction@elbow"])])
def test_a_robot_that_sticks_lacks_what_it_lacks_away_from_reversals(
    stribeck: float, found: list[str]
) -> None:
    train = Dataset(tuple(record(seed, STOPPED, stribeck) for seed in range(3)))
    said = di.diagnose(given(), train, Dataset((record(7, STOPPED, stribeck),)))
    assert [step.effect.label for step in said.steps] == found
    assert said.verdict == ("explained" if found else "nothing_missing")
    assert "What happens around stops at elbow is not judged." in said.sentence
    assert "What happens around stops at elbow is not judged." in headline(said).sentence
