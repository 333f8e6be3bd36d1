"""What noise of a raw sample looks like in the rows of a regression: autocorrelations.

Rows behind a low-pass are not independent. Whatever the noise of the raw samples is, the filters
that it has passed are known: of its spectrum only the shape before them has to be measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from dynident.fitting.sampling import Sampled
from dynident.recording.derivatives import difference_gain
from dynident.recording.filters import butterworth
from dynident.recording.low_pass.sections import response

HALVING = (0.0, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
"""Of bands of constant density before the filters, as shares of the passband. They halve towards
zero, where motions are, and where torque noise that is not white has most of its power: with four
even bands 95 % intervals of six joints held 0.86 under noise with a corner of 3 Hz, with these
0.94; half or twice the lowest edge does as well (measured)."""
EVEN = (0.0, 1.0)
"""One band: what noise is that was white before the filters."""
_OPEN = 1e-3
"""Share of the power below which a filter counts as closed, and bands end."""
_GRID = 2048


def noise_shapes(sampled: Sampled, lags: int, edges: Sequence[float] = HALVING) -> np.ndarray:
    """Return autocorrelations that noise in rows may be made of, (S, lags + 1), each 1 at lag 0.

    White noise in bands of frequency, and the first and second difference of white noise of the
    encoders, all behind the recording's filters and decimation (folding included). Their sums with
    coefficients above zero are the autocorrelations considered.

    Parameters
    ----------
    sampled : a recording with its filters.
    lags : longest lag, in decimated rows.
    edges : of the bands, as shares of the passband, in ascending order.
    """
    parallel, rate = sampled.parallel, sampled.source.rate_hz
    limit = rate / 2
    while True:
        f = (np.arange(_GRID) + 0.5) / _GRID * limit
        power, encoder = filter_power(sampled, f)
        top = f[np.flatnonzero(power > _OPEN * power.max())[-1]]
        if top > limit / 64:
            break
        # A narrow passband needs a grid of its own, or bands in it would be empty.
        limit = 16 * top
    share = f / (top * (1 + 1e-9))
    spectra = [power * ((low <= share) & (share < high)) for low, high in pairwise(edges)]
    slope = difference_gain(2 * np.pi * f / rate, parallel.filter.order) ** 2
    spectra += [encoder * slope, encoder * slope**2]
    cosines = np.cos(2 * np.pi * np.outer(f / parallel.output_rate_hz, np.arange(lags + 1)))
    found = np.array(spectra) @ cosines
    return found / found[:, :1]


def filter_power(sampled: Sampled, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the power that a recording's filters let through, of torques and of positions.

    Parameters
    ----------
    sampled : a recording with its filters.
    f : (F,) Hz, at the full rate.

    Returns
    -------
    (F,) each; that of positions has the low-pass before differentiation in it
    """
    rate, power = sampled.source.rate_hz, np.ones(len(f))
    for sections, _ in sampled.parallel.stages:
        power *= _response(sections, f, rate) ** 4  # forward and backward
    cutoff = sampled.parallel.filter.position_cutoff_hz
    if cutoff is None:
        return power, power
    return power, power * _response(butterworth(rate, cutoff), f, rate) ** 4


def _response(sections: np.ndarray, f: np.ndarray, rate: float) -> np.ndarray:
    return np.abs(response(sections, 2 * np.pi * f / rate))
