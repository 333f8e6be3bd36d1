"""What is held out together, and what a regression may learn from meanwhile."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.diagnosis.dependence.motion_blocks import (
    FEWEST_BLOCKS,
    independent_stretches,
    motion_blocks,
)
from residuals import record, rough_friction


def test_every_row_is_held_out_once_and_its_neighbours_are_not_learnt_from() -> None:
    one = record(0, {}, correlation_s=0.2)
    blocks = motion_blocks((one,), [0])
    rows = np.arange(0, len(one.t), 5)
    units = blocks.units(rows)
    assert np.array_equal(np.sort(np.concatenate([u.rows for u in units])), np.arange(len(rows)))
    assert blocks.gap > 0.2
    for unit in units:
        learnt = np.setdiff1d(np.arange(len(rows)), unit.left_out)
        distance = np.abs(one.t[rows][learnt][:, None] - one.t[rows][unit.rows])
        assert distance.min() > blocks.gap
        assert len(learnt) > 0.7 * len(rows)


def test_repetitions_of_a_period_are_held_out_together() -> None:
    one = record(1, {}, duration=32.0, period=8.0)
    blocks = motion_blocks((one,), [0])
    phase = np.mod(one.t, 8.0)
    for unit in np.unique(blocks.unit):
        inside = blocks.unit == unit
        assert np.ptp(phase[inside]) < 1.0
        assert np.ptp(one.t[inside]) > 23.0


def test_another_recording_of_the_same_motion_is_a_repetition() -> None:
    """Nobody has said so: it begins later, on another clock, with other noise."""
    one = record(2, {})
    later = slice(437, len(one.t))
    rng = np.random.default_rng(0)
    again = replace(
        one.rows(np.arange(len(one.t))[later]),
        source="again",
        q=one.q[later] + 1e-3 * rng.normal(size=one.q[later].shape),
        t=one.t[later] - one.t[437],
    )
    blocks = motion_blocks((one, again), [0])
    first, second = blocks.unit[: len(one.t)], blocks.unit[len(one.t) :]
    assert len(np.unique(blocks.unit)) >= 16
    # But for a few rows at the edges of blocks.
    assert np.mean(second == first[437:]) > 0.99


def test_two_motions_are_not_one() -> None:
    records = (record(3, {}), record(4, {}))
    blocks = motion_blocks(records, [0])
    here = len(records[0].t)
    assert not set(blocks.unit[:here]) & set(blocks.unit[here:])
    assert len(np.unique(blocks.unit)) >= 16


def test_a_single_joint_is_in_every_state_often_and_repeats_nothing() -> None:
    one = record(5, {}, joints=1)
    assert len(np.unique(motion_blocks((one,), [0]).unit)) >= 16


@pytest.mark.parametrize("correlation_s", [2.0, 3.0])
def test_slow_noise_leaves_a_short_recording_few_independent_stretches(
    correlation_s: float,
) -> None:
    short = [record(k, {}, duration=16.0, correlation_s=correlation_s) for k in range(20)]
    assert np.mean([independent_stretches((one,), 0) >= FEWEST_BLOCKS for one in short]) <= 0.1


def test_a_law_of_the_motion_leaves_many() -> None:
    for seed in range(5):
        law = record(seed, {rough_friction: 0.6}, duration=32.0)
        assert independent_stretches((law,), 0) >= FEWEST_BLOCKS
