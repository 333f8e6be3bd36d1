"""The noise behind an instrumental variable estimate, given or measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.fitting.instrumental.source import InstrumentSource
from dynident.fitting.sampling import Sampled, sample
from dynident.recording import Dataset, within

_DIFFERENCES = 3
_GAIN = 20.0
"""Variance of the third difference of white noise of variance 1."""
_EXCESS = 4.0
"""Standard deviations by which a residual's variance must exceed the encoders' share."""


@dataclass(frozen=True, eq=False)
class NoiseLevel:
    """White noise per raw sample.

    Attributes
    ----------
    position_std : (n,) rad or m.
    torque_std : (n,) N m or N.
    source : "given" or "measured".
    """

    position_std: np.ndarray
    torque_std: np.ndarray
    source: str


def white_variance(x: np.ndarray) -> np.ndarray:
    """Variance of the white noise in a smooth signal (T, n), from its third differences, (n,)."""
    rough = np.diff(x, _DIFFERENCES, axis=0)
    return np.sum(rough**2, axis=0) / (_GAIN * max(len(rough), 1))


def position_noise(source: InstrumentSource, instruments: Dataset) -> np.ndarray:
    """Measure the encoder's white noise, (n,) rad or m.

    In what the instruments leave of the measured positions: the motion that an imperfect model
    misses is smooth, and leaves next to nothing in its third differences.
    """
    squares, count = np.zeros(instruments.recordings[0].n), 0
    for one, other in zip(source.measured.recordings, instruments.recordings, strict=True):
        rows = within(one.t, *(one.window or (one.t[0], one.t[-1])), one.where)
        length = int(np.count_nonzero(rows))
        squares += length * white_variance((one.q - other.q)[rows])
        count += length
    return np.sqrt(squares / max(count, 1) / source.noise_share)


def torque_noise(
    measured: Dataset, variance: np.ndarray, expected: np.ndarray, counts: np.ndarray
) -> np.ndarray:
    """Return the white torque noise that accounts for what the encoders do not, (n,) N m or N.

    Parameters
    ----------
    measured : the recordings, whose filters pass the noise.
    variance : (n,) of the residual of each joint's rows.
    expected : (n,) that the encoders' noise accounts for.
    counts : (n,) rows.
    """
    excess = variance - expected
    sure = excess > _EXCESS * np.sqrt(2.0 / np.maximum(counts, 1)) * expected
    return np.sqrt(np.where(sure, np.maximum(excess, 0.0), 0.0) / _torque_gain(measured))


def _torque_gain(measured: Dataset) -> float:
    """Variance in a row of the regression per variance of white noise in the raw torque."""
    return float(np.mean([_gain(sample(one, measured.filter)) for one in measured.recordings]))


def _gain(sampled: Sampled) -> float:
    impulse = np.zeros((sampled.motion.samples, 1))
    middle = sampled.motion.samples // 2
    if sampled.recording.torque == "held_command":
        impulse[middle - 1 : middle + 1] = 0.5
    else:
        impulse[middle] = 1.0
    return float(np.sum(sampled.parallel.low_pass(impulse) ** 2))
