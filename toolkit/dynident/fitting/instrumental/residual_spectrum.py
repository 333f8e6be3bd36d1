"""The noise behind an instrumental variable estimate, measured in the spectrum of its residual.

In a closed loop the robot follows the noise of its own encoders: what the measured positions differ
by from a motion without noise, or from each other, is not that noise. In the residual of the
equation of motion the loop has no part: the torque that it made of the noise is recorded, and
moved the robot as it moves it. There the encoder's noise, differentiated twice, rises with the
fourth power of the frequency, and the torque's noise is flat: by that they are told apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.fitting.instrumental.torque_jacobians import torque_jacobians
from dynident.fitting.sampling import Sampled, sample
from dynident.fitting.uncertainty.noise_shapes import filter_power
from dynident.model import Model
from dynident.recording import Dataset, difference_gain, held_gain

_GROUPS = 300
"""Means of neighbouring frequencies of a recording that are fitted."""
_HANN = 1.94
"""Variance of a mean over a spectrum by a Hann window, over that of independent frequencies."""
_TRUSTED = 0.125
"""Share of the sampling rate up to which differences of a sampled motion match its held torques."""
_ROUNDS = 50
_FOLDS = 3
"""Multiples of the rows' rate from which noise is folded back."""
_SETTLED = 1e-6
_STEP = 0.3  # of a variance that the weights take, at least, from round to round
_ROUGH = 0.25
"""Relative standard error of the encoder's variance from third differences, in a loop that follows
its noise (measured: 0.03 to 0.2 too large with gains up to 200/s of velocity over inertia)."""
_AT_LEAST = 1e-8
"""Share of the largest variance below which a spectrum is rounding."""


@dataclass(frozen=True, eq=False, kw_only=True)
class NoiseVariances:
    """White noise per raw sample, as the spectrum of a residual tells it.

    Attributes
    ----------
    values : (2 n,) variances of the positions, rad^2 or m^2, and of the torques, (N m)^2 or N^2.
    std : (2 n,) their standard errors.
    """

    values: np.ndarray
    std: np.ndarray


def residual_noise(
    model: Model,
    values: np.ndarray,
    measured: Dataset,
    instruments: Dataset,
    position_std: np.ndarray,
    rank: int,
) -> NoiseVariances:
    """Fit the residual's spectrum by that of encoder and torque noise, by weighted least squares.

    The weights are those of P. Whittle, "Estimation and information in stationary time series",
    Ark. Mat. 2 (1953): a frequency counts by its own power.

    Parameters
    ----------
    model, values : (p,) the estimate.
    measured, instruments : recordings, and the same with motions without that noise.
    position_std : (n,) rough size of the encoder's noise, over which dry friction is a secant, and
        which holds where other noise hides a joint's.
    rank : number of parameters fitted; so many of the lowest frequencies have no freedom left.

    Returns
    -------
    Variances, which may come out negative, and their standard errors.
    """
    n = model.robot.n
    spectra, designs, freedom = [], [], []
    for one, other in zip(measured.recordings, instruments.recordings, strict=True):
        own, smooth = sample(one, measured.filter), sample(other, instruments.filter)
        columns = np.concatenate(list(own.columns(model, values)))
        f, power = _periodogram(own.counted(own.tau) - columns @ values, own.rate_hz)
        design = _seen_through(_design(model, values, own, smooth, f, position_std), own.counting)
        lost = -(-rank // (2 * n * len(measured.recordings))) + 1
        last = np.searchsorted(f, _TRUSTED * own.motion.rate_hz)
        cuts = np.unique(np.linspace(lost, max(last, lost + 2), _GROUPS + 1).astype(int))
        count = np.diff(cuts)[:, None]
        spectra.append(np.add.reduceat(power[: cuts[-1]], cuts[:-1], axis=0) / count)
        designs.append(np.add.reduceat(design[: cuts[-1]], cuts[:-1], axis=0) / count[:, :, None])
        freedom.append(np.broadcast_to(count / _HANN, spectra[-1].shape))
    y, A = np.concatenate(spectra).ravel(), np.concatenate(designs).reshape(-1, 2 * n)
    return _weighted(y, A, np.concatenate(freedom).ravel(), position_std**2)


def _seen_through(design: np.ndarray, counting: np.ndarray) -> np.ndarray:
    """Densities (F, n, 2 n) of what is zero in the rows that do not count, (T, n).

    Autocovariances are multiplied by the autocorrelation of the mask, over a circle.
    """
    if counting.all():
        return design
    count = len(counting)
    mask = np.fft.irfft(np.abs(np.fft.rfft(counting, axis=0)) ** 2, count, axis=0) / count
    covariance = np.fft.irfft(np.concatenate([design[:1], design]), count, axis=0)
    return np.fft.rfft(covariance * mask[:, :, None], axis=0).real[1:]


def _periodogram(residual: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (F,) above zero, and two-sided density (F, n) under a Hann window."""
    window = np.hanning(len(residual) + 2)[1:-1, None]
    found = np.abs(np.fft.rfft(residual * window, axis=0)) ** 2 / np.sum(window**2) / rate
    return np.fft.rfftfreq(len(residual), 1.0 / rate)[1:], found[1:]


def _design(
    model: Model,
    values: np.ndarray,
    own: Sampled,
    smooth: Sampled,
    f: np.ndarray,
    position_std: np.ndarray,
) -> np.ndarray:
    """Density of each joint's residual that a unit of each variance makes, (F, n, 2 n)."""
    n, rate, out = model.robot.n, own.motion.rate_hz, own.rate_hz
    order = own.parallel.filter.order
    every = slice(None, None, max(1, smooth.motion.samples // 2000))
    block = model.with_regressor(smooth.block(model, every))
    found = torque_jacobians(model, values, block, position_std * rate)
    squares = [np.mean(x**2, axis=0) for x in (found.by_q, found.by_v, found.by_a)]
    design = np.zeros((len(f), n, 2 * n))
    for fold in range(-_FOLDS, _FOLDS + 1):
        raw = np.abs(f + fold * out)
        torque, encoder = filter_power(own, raw)
        angle = 2 * np.pi * raw / rate
        slope = (rate * difference_gain(angle, order)) ** 2
        if own.recording.torque == "held_command":
            torque = torque * held_gain(angle, order) ** 2
        inside = (raw <= rate / 2) / rate
        for j in range(n):
            design[:, j, n + j] += inside * torque
            for i, square in enumerate(squares):
                design[:, :, j] += (inside * encoder * slope**i)[:, None] * square[:, j]
    return design


def _weighted(
    y: np.ndarray, A: np.ndarray, freedom: np.ndarray, positions: np.ndarray
) -> NoiseVariances:
    """Solve for the variances, those of the positions near to what is known roughly."""
    n = len(positions)
    scale = y.max(initial=0.0) / np.maximum(A.max(axis=0), np.finfo(float).tiny)
    A, rough = A * scale, positions / scale[:n]
    prior = np.zeros(2 * n)
    prior[:n] = 1.0 / np.maximum(_ROUGH * rough, np.finfo(float).eps) ** 2
    pulled = prior * np.append(rough, np.zeros(n))
    x = np.append(rough, np.full(n, 1.0 / n))
    at = x
    for _ in range(_ROUNDS):
        # The weights want a power above zero, and go towards it step by step.
        power = A @ at
        weight = freedom / np.maximum(power, _AT_LEAST * power.max()) ** 2
        information = A.T @ (weight[:, None] * A) + np.diag(prior)
        size = np.sqrt(np.diag(information))
        new = np.linalg.solve(
            information / np.outer(size, size), (A.T @ (weight * y) + pulled) / size
        )
        change = np.linalg.norm(np.maximum(new / size, _STEP * at) - at)
        x = new / size
        at = np.maximum(x, _STEP * at)
        if change <= _SETTLED * np.linalg.norm(at):
            break
    inverse = np.linalg.inv(information / np.outer(size, size))
    return NoiseVariances(values=x * scale, std=np.sqrt(np.diag(inverse)) / size * scale)
