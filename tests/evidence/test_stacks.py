"""Recordings that are taken together: what they tell is what each tells alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.evidence.noise_model import NoiseModel
from dynident.evidence.runs import Run, flagged_run, gather
from dynident.evidence.stacks import Stack
from dynident.moments.replicates import in_blocks, out_of_blocks
from dynident.recording import Dataset, Noise
from study_files import recording

NOISE = NoiseModel(
    0.3, np.array([0.1, 1.0]), np.array([0.8, 1.2]), np.array([1.0, -0.6, 0.3, -0.1])
)


def runs(noise: Noise | None = None) -> tuple[Run, ...]:
    every = [recording(seed) for seed in (0, 1001, 1017)]
    if noise is not None:
        every = [replace(one, period=None) for one in every]
    return gather(Dataset(tuple(every), noise=noise))


@pytest.mark.parametrize("noise", [None, Noise(np.full(2, 1e-5), np.full(2, 0.02))])
def test_alike_recordings_tell_together_what_each_tells_alone(noise: Noise | None) -> None:
    first, second, third = runs(noise)
    sticks = np.zeros(second.replicates[0].tau.shape, dtype=bool)
    sticks[40:90, 1] = True
    every = (first, replace(second, uncertain=sticks), third)
    rng = np.random.default_rng(0)
    signals = [
        [[rng.standard_normal((len(one.t), k)) for k in (2, 1)] for one in run.replicates]
        for run in every
    ]
    (together,) = Stack.of(every)
    white = together.whitened(signals, 1, NOISE)
    found, rows = together.moments(white, white), together.unfolded(white)
    for r, (run, own) in enumerate(zip(every, signals, strict=True)):
        alone = Stack((run,))
        one = alone.whitened([own], 1, NOISE)
        expected, blocks = alone.moments(one, one), len(run.edges) - 1
        of_run = slice(r * blocks, (r + 1) * blocks)
        assert rows[r] == pytest.approx(alone.unfolded(one)[0], abs=1e-12)
        assert found.total[of_run] == pytest.approx(expected.total, rel=1e-12, abs=1e-9)
        assert found.signal[of_run] == pytest.approx(expected.signal, rel=1e-12, abs=1e-9)
        assert np.array_equal(np.asarray(found.counts)[of_run], expected.counts)


def test_recordings_keep_their_order_and_unlike_ones_are_apart() -> None:
    """The columns of a payload's recordings are others than those of the rest."""
    first, second, third = runs()
    shorter = replace(third, edges=third.edges[:-1])
    for every, lengths in (
        ((first, second, third), [3]),
        ((first, flagged_run(second, True), third), [1, 1, 1]),
        ((first, second, shorter), [2, 1]),
    ):
        found = Stack.of(every)
        assert [len(one.runs) for one in found] == lengths
        assert [one for stack in found for one in stack.runs] == list(every)
        assert [number for stack in found for number in stack.numbers] == [0, 1, 2]


def test_blocks_hold_every_row_once() -> None:
    rows = np.random.default_rng(0).standard_normal((2, 3, 11, 4))
    edges = np.array([0, 3, 7, 11])
    blocks = in_blocks([rows[:, p].swapaxes(1, 2) for p in range(3)], edges)
    assert blocks.shape == (6, 4, 3, 4)
    assert np.array_equal(out_of_blocks(blocks, edges), rows)
    assert np.sum(blocks**2) == pytest.approx(np.sum(rows**2))
