"""Central differences, and the torque that a held command makes, to an order of accuracy.

Differences of second order fall short of a derivative by (w h)^2 / 6 at the angular frequency w and
the step h: at 2 Hz and 100 samples a second accelerations are 0.5 % too small, and inertias as much
too large. The mean of the commands on both sides of a sample falls short of what a held command
does by (w h)^2 / 12.
"""

from __future__ import annotations

from functools import lru_cache
from math import factorial

import numpy as np
from scipy.ndimage import correlate1d

ORDERS = (2, 4, 6, 8)
"""Of accuracy: a difference of order 2 m sees m samples on either side."""


def central_difference(x: np.ndarray, rate_hz: float, order: int = 2) -> np.ndarray:
    """Derivative along axis 0 by central differences.

    Near the two ends of as high an order as they permit; one-sided in the first and the last row.

    Parameters
    ----------
    x : (T, ...), at least 2 rows.
    rate_hz : sampling rate.
    order : of accuracy, of `ORDERS`.

    Returns
    -------
    (T, ...), per s.

    Notes
    -----
    The weights are those of B. Fornberg, "Generation of finite difference formulas on arbitrarily
    spaced grids", Mathematics of Computation 51 (1988).
    """
    half, rows = order // 2, len(x)
    found = np.empty(x.shape)
    correlate1d(x, rate_hz * _difference_weights(half), axis=0, output=found, mode="nearest")
    for k in range(1, min(half, (rows + 1) // 2)):
        weights = rate_hz * _difference_weights(k)
        found[k] = _weighted(weights, x[: 2 * k + 1])
        found[-1 - k] = _weighted(weights, x[rows - 2 * k - 1 :])
    found[0], found[-1] = (x[1] - x[0]) * rate_hz, (x[-1] - x[-2]) * rate_hz
    return found


def difference_gain(angle: np.ndarray, order: int) -> np.ndarray:
    """Return the derivative over the signal, times the step: the angle itself, were it exact.

    Parameters
    ----------
    angle : rad per sample.
    order : of accuracy.
    """
    half = order // 2
    weights = _difference_weights(half)[half + 1 :]
    return 2.0 * np.sin(np.multiply.outer(angle, np.arange(1, half + 1))) @ weights


def held_torque(command: np.ndarray, order: int = 2) -> np.ndarray:
    """Return the torque (T, ...) at the samples of commands that are held until the next one.

    The mean over the step before a sample of the polynomial through the commands around it: what
    of a held command is slow. Near the ends of as high an order as they permit; the first is held.

    Parameters
    ----------
    command : (T, ...), of sample k from there until sample k + 1.
    order : of accuracy: 2 is the mean of both sides.
    """
    half, rows = order // 2, len(command)
    found = np.empty(command.shape)
    correlate1d(command, _held_weights(half), axis=0, output=found, mode="nearest")
    for k in range(1, min(half, (rows + 1) // 2)):
        found[k] = _weighted(_held_weights(k), command[: 2 * k])
        found[-k] = _weighted(_held_weights(k), command[rows - 2 * k :])
    found[0] = command[0]
    return found


def held_torque_adjoint(x: np.ndarray, order: int) -> np.ndarray:
    """Return what each command adds to a weighted sum of torques, (T, ...).

    Parameters
    ----------
    x : (T, ...) weights of the torques, zero where those near the ends are not used.
    order : of `held_torque`.
    """
    weights = _held_weights(order // 2)
    return correlate1d(x, weights, axis=0, mode="constant", origin=-1)


def held_gain(angle: np.ndarray, order: int) -> np.ndarray:
    """Return the size of `held_torque` over that of the commands.

    Parameters
    ----------
    angle : rad per sample.
    order : of accuracy.
    """
    half = order // 2
    steps = np.arange(half) + 0.5
    return 2.0 * np.cos(np.multiply.outer(angle, steps)) @ _held_weights(half)[half:]


def _weighted(weights: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Weighted sum over axis 0, as `np.tensordot`, which of few rows is mostly overhead."""
    return np.dot(weights[None], x.reshape(len(x), -1)).reshape(x.shape[1:])


@lru_cache
def _difference_weights(half: int) -> np.ndarray:
    """Weights of the samples from `half` before to `half` after, times the step."""
    weights = np.zeros(2 * half + 1)
    for k in range(1, half + 1):
        size = factorial(half) ** 2 / (k * factorial(half - k) * factorial(half + k))
        weights[half + k] = -size if k % 2 == 0 else size
        weights[half - k] = -weights[half + k]
    return weights


@lru_cache
def _held_weights(half: int) -> np.ndarray:
    """Weights of the commands from `half` before to `half - 1` after a sample.

    In half steps commands stand at odd numbers around the middle of the step before the sample,
    over which the mean of an even power 2 i is 1 / (2 i + 1).
    """
    powers, odd = np.arange(half), 2.0 * np.arange(half) + 1.0
    side = np.linalg.solve(2.0 * odd ** (2 * powers[:, None]), 1.0 / (2 * powers + 1))
    return np.concatenate([side[::-1], side])
