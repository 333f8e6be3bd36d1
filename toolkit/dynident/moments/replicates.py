"""Second moments from which noise has been taken out by replicates of the same motion.

Where a motion repeats, products of different repetitions are free of noise in the mean, and plain
squares give the variance of the answers. Where it does not, copies with more of the stated noise
say what the noise does to the squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from dynident.moments.second_moments import SecondMoments

_RANK = 1e-9
"""Of the largest direction of scaled columns, below which values are not sought."""

Kind = Literal["repeated", "noise_augmented", "single"]
"""How the replicates of a signal come about: repetitions of a period; the measured record followed
by copies to which the stated noise was added once more; or one record, of unknown noise."""


def in_blocks(replicates: Sequence[np.ndarray], edges: np.ndarray) -> np.ndarray:
    """Arrange columns of several recordings that are cut alike, block by block.

    Parameters
    ----------
    replicates : P of (R, k, S)
        Columns at S instants of R recordings.
    edges : (B + 1,)
        First instant of each block, and S.

    Returns
    -------
    (R B, k, P, L), of the longest block's length; after a shorter one there are zeros
    """
    recordings, columns, _ = replicates[0].shape
    lengths = np.diff(edges)
    shape = len(lengths), columns, len(replicates), lengths.max(initial=0)
    found = np.zeros((recordings, *shape))
    every = np.stack(replicates, axis=2)
    for b, (start, stop) in enumerate(pairwise(edges.tolist())):
        found[:, b, ..., : stop - start] = every[..., start:stop]
    return found.reshape(-1, *shape[1:])


def out_of_blocks(rows: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Columns (R, P, S, k) that `in_blocks` has arranged."""
    lengths = np.diff(edges)
    _, *shape = rows.shape
    each = rows.reshape(-1, len(lengths), *shape)
    pieces = [each[:, b, ..., :length] for b, length in enumerate(lengths)]
    return np.moveaxis(np.concatenate(pieces, axis=-1), 1, -1)


def replicate_moments(
    left: np.ndarray, right: np.ndarray, counts: np.ndarray, kind: Kind
) -> SecondMoments:
    """Second moments of columns, about zero.

    Parameters
    ----------
    left, right : (B, ..., a, P, L) and (B, ..., b, P, L)
        Columns in P replicates, arranged by `in_blocks`.
    counts : (B,)
        Instants of each block.
    kind : Kind
        What the replicates are.

    Returns
    -------
    (B, ..., a, b); noisy copies do not count as rows
    """
    replicates = left.shape[-2]
    if kind == "noise_augmented":
        first, other = left[..., :1, :], right[..., :1, :]
        total = _products(first, other)
        noise = _products(left[..., 1:, :] - first, right[..., 1:, :] - other)
        return SecondMoments(total, counts, None, total - noise / (replicates - 1))
    total, free = _products(left, right), None
    if kind == "repeated":
        one = np.einsum("...pl->...l", left)
        two = one if right is left else np.einsum("...pl->...l", right)
        free = (one @ np.swapaxes(two, -1, -2) - total) / (replicates - 1)
    return SecondMoments(total, counts * replicates, None, free)


def _products(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Products of columns over instants and replicates, (B, ..., a, b)."""
    one, two = (each.reshape(*each.shape[:-2], -1) for each in (left, right))
    return one @ np.swapaxes(two, -1, -2)


@dataclass(frozen=True)
class TimeVarying:
    """Columns of recordings that repeat, some of which the time of the session changes.

    Attributes
    ----------
    columns : (R, P, S, k)
    instruments : (R, P, S, k) the same of the next repetition's motion at this one's time.
    is_torque : (k,) mask.
    """

    columns: np.ndarray
    instruments: np.ndarray
    is_torque: np.ndarray

    def about(self, values: np.ndarray) -> TimeVarying:
        """Return columns before the torque with what values (p,) of them leave of it in its place.

        Products with it are those of the instruments alone, and hold no noise of the columns times
        the whole torque.
        """
        left = self.columns[..., -1:] - (self.columns[..., :-1] @ values)[..., None]
        return TimeVarying(
            np.concatenate([self.columns[..., :-1], left], axis=3),
            np.concatenate([self.instruments[..., :-1], np.roll(left, -1, axis=1)], axis=3),
            self.is_torque,
        )

    def products_of_each(self, width: int, edges: np.ndarray) -> np.ndarray:
        """Products, free of noise, of each group of neighbouring columns, (R B, k / width, w, w).

        As `time_varying_products`; what columns of two groups have in common is not worked out.

        Parameters
        ----------
        width : of a group, w, alike in all; no column is the torque.
        edges : (B + 1,) first instant of each block, and S.
        """
        recordings, _, _, count = self.columns.shape
        shape, found = (recordings, count // width, width, -1), []
        for start, stop in pairwise(edges.tolist()):
            one, two = (
                np.moveaxis(each[:, :, start:stop], 3, 1).reshape(shape)
                for each in (self.columns, self.instruments)
            )
            there = one @ np.swapaxes(two, -1, -2)
            found.append((there + np.swapaxes(there, -1, -2)) / 2.0)
        return np.stack(found, axis=1).reshape(-1, *shape[1:3], width)


def instrumental_values(every: Sequence[TimeVarying]) -> np.ndarray:
    """Values (p,) of columns before the torque that leave nothing of it in any instrument.

    Parameters
    ----------
    every : the same columns of several joints and recordings.
    """
    gram, cross = 0.0, 0.0
    for one in every:
        columns = one.columns.reshape(-1, one.columns.shape[3])
        instruments = one.instruments.reshape(columns.shape)[:, :-1]
        gram = gram + instruments.T @ columns[:, :-1]
        cross = cross + instruments.T @ columns[:, -1]
    size = np.sqrt(np.abs(np.diag(gram)))
    scale = 1.0 / np.where(size > 0, size, 1.0)
    scaled = np.asarray(gram) * scale[:, None] * scale
    return scale * np.linalg.lstsq(scaled, scale * cross, rcond=_RANK)[0]


def with_torque_again(products: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Products (R B, p + 1, k) with the torque, of those with what values (p,) leave of it."""
    found = np.array(products)
    found[:, -1] += values @ products[:, :-1]
    return found


def time_varying_products(left: TimeVarying, right: TimeVarying, edges: np.ndarray) -> np.ndarray:
    """Products, free of noise, of columns of which some depend on the time, (R B, a, b).

    Such a column is another one in each repetition, and products of repetitions are not its
    square. Its instrument is the motion of the next repetition at the time of this one.

    Parameters
    ----------
    left, right : columns of the same recordings, (R, P, S, a) and (R, P, S, b).
    edges : (B + 1,) first instant of each block, and S.

    Returns
    -------
    (R B, a, b)
    """
    # The torque has no instrument: what it holds of the time is its own.
    weight = np.where(left.is_torque, 0.0, 0.5)[:, None]
    weight = np.where(right.is_torque[None, :] & ~left.is_torque[:, None], 1.0, weight)
    found = []
    for start, stop in pairwise(edges):
        one, for_one, two, for_two = (
            each[:, :, start:stop].reshape(len(each), -1, each.shape[3])
            for each in (left.columns, left.instruments, right.columns, right.instruments)
        )
        there = np.swapaxes(one, 1, 2) @ for_two
        back = np.swapaxes(for_one, 1, 2) @ two
        found.append((1.0 - weight) * there + weight * back)
    return np.stack(found, axis=1).reshape(-1, *weight.shape)
