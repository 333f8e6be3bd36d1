"""How a robot trembles under the noise of its encoders, from the torque that made it tremble.

Above the cut-off of the positions' low-pass, a robot is hardly more than its inertia: M(q) dv = u.
There u is what the drive made of the readings of the encoders. It made them causally and linearly,
and so it is what few of the last readings explain of the recorded torque; the rest is noise of the
record, which moved nothing. A torque that is held from sample to sample makes velocities that are
straight lines between samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from dynident.errors import SimulationError
from dynident.model import InertiaMatrices, Model
from dynident.moments.factors import factorise
from dynident.recording import Recording, lowpass

_READINGS = 8
"""Last readings that the drive's torque is explained by: PD laws with a delay, or with a filter on
the velocity, need no more."""
_CHANCE = 1e-4
"""Probability with which noise of a torque alone would follow readings as far as it does, below
which a drive has made it of them: divided by a small inertia, noise would be a large motion."""
_POSES = 50


@dataclass(frozen=True, eq=False, kw_only=True)
class Trembling:
    """Motion above a cut-off that the positions do not show for their noise.

    Attributes
    ----------
    q, v : (T, n) rad or m, and per s, at the samples of a recording.
    """

    q: np.ndarray
    v: np.ndarray

    def between(self, share: float) -> np.ndarray:
        """Velocities (T, n) after a share of the step to the next sample."""
        following = np.concatenate([self.v[1:], self.v[-1:]])
        return (1.0 - share) * self.v + share * following


def trembling(
    model: Model, values: np.ndarray, recording: Recording, cutoff_hz: float
) -> Trembling:
    """Return how the robot trembled above a cut-off.

    Parameters
    ----------
    model, values : (p,) whose inertia it is; with one that is not positive nothing trembles.
    recording : on a uniform clock, of T samples.
    cutoff_hz : of the positions' low-pass.
    """
    rate = recording.rate_hz
    torque = _fed_back(_above(recording.tau, rate, cutoff_hz), _above(recording.q, rate, cutoff_hz))
    piece = max(1, -(-recording.samples // _POSES))
    inertia = InertiaMatrices(model, recording.q[::piece])
    still = np.zeros_like(torque)
    try:
        inertia.require_positive(values)
    except SimulationError:
        return Trembling(q=still, v=still)
    which = np.arange(recording.samples) // piece
    a = np.linalg.solve(inertia.of(values)[which], torque[:, :, None])[:, :, 0] / rate
    v = _above(np.cumsum(a, axis=0) - a, rate, cutoff_hz)
    q = (v + a / 2) / rate
    return Trembling(q=_above(np.cumsum(q, axis=0) - q, rate, cutoff_hz), v=v)


def _above(x: np.ndarray, rate_hz: float, cutoff_hz: float) -> np.ndarray:
    return x - lowpass(x, rate_hz, cutoff_hz)


def _fed_back(torque: np.ndarray, readings: np.ndarray) -> np.ndarray:
    """What the last readings (T, n) explain of a torque (T, n), beyond what chance does."""
    count, n = readings.shape
    rows = np.zeros((_READINGS, n, count))
    for lag in range(min(_READINGS, count)):
        rows[lag, :, lag:] = readings[: count - lag].T
    rows = rows.reshape(-1, count)
    scale = np.linalg.norm(rows, axis=1, keepdims=True)
    rows /= np.where(scale > 0, scale, 1.0)
    # Least squares of the triangular factor, which has as few rows as there are columns.
    both = np.concatenate([rows, torque.T]).T[:, None]
    (factor,) = factorise([(both[:, :, :-1], both[:, :, -1])]).R
    size, rounding = len(rows), np.finfo(float).eps * max(rows.shape)
    found = np.linalg.lstsq(factor[:, :size], factor[:, size:], rcond=rounding)[0]
    explained = (found.T @ rows).T
    more, left = (np.sum(x**2, axis=0) for x in (explained, torque - explained))
    free = max(count - size, 1)
    by_chance = fdtrc(size, free, more / size / np.maximum(left / free, 1e-300)) > _CHANCE
    return np.where(by_chance, 0.0, explained)
