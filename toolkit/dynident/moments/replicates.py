"""Second moments from which noise has been taken out by replicates of the same motion.

Where a motion repeats, products of different repetitions are free of noise in the mean, and plain
squares give the variance of the answers. Where it does not, copies with more of the stated noise
say what the noise does to the squares.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from dynident.moments.second_moments import SecondMoments

Kind = Literal["repeated", "noise_augmented", "single"]
"""How the replicates of a signal come about: repetitions of a period; the measured record followed
by copies to which the stated noise was added once more; or one record, of unknown noise."""


def replicate_moments(
    left: np.ndarray, right: np.ndarray, edges: np.ndarray, kind: Kind
) -> SecondMoments:
    """Second moments of columns of one recording, about zero.

    Parameters
    ----------
    left, right : (P, ..., S, a) and (P, ..., S, b)
        Columns at S instants in P replicates.
    edges : (B + 1,)
        First instant of each block, and S.
    kind : Kind
        What the replicates are.

    Returns
    -------
    (B, ..., a, b); noisy copies do not count as rows
    """
    blocks = [slice(start, stop) for start, stop in pairwise(edges.tolist())]
    if kind == "noise_augmented":
        total = _block_products(left[:1], right[:1], blocks)
        noise = _block_products(left[1:] - left[0], right[1:] - right[0], blocks)
        free = total - noise / (len(left) - 1)
        return SecondMoments(total, np.diff(edges), None, free)
    total, free = _block_products(left, right, blocks), None
    if kind == "repeated":
        one = left.sum(axis=0, keepdims=True)
        two = one if right is left else right.sum(axis=0, keepdims=True)
        free = (_block_products(one, two, blocks) - total) / (len(left) - 1)
    return SecondMoments(total, np.diff(edges) * len(left), None, free)


def _block_products(left: np.ndarray, right: np.ndarray, blocks: list[slice]) -> np.ndarray:
    """Products of columns over instants and replicates, block by block, (B, ..., a, b)."""
    turned = np.swapaxes(left, -1, -2)
    found = np.empty((len(blocks), *left.shape[1:-2], left.shape[-1], right.shape[-1]))
    for one, some in zip(found, blocks, strict=True):
        if len(left) == 1:
            np.matmul(turned[0, ..., some], right[0, ..., some, :], out=one)
        else:
            np.add.reduce(turned[..., some] @ right[..., some, :], axis=0, out=one)
    return found


@dataclass(frozen=True)
class TimeVarying:
    """Columns of a recording that repeats, some of which the time of the session changes.

    Attributes
    ----------
    columns : (P, S, k)
    instruments : (P, S, k) the same of the next repetition's motion at this one's time.
    is_torque : (k,) mask.
    """

    columns: np.ndarray
    instruments: np.ndarray
    is_torque: np.ndarray


def time_varying_products(left: TimeVarying, right: TimeVarying, edges: np.ndarray) -> np.ndarray:
    """Products, free of noise, of columns of which some depend on the time, (B, a, b).

    Such a column is another one in each repetition, and products of repetitions are not its
    square. Its instrument is the motion of the next repetition at the time of this one.

    Parameters
    ----------
    left, right : columns of the same recording, (P, S, a) and (P, S, b).
    edges : (B + 1,) first instant of each block, and S.

    Returns
    -------
    (B, a, b)
    """
    found = []
    for start, stop in pairwise(edges):
        one, two = left.columns[:, start:stop], right.columns[:, start:stop]
        for_one, for_two = left.instruments[:, start:stop], right.instruments[:, start:stop]
        there = np.einsum("psa,psb->ab", one, for_two, optimize=True)
        back = np.einsum("psa,psb->ab", for_one, two, optimize=True)
        # The torque has no instrument: what it holds of the time is its own.
        weight = np.where(left.is_torque, 0.0, 0.5)[:, None]
        weight = np.where(right.is_torque[None, :] & ~left.is_torque[:, None], 1.0, weight)
        found.append((1.0 - weight) * there + weight * back)
    return np.array(found)
