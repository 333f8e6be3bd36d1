"""The noise of a torque residual: its size, how it grows at low speed, and its colour.

Everything is measured on differences between replicates of the same motion, in which what the model
lacks cancels; never on the residual itself, which would explain the missing effect away as noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.lib.stride_tricks import as_strided
from scipy.linalg import solve_toeplitz

from dynident.criteria import NoiseCriteria
from dynident.moments.replicates import Kind

_AT_ONCE = 2**15
"""Samples of several signals that are whitened together."""


def differences(residual: np.ndarray, kind: Kind) -> np.ndarray:
    """Noise of one replicate, from the differences between replicates.

    Parameters
    ----------
    residual : (P, S)
        Residual of one joint in P replicates of the same motion.
    kind : Kind
        What the versions are; not "single", in which there is nothing to compare.

    Returns
    -------
    (P, S) or (P - 1, S), with the variance of the noise in one version.
    """
    if kind == "noise_augmented":
        return residual[1:] - residual[0]
    replicates = len(residual)
    return (residual - residual.mean(axis=0)) * np.sqrt(replicates / (replicates - 1))


def systematic_square(residual: np.ndarray, kind: Kind) -> float:
    """Mean square of what the versions of a residual (P, S) have in common, noise taken out."""
    if kind == "noise_augmented":
        return float(np.mean(residual[0] ** 2) - np.mean((residual[1:] - residual[0]) ** 2))
    replicates = len(residual)
    products = residual.sum(axis=0) ** 2 - (residual**2).sum(axis=0)
    return float(np.mean(products)) / (replicates * (replicates - 1))


@dataclass(frozen=True)
class NoiseModel:
    """Noise of one joint's torque residual.

    Attributes
    ----------
    std : N m or N, over all speeds.
    speeds : (B,) rad/s or m/s, absolute, at which `scales` are given.
    scales : (B,) local standard deviation over `std`.
    colour : (order + 1,) whitening filter, for noise divided by its local standard deviation.
    """

    std: float
    speeds: np.ndarray
    scales: np.ndarray
    colour: np.ndarray

    @property
    def is_flat(self) -> bool:
        """Whether it is white noise of one size: to whiten is then to divide by that."""
        return len(self.colour) == 1 and len(self.scales) == 1

    def weights(self, speed: np.ndarray) -> np.ndarray:
        """One over the local standard deviation, (T,), at a joint's velocity (T,)."""
        return 1.0 / (np.interp(np.abs(speed), self.speeds, self.scales) * self.std)

    def whiten(
        self, signals: np.ndarray, speed: np.ndarray, told: np.ndarray | None = None
    ) -> np.ndarray:
        """Give the noise in signals (T, k) of one recording unit variance and no colour.

        Parameters
        ----------
        signals : (T, k)
            In the order of time; the first rows, as many as the order, come out unreliable where
            all of them count.
        speed : (T,)
            Velocity of the joint, rad/s or m/s.
        told : (T,)
            Mask of the samples that count; None for all of them.

        Returns
        -------
        (T, k), zeros in samples that do not count.
        """
        told = None if told is None else told[None]
        return self.whitened([[[signals]]], self.weights(speed)[None], told)[0, 0].T

    def whitened(
        self,
        signals: Sequence[Sequence[Sequence[np.ndarray]]],
        weights: np.ndarray,
        told: np.ndarray | None = None,
    ) -> np.ndarray:
        """Whiten signals of several recordings, in several parts.

        Parameters
        ----------
        signals : for each of R recordings, for each of M replicates, parts (T, k) in the order of
            time.
        weights : (R, T) by which they are multiplied first, see `weights`.
        told : (R, T) mask of the samples that count; None for all of them.

        Returns
        -------
        (R, M, k of all, T), the samples of a signal side by side; zeros where they do not count.
        """
        if told is not None:
            weights = weights * told
        order, samples = len(self.colour) - 1, weights.shape[1]
        if order == 0:
            weights = weights * self.colour[0]
        columns = sum(part.shape[1] for part in signals[0][0])
        # Zeros before each signal: one correlation of many in a row mixes none with the next.
        scaled = np.empty((len(signals), len(signals[0]), columns, order + samples))
        scaled[..., :order] = 0.0
        for each, weight, here in zip(signals, weights, scaled, strict=True):
            for parts, rows in zip(each, here, strict=True):
                first = 0
                for part in parts:
                    last = first + part.shape[1]
                    np.multiply(part.T, weight, out=rows[first:last, order:])
                    first = last
        if order == 0:
            return scaled
        every = scaled.reshape(-1, order + samples)
        if 0 < every.size <= _AT_ONCE:
            white = self._correlated(every)
        else:
            white, some = np.empty((len(every), samples)), max(1, _AT_ONCE // max(1, samples))
            for first in range(0, len(every), some):
                last = first + some
                white[first:last] = self._correlated(every[first:last])
        found = white.reshape(*scaled.shape[:3], samples)
        if told is not None:
            found *= told[:, None, None]
            self._whiten_starts(scaled[..., order:], found, told)
        return found

    def _correlated(self, rows: np.ndarray) -> np.ndarray:
        """Signals (k, order + T) through the filter, (k, T)."""
        found = np.correlate(rows.ravel(), self.colour[::-1], "valid")
        shape = len(rows), rows.shape[1] - len(self.colour) + 1
        return as_strided(found, shape, (rows.strides[0], found.itemsize))

    def _whiten_starts(self, rows: np.ndarray, white: np.ndarray, told: np.ndarray) -> None:
        """Whiten samples before which fewer count than the order, each by those that do.

        The full filter would give the first sample after a gap its whole variance, and noise of a
        low frequency has many times that of its innovations: such samples would outweigh the rest.

        Parameters
        ----------
        rows, white : (R, M, k, T) weighted samples, and where they go.
        told : (R, T) mask of the samples that count.
        """
        order, samples = len(self._starts), told.shape[1]
        place = np.arange(samples)
        before = place - np.maximum.accumulate(np.where(told, -1, place), axis=1) - 1
        run, first = np.nonzero(told & (before == 0))
        after = np.arange(order)
        at = np.minimum(first[:, None] + after, samples - 1)
        each, where = np.nonzero(told[run[:, None], at] & (before[run[:, None], at] == after))
        signals = rows.shape[1:3]
        found = rows[run[:, None], :, :, at].reshape(len(run), order, signals[0] * signals[1])
        found = np.matmul(self._starts, found).reshape(len(run), order, *signals)
        white[run[each], :, :, at[each, where]] = found[each, where]

    @cached_property
    def _starts(self) -> np.ndarray:
        """What whitens the first samples after a gap, (order, order) and lower triangular.

        A row for each number of samples before, with the whitening filter of that order: each for
        innovations of variance one of the same noise. Durbin's recursion, backwards.
        """
        variance, order = 1.0 / self.colour[0] ** 2, len(self.colour) - 1
        predictor, found = self.colour / self.colour[0], np.zeros((order, order))
        for last in range(order, 0, -1):
            share = 1.0 - predictor[last] ** 2
            predictor = (predictor[:last] - predictor[last] * predictor[last:0:-1]) / share
            variance /= share
            found[last - 1, :last] = predictor[::-1] / np.sqrt(variance)
        return found


def flat_noise(std: float) -> NoiseModel:
    """White noise of the same size at all speeds: what is assumed where noise is unknown."""
    return NoiseModel(std, np.zeros(1), np.ones(1), np.array([1.0]))


@dataclass(frozen=True, eq=False)
class SpeedClasses:
    """Classes of a joint's speed, each with enough samples to tell how large the noise is in it.

    Attributes
    ----------
    speeds : (T,) rad/s or m/s, absolute, of each stretch of noise.
    centres : (C,) mean speed of each class.
    members : which samples of all stretches, one after the other, are in each class.
    """

    speeds: tuple[np.ndarray, ...]
    centres: np.ndarray
    members: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, speed: Sequence[np.ndarray], criteria: NoiseCriteria) -> SpeedClasses:
        """Sort samples by their speed.

        Parameters
        ----------
        speed : (T,) of each stretch, in the order of time.
        criteria : number of classes, and of samples in each.
        """
        speeds, count = tuple(np.abs(one) for one in speed), criteria.speed_bins
        every = np.concatenate([*speeds, np.zeros(0)])
        if not len(every):
            return cls(speeds, np.zeros(0), ())
        edges = np.quantile(every, np.linspace(0.0, 1.0, count + 1))
        bins = np.clip(np.searchsorted(edges, every, side="right") - 1, 0, count - 1)
        each = (np.flatnonzero(bins == b) for b in range(count))
        members = tuple(one for one in each if len(one) >= criteria.samples_per_bin)
        return cls(speeds, np.array([every[inside].mean() for inside in members]), members)


def measure_noise(
    noise: list[np.ndarray],
    classes: SpeedClasses,
    criteria: NoiseCriteria,
    misfit: float = 0.0,
) -> NoiseModel:
    """Describe the noise of one joint.

    While the model still misses much, a metric made for the noise alone would ask it to fit best
    where the noise is least. So what is missing counts as white noise on top, of no colour and
    the same at all speeds, until it is found.

    Parameters
    ----------
    noise : list of (T,)
        Stretches of noise in the order of time.
    classes : SpeedClasses
        Of the joint's velocity in them.
    criteria : NoiseCriteria
        Order, limits.
    misfit : N m or N
        Root mean square of the systematic residual.

    Returns
    -------
    Standard deviation, colour, and scale by classes of speed.
    """
    everything = np.concatenate(noise)
    std = float(np.sqrt(np.mean(everything**2)))
    if not std > 0:
        return flat_noise(misfit or 1.0)
    at, scales = classes.centres, [np.sqrt(np.mean(everything[m] ** 2)) for m in classes.members]
    if not scales:
        at, scales = np.zeros(1), [std]
    more = (misfit / std) ** 2
    within = np.clip(np.array(scales) / std, criteria.least_scale, criteria.largest_scale)
    limited = np.sqrt(within**2 + more)
    scaled = [
        stretch / (np.interp(v, at, limited) * std)
        for stretch, v in zip(noise, classes.speeds, strict=True)
    ]
    return NoiseModel(std, at, limited, _whitening_filter(scaled, more / (1.0 + more), criteria))


def _whitening_filter(
    stretches: list[np.ndarray], white: float, criteria: NoiseCriteria
) -> np.ndarray:
    """Yule-Walker autoregression over several stretches, scaled to innovations of variance one.

    `white` is the share of the variance that is added as white noise.
    """
    longest = max(len(stretch) for stretch in stretches)
    order = min(criteria.order, max(longest // 20, 0))
    total = sum(len(stretch) for stretch in stretches)
    correlation = _lagged_products(stretches, order) / total
    correlation[0] = correlation[0] * (1.0 + criteria.white_share) + white
    if order == 0:
        return np.array([1.0]) / np.sqrt(correlation[0])
    coefficients = solve_toeplitz(correlation[:-1], correlation[1:])
    innovation = correlation[0] - coefficients @ correlation[1:]
    return np.concatenate([[1.0], -coefficients]) / np.sqrt(max(innovation, 1e-12))


def inflation(noise: list[np.ndarray], criteria: NoiseCriteria, power: int = 1) -> float:
    """Variance of a mean of consecutive noise over that of independent noise.

    Parameters
    ----------
    noise : list of (T,)
        Stretches of noise of one joint, each in the order of time.
    criteria : NoiseCriteria
        Up to which lag correlations count.
    power : int
        2 for a mean of products of two such noises.

    Returns
    -------
    A factor, at least one.
    """
    total = sum(float(x @ x) for x in noise)
    if not total > 0:
        return 1.0
    correlations = _lagged_products(noise, criteria.lags)[1:] / total
    return max(1.0, 1.0 + 2.0 * float(np.sum(correlations**power)))


def _lagged_products(stretches: Sequence[np.ndarray], lags: int) -> np.ndarray:
    """Products of stretches (T,) with themselves so many samples later, summed, (lags + 1,)."""
    gap = np.zeros(lags)
    rows = np.concatenate([piece for one in stretches for piece in (one, gap)])
    return np.correlate(rows, rows[: len(rows) - lags], "valid")
