"""The noise behind an instrumental variable estimate, given or measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.fitting.instrumental.residual_spectrum import NoiseVariances
from dynident.fitting.instrumental.source import InstrumentSource
from dynident.recording import Dataset, within
from dynident.recording.white_noise import white_variance

_NEGATIVE = 3.0
"""Standard errors below zero at which a variance is none: what is there is no such noise."""


@dataclass(frozen=True, eq=False)
class NoiseLevel:
    """White noise per raw sample.

    Attributes
    ----------
    position_std : (n,) rad or m.
    torque_std : (n,) N m or N.
    source : "given" or "measured".
    doubt : why the residual is not noise of these two kinds; empty where it may be.
    """

    position_std: np.ndarray
    torque_std: np.ndarray
    source: str
    doubt: str = ""


def position_noise(source: InstrumentSource, instruments: Dataset) -> np.ndarray:
    """Measure the encoder's white noise roughly, (n,) rad or m.

    In what the instruments leave of the measured positions: the motion that an imperfect model
    misses is smooth, and leaves next to nothing in its third differences. In a closed loop the
    robot follows its encoders, and this comes out a few percent too large.
    """
    squares, count = np.zeros(instruments.recordings[0].n), 0
    for one, other in zip(source.measured.recordings, instruments.recordings, strict=True):
        rows = within(one.t, *(one.window or (one.t[0], one.t[-1])), one.where)
        length = int(np.count_nonzero(rows))
        squares += length * white_variance((one.q - other.q)[rows])
        count += length
    return np.sqrt(squares / max(count, 1) / source.noise_share)


def noise_level(joints: tuple[str, ...], found: NoiseVariances) -> NoiseLevel:
    """Return standard deviations for measured variances.

    A variance that is zero or less within its standard error is taken as large as that error: so
    much of it may be there. One that is negative beyond it is no variance, and is said.

    Parameters
    ----------
    joints : n names.
    found : in the spectrum of the residual.
    """
    n = len(joints)
    std = np.sqrt(np.maximum(found.values, found.std))
    bad = np.flatnonzero(found.values < -_NEGATIVE * found.std)
    names = [f"{('torque', 'encoder')[int(k < n)]} of {joints[k % n]}" for k in bad]
    doubt = ""
    if names:
        doubt = (
            "the spectrum of the residual is not that of white noise of encoders and torque: the "
            f"variance comes out negative at the {', the '.join(names)}"
        )
    return NoiseLevel(std[:n], std[n:], "measured", doubt)
