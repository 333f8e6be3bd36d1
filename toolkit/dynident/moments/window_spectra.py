"""Sums of products of signals with later samples, from the spectra of short windows.

A product of matrices for every lag is as much work as the rest of a fit. Products of the spectra
of windows are a fifth of it: they become sums at all lags by one more transform. Windows are so
short that their transform is a product with a small matrix, which does not move data around.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np


def windowed_products(windows: np.ndarray, lags: int) -> np.ndarray:
    """Return sums over windows of x_a(t) x_b(t + k), for t before the last `lags` samples of each.

    Parameters
    ----------
    windows : (u, S, N) signals in windows of N samples, of which the last `lags` are those of the
        next window, or zero.
    lags : K, the longest lag, below N.

    Returns
    -------
    (K + 1, u, u)
    """
    size, count, length = windows.shape
    there, back = _transforms(length, lags)
    # No lag is so long that it goes round: the sums are those of a circle.
    early = there[:, : length - lags] @ windows[:, :, : length - lags].reshape(size * count, -1).T
    late = there @ windows.reshape(size * count, length).T
    shape = (len(there) // 2, 2 * size, count)
    products = early.reshape(shape) @ late.reshape(shape).swapaxes(1, 2)
    cosines, sines = products[:, :size], products[:, size:]
    both = [
        cosines[:, :, :size] + sines[:, :, size:],
        cosines[:, :, size:] - sines[:, :, :size],
    ]
    found = back @ np.concatenate(both).reshape(-1, size * size)
    return found.reshape(lags + 1, size, size)


@lru_cache(16)
def _transforms(length: int, lags: int) -> tuple[np.ndarray, np.ndarray]:
    """To cosines and sines, each frequency in turn, (2 F, N); their products back, (K + 1, 2 F).

    Parameters
    ----------
    length : N, samples.
    lags : K.
    """
    f = np.arange(length // 2 + 1)
    angles = 2 * np.pi / length * np.outer(f, np.arange(length))
    there = np.stack([np.cos(angles), np.sin(angles)], axis=1).reshape(2 * len(f), length)
    # All frequencies but none and the highest stand for themselves and for their mirror image.
    times = np.where((f == 0) | (2 * f == length), 1.0, 2.0) / length
    lagged = angles[:, : lags + 1].T
    back = np.concatenate([times * np.cos(lagged), times * np.sin(lagged)], axis=1)
    return there, back
