"""White noise in smooth signals, from high differences: motion has next to nothing in them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import comb

_STEEP = 6
"""Order of differences for measured positions. Motion at a twentieth of the sampling rate is damped
a thousand times in them; jumps of the acceleration are in few samples."""
_AT_ONCE = 16384  # samples that are looked at
_BLOCK = 200
"""Samples of a block. Most blocks are free of jumps, and their median is that of noise."""


def white_variance(x: np.ndarray, order: int = 3) -> np.ndarray:
    """Variance of the white noise in a smooth signal, from its differences.

    Parameters
    ----------
    x : (T, ...).
    order : of the differences; of white noise of variance 1 they have the variance C(2 order,
        order), 20 at order 3.

    Returns
    -------
    (...)
    """
    rough = np.diff(x, order, axis=0)
    return np.sum(rough**2, axis=0) / (comb(2 * order, order) * max(len(rough), 1))


def encoder_noise_std(q: np.ndarray) -> np.ndarray:
    """Standard deviation of the white noise in measured positions (T, n), (n,) rad or m.

    The median over blocks of time: where dry friction turns round is no noise. Of noise that was
    filtered before it was recorded only what is left near half the sampling rate is seen.
    """
    count = max(1, len(q) // _BLOCK)
    size, longer = divmod(len(q), count)  # so many blocks are longer by one
    border = longer * (size + 1)
    blocks = [*_of_blocks(q[:border], size + 1), *_of_blocks(q[border:], size)]
    return np.sqrt(np.median(np.concatenate(blocks), axis=0))


def _of_blocks(q: np.ndarray, size: int) -> Iterator[np.ndarray]:
    """Yield the variances (B, n) of blocks of so many samples, some blocks at a time."""
    at_once = size * max(1, _AT_ONCE // size)
    for start in range(0, len(q), at_once):
        part = q[start : start + at_once]
        blocks = part.reshape(-1, size, q.shape[1]).transpose(1, 0, 2)
        yield white_variance(blocks, _STEEP)
