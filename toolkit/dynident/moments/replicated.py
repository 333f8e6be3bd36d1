"""Second moments from which noise has been taken out, and regression on them.

Squares of noisy columns are biased by the noise: least squares on them shrinks parameters and
gives false effects. Where a motion repeats, products of *different* repetitions are not biased:
the columns of one period are instruments for the others. All of the diagnosis is regression on
such moments, block of time by block of time:

    signal : sum over pairs of different repetitions, free of noise in the mean
    total  : sum of plain squares, signal and noise; it gives the variance of the answers
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from dynident.errors import FitError

Kind = Literal["repeated", "noise_augmented", "single"]
"""How the versions of a signal come about: repetitions of a period; the measured record followed
by copies to which the stated noise was added once more; or one record, of unknown noise."""

EXACT = 1e-9
"""Directions below this share of the largest (of columns scaled to norm 1) are dependent."""

RELIABLE = 0.05
"""Directions in which less than this share of the square is signal are noise, and left out."""


@dataclass(frozen=True)
class Moments:
    """Second moments of two sets of columns, per block of time, (B, a, b) each."""

    signal: np.ndarray
    total: np.ndarray

    def __add__(self, other: Moments) -> Moments:
        """Stack the blocks of both."""
        return Moments(
            np.concatenate([self.signal, other.signal]), np.concatenate([self.total, other.total])
        )

    def where(self, chosen: np.ndarray, other: np.ndarray) -> Moments:
        """Take other signal moments (B, a, b) where a mask (a, b) says so."""
        return Moments(np.where(chosen, other, self.signal), self.total)

    def without(self, block: int) -> tuple[np.ndarray, np.ndarray]:
        """Sums over all blocks but one."""
        return (
            self.signal.sum(axis=0) - self.signal[block],
            self.total.sum(axis=0) - self.total[block],
        )

    def sums(self) -> tuple[np.ndarray, np.ndarray]:
        """Sums over all blocks."""
        return self.signal.sum(axis=0), self.total.sum(axis=0)


def moments(left: np.ndarray, right: np.ndarray, edges: np.ndarray, kind: Kind) -> Moments:
    """Second moments of columns, of one recording.

    Parameters
    ----------
    left, right : (P, S, a) and (P, S, b)
        Columns at S instants in P versions.
    edges : (B + 1,)
        First instant of each block, and S.
    kind : Kind
        What the versions are.
    """
    signal, total = [], []
    for start, stop in pairwise(edges):
        one, two = left[:, start:stop], right[:, start:stop]
        if kind == "noise_augmented":
            plain = one[0].T @ two[0]
            noise = sum(
                (a - one[0]).T @ (b - two[0]) for a, b in zip(one[1:], two[1:], strict=True)
            ) / (len(one) - 1)
            signal.append(plain - noise)
        else:
            plain = one.reshape(-1, one.shape[2]).T @ two.reshape(-1, two.shape[2])
            if kind == "repeated":
                together = one.sum(axis=0).T @ two.sum(axis=0)
                signal.append((together - plain) / (len(one) - 1))
            else:
                signal.append(plain)
        total.append(plain)
    return Moments(np.array(signal), np.array(total))


def time_varying_moments(left: TimeVarying, right: TimeVarying, edges: np.ndarray) -> np.ndarray:
    """Signal moments of columns of which some depend on the time, (B, a, b).

    Such a column is another one in each repetition, and products of repetitions are not its
    square. Its instrument is the motion of the next repetition at the time of this one.
    """
    found = []
    for start, stop in pairwise(edges):
        one, two = left.columns[:, start:stop], right.columns[:, start:stop]
        for_one, for_two = left.instruments[:, start:stop], right.instruments[:, start:stop]
        there = np.einsum("psa,psb->ab", one, for_two, optimize=True)
        back = np.einsum("psa,psb->ab", for_one, two, optimize=True)
        # The torque has no instrument: what it holds of the time is its own.
        weight = np.where(left.is_torque, 0.0, 0.5)[:, None]
        weight = np.where(right.is_torque[None, :] & ~left.is_torque[:, None], 1.0, weight)
        found.append((1.0 - weight) * there + weight * back)
    return np.array(found)


@dataclass(frozen=True)
class TimeVarying:
    """Columns of a recording that repeats, with what the time of the session does to them.

    Attributes
    ----------
    columns : (P, S, k)
    clock : (P, S, k) factor of each that depends on the time; 1 where none does.
    is_torque : (k,) mask.
    """

    columns: np.ndarray
    clock: np.ndarray
    is_torque: np.ndarray

    @property
    def instruments(self) -> np.ndarray:
        """Columns of the next repetition's motion at this one's time, (P, S, k)."""
        after = np.roll(self.clock, -1, axis=0)
        sound = np.abs(after) > 1e-12 * np.abs(self.clock).max(axis=(0, 1))
        ratio = np.where(sound, self.clock / np.where(sound, after, 1.0), 1.0)
        return np.roll(self.columns, -1, axis=0) * ratio


@dataclass(frozen=True)
class MomentSolution:
    """Instrumental-variable regression on summed moments.

    Attributes
    ----------
    values : (p,) the minimum-norm solution in the directions that carry signal.
    basis : (p, r) these directions, orthonormal in the total moment.
    reliability : (r,) share of signal in each.
    """

    values: np.ndarray
    basis: np.ndarray
    reliability: np.ndarray

    @property
    def rank(self) -> int:
        """Number of directions that carry signal."""
        return self.basis.shape[1]

    def project(self, moment: np.ndarray) -> np.ndarray:
        """Coefficients of the regression on the columns, for any signal moment (p, k) with them."""
        return self.basis @ ((self.basis.T @ moment) / self.reliability[:, None])

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the values for residuals of variance one, (p, p)."""
        scaled = self.basis / self.reliability
        return scaled @ scaled.T


def solve(signal: np.ndarray, total: np.ndarray, moment: np.ndarray) -> MomentSolution:
    """Solve signal @ values = moment where the columns carry signal.

    Parameters
    ----------
    signal, total : (p, p)
        Signal and total moments of the columns.
    moment : (p,)
        Signal moment of the columns with the torque.
    """
    scale = np.sqrt(np.diag(total))
    scale = np.where(scale > 0, scale, 1.0)
    size, directions = np.linalg.eigh(total / np.outer(scale, scale))
    if not np.all(np.isfinite(size)):
        raise FitError("the columns of the model are not finite")
    keep = size > EXACT * max(float(size[-1]), 1e-300)
    white = directions[:, keep] / np.sqrt(size[keep]) / scale[:, None]
    reliability, turn = np.linalg.eigh(white.T @ signal @ white)
    good = reliability > RELIABLE
    basis = white @ turn[:, good]
    reliability = reliability[good]
    values = basis @ ((basis.T @ moment) / reliability)
    return MomentSolution(values, basis, reliability)
