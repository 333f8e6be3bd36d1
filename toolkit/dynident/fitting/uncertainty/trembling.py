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
from numpy.lib.stride_tricks import sliding_window_view
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
_BLOCK = 2048  # samples whose last readings are written out at a time


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
    # All samples near a pose at once; the last one may have fewer.
    count, n = torque.shape
    near = np.zeros((-(-count // piece), piece, n))
    near.reshape(-1, n)[:count] = torque
    moved = np.linalg.solve(inertia.of(values), near.transpose(0, 2, 1)).transpose(0, 2, 1)
    a = moved.reshape(-1, n)[:count] / rate
    v = _above(np.cumsum(a, axis=0) - a, rate, cutoff_hz)
    q = (v + a / 2) / rate
    return Trembling(q=_above(np.cumsum(q, axis=0) - q, rate, cutoff_hz), v=v)


def _above(x: np.ndarray, rate_hz: float, cutoff_hz: float) -> np.ndarray:
    return x - lowpass(x, rate_hz, cutoff_hz)


def _fed_back(torque: np.ndarray, readings: np.ndarray) -> np.ndarray:
    """What the last readings (T, n) explain of a torque (T, n), beyond what chance does."""
    count, n = readings.shape
    size, rounding = _READINGS * n, np.finfo(float).eps * max(count, _READINGS * n)
    length = np.linalg.norm(readings, axis=0)
    padded = np.zeros((count + _READINGS - 1, n))
    padded[_READINGS - 1 :] = readings / np.where(length > 0, length, 1.0)
    # A view: written out it would be eight times the readings.
    last = sliding_window_view(padded, _READINGS, axis=0)
    blocks = [slice(start, start + _BLOCK) for start in range(0, count, _BLOCK)]
    # Least squares of the triangular factor, which has as few rows as there are columns.
    both = (np.hstack([last[rows].reshape(-1, size), torque[rows]])[:, None] for rows in blocks)
    (factor,) = factorise((one[:, :, :-1], one[:, :, -1]) for one in both).R
    found = np.linalg.lstsq(factor[:, :size], factor[:, size:], rcond=rounding)[0]
    explained = np.concatenate([last[rows].reshape(-1, size) @ found for rows in blocks])
    more, left = (np.sum(x**2, axis=0) for x in (explained, torque - explained))
    free = max(count - size, 1)
    by_chance = fdtrc(size, free, more / size / np.maximum(left / free, 1e-300)) > _CHANCE
    return np.where(by_chance, 0.0, explained)
