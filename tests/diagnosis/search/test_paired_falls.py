"""The standard error of a fall of the held-out error is its scatter over recordings like these."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from dynident.criteria import DEFAULTS
from dynident.diagnosis.search.paired_falls import fall_standard_error, joint_fall
from dynident.diagnosis.search.path import _why
from dynident.effects import catalogue
from dynident.evidence.held_out import HeldOut, HeldOutRun
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

BLOCKS, ROWS = 20, 40


def judged(measured: np.ndarray, residual: np.ndarray) -> HeldOut:
    """What a model that leaves this (T, 2) residual misses of the torque, in equal blocks."""
    rows = len(measured)
    run = HeldOutRun(
        name="run",
        certain=np.ones(measured.shape, dtype=bool),
        t=np.arange(rows) * 0.01,
        q=measured,
        v=measured,
        a=measured,
        measured=measured,
        predicted=measured - residual,
        block=np.arange(rows) * BLOCKS // rows,
    )
    return HeldOut(runs=(run,), noise_std=None, ratio=None, least_ratio=None, inflation=np.ones(2))


def slow(stream: np.random.Generator, memory: float) -> np.ndarray:
    """First-order noise (T, 2) of unit variance, which forgets within `memory` rows."""
    kept = np.exp(-1.0 / memory) if memory else 0.0
    white = stream.standard_normal((BLOCKS * ROWS, 2))
    white[1:] *= np.sqrt(1.0 - kept**2)
    return np.asarray(lfilter([1.0], [1.0, -kept], white, axis=0))


def pair(seed: int, memory: float, missing: float) -> tuple[HeldOut, HeldOut]:
    """A model that lacks an effect, and the one with it: both have what is left in common."""
    stream = np.random.default_rng(seed)
    torque, shape, rest = (slow(stream, memory) for _ in range(3))
    torque = torque * [20.0, 3.0]
    rest = rest * (1.0 + np.abs(torque) / 10.0)
    before, after = missing * shape + rest, 0.1 * missing * shape + rest
    return judged(torque, before), judged(torque, after)


@pytest.mark.parametrize("memory", [0.0, 12.0])
@pytest.mark.parametrize("missing", [0.3, 3.0])
@pytest.mark.slow
def test_it_is_the_scatter_of_the_fall(memory: float, missing: float) -> None:
    """Over 300 records, of residuals that blocks share with their neighbours, too."""
    pairs = [pair(seed, memory, missing) for seed in range(300)]
    falls = np.array([before.error - after.error for before, after in pairs])
    told = np.array([fall_standard_error(*both, together=2) or np.nan for both in pairs])
    assert np.sqrt(np.mean(told**2)) == pytest.approx(falls.std(), rel=0.2)
    covered = np.abs(falls - falls.mean()) <= 2.0 * told
    assert 0.88 < covered.mean() <= 0.99


def test_errors_are_paired() -> None:
    """What is as hard for both models is no doubt about their difference."""
    before, after = pair(7, 0.0, 0.3)
    again = judged(before.runs[0].measured, before.runs[0].residual)
    assert fall_standard_error(before, again, together=2) == pytest.approx(0.0, abs=1e-15)
    known = fall_standard_error(before, after, together=2)
    errors = [
        fall_standard_error(
            judged(one.runs[0].measured, 0.0 * before.runs[0].residual), one, together=2
        )
        for one in (before, after)
    ]
    assert known is not None and all(known < 0.5 * (one or 0.0) for one in errors)


def test_a_few_blocks_tell_no_standard_error() -> None:
    before, after = pair(7, 0.0, 0.3)
    runs = [one.runs[0] for one in (before, after)]
    few = [
        HeldOut(
            runs=(HeldOutRun(**{**vars(run), "block": run.block * 3 // BLOCKS}),),
            noise_std=None,
            ratio=None,
            least_ratio=None,
            inflation=np.ones(2),
        )
        for run in runs
        if run.block is not None
    ]
    assert fall_standard_error(*few, together=2) is None


@pytest.mark.parametrize("period", [None, 8.0])
def test_repetitions_of_an_instant_are_in_one_block(period: float | None) -> None:
    model = Model(arm()) + "viscous_friction"
    truth = true_values(model, Fv__shoulder=1.2, Fv__elbow=0.5)
    recording = synthetic(model, truth, 0, rate_hz=250.0, torque_std=0.3).replace(period=period)
    (run,) = gather(Dataset((recording,)), DEFAULTS.noise)
    blocks = run.block_of_rows
    assert blocks.shape == run.replicates[0].t.shape
    for repetition in run.index:
        for number, (start, stop) in enumerate(zip(run.edges[:-1], run.edges[1:], strict=True)):
            assert np.all(blocks[repetition[start:stop]] == number)


def test_of_one_joint_it_is_that_of_a_robot_with_this_joint_alone() -> None:
    before, after = pair(1, 12.0, 1.0)
    old, new = (
        judged(one.runs[0].measured[:, 1:], one.runs[0].residual[:, 1:]) for one in (before, after)
    )
    of_one = fall_standard_error(before, after, 2, [1])
    assert of_one == pytest.approx(fall_standard_error(old, new, 2))
    assert of_one != fall_standard_error(before, after, 2)


def small_and_large(seed: int, gain: float, rise: float) -> tuple[HeldOut, HeldOut]:
    """A large joint that gets better or worse by chance or more, a small one by a share."""
    stream = np.random.default_rng(seed)
    torque, rest, chance = (slow(stream, 3.0) for _ in range(3))
    torque, rest = torque * [200.0, 1.0], rest * [10.0, 0.1]
    shaken = rest + chance * [0.1, 0.0]
    shaken[:, 0] *= np.sqrt(np.mean(rest[:, 0] ** 2) / np.mean(shaken[:, 0] ** 2)) * (1.0 + rise)
    return judged(torque, rest), judged(torque, shaken * [1.0, 1.0 - gain])


NAMES = ("shoulder", "wrist")
SPRING = catalogue()["joint_spring"]


@pytest.mark.parametrize("seed", range(5))
def test_what_a_small_joint_gains_by_far_is_not_taken_back_for_chance_at_a_large_one(
    seed: int,
) -> None:
    spring = SPRING("wrist")
    before, after = small_and_large(seed, 0.8, 1e-4)
    assert after.error > before.error
    assert not _why(None, spring, (before, after), NAMES, 2)
    before, after = small_and_large(seed, 0.8, 0.05)
    assert "raises the error on held-out blocks" in _why(None, spring, (before, after), NAMES, 2)
    before, after = small_and_large(seed, 0.0, 1e-5)
    assert after.error > before.error
    assert "raises the error on held-out blocks" in _why(None, spring, (before, after), NAMES, 2)


def test_what_makes_its_own_joint_worse_is_taken_back() -> None:
    worse = small_and_large(0, -0.5, -0.3)
    assert worse[1].error < worse[0].error
    for held in ("wrist", "shoulder"):
        why = _why(None, SPRING(held), worse, NAMES, 2)
        assert ("raises the error of wrist" in why) == (held == "wrist")


@pytest.mark.parametrize("seed", range(5))
def test_what_makes_its_own_joint_worse_by_chance_needs_a_large_fall_elsewhere(seed: int) -> None:
    """A backlash of a healthy wrist had taken a hundredth off the errors of a shoulder."""
    stream = np.random.default_rng([seed, 1])
    torque, rest, chance = (slow(stream, 3.0) for _ in range(3))
    rest *= [5.0, 1.0]
    wrist = rest[:, 1] + 0.1 * chance[:, 1]
    wrist *= np.sqrt(np.mean(rest[:, 1] ** 2) / np.mean(wrist**2))
    same = judged(torque, rest), judged(torque, np.stack([rest[:, 0], wrist], axis=1))
    by_chance = fall_standard_error(*same, 2, [1])
    assert by_chance is not None
    wrist *= 1.0 + 1.5 * by_chance / same[0].joint_errors[1]
    for left, taken_back in ((0.99, True), (0.5, False)):
        after = np.stack([left * rest[:, 0], wrist], axis=1)
        both = judged(torque, rest), judged(torque, after)
        own = joint_fall(NAMES, 1, *both, 2)
        assert own.after > own.before and not own.is_rise and both[1].error < both[0].error
        why = _why(None, SPRING("wrist"), both, NAMES, 2)
        assert ("raises the error of wrist" in why) == taken_back
        assert not _why(None, SPRING("shoulder"), both, NAMES, 2)
