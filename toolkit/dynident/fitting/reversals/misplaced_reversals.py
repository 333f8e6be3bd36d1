"""Reversals that are seen at another moment than they were.

Where dry friction turns round the acceleration jumps. Behind a low-pass of the positions the speed
then passes through zero at another moment, and between two samples friction that reverses within
one is no function of the mean speed. Rows around such a reversal have a wrong friction, by little;
but the same way at each, so that inertias and friction are biased by many of their standard
deviations where the noise is small. These rows of that joint do not count in a fit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.fitting.estimate import Estimate
from dynident.fitting.reversals.joint_speeds import JointSpeeds
from dynident.fitting.reversals.standing_joints import few_enough, resting, with_stops
from dynident.fitting.sampling import Sampled, sample
from dynident.recording import Dataset, Recording, lowpass, uniform
from dynident.tables import listed, percent

_AGAIN = 2.4
"""What a low-pass moves a reversal by, over what it moves it further if it is passed once more:
1 / (sqrt 2 - 1), as the variances of its response add up."""
_MATTERS = 3.0
"""Friction's error over the noise, root of the sum of squares over all rows, from which a joint's
reversals are left out. No parameter is off by more of its sigma than that: by a seventh of it, in
simulated arms."""
_ROW = 0.1
"""The same in one row, from which it is left out."""
_LEVELS = 2.0 ** np.arange(8)
"""Multiples of that which are tried, so that enough rows are left."""
_PADDED = 12
"""Samples that the low-pass needs at least."""
_ALIKE = 1e-3
"""Change of speed within a sample over the friction width, below which its mean is its middle."""


@dataclass(frozen=True, eq=False)
class _Friction:
    """Dry friction of n joints: of a level and a width each, N m or N, and rad/s or m/s."""

    level: np.ndarray
    width: np.ndarray

    def misplaced(self, sampled: Sampled) -> Iterator[np.ndarray]:
        """Yield its expected error in the rows that are used, (T, n) N m or N, part by part."""
        speeds, rate = JointSpeeds(sampled), sampled.recording.rate_hz
        cutoff = sampled.parallel.filter.position_cutoff_hz

        def error(v: np.ndarray) -> np.ndarray:
            direction = np.tanh(v / self.width)
            found = self._within_samples(v) - direction
            if cutoff and len(v) > _PADDED:
                found += _AGAIN * (direction - np.tanh(lowpass(v, rate, cutoff) / self.width))
            return self.level * found

        return speeds.passed(error)

    def _within_samples(self, v: np.ndarray) -> np.ndarray:
        """Mean direction over each sample's step, between the speeds in the middle of two."""
        middle = (v[:-1] + v[1:]) / 2.0
        begin, end = np.concatenate([v[:1], middle]), np.concatenate([middle, v[-1:]])
        change, alike = end - begin, np.abs(end - begin) < _ALIKE * self.width
        rise = self.width * (_log_cosh(end / self.width) - _log_cosh(begin / self.width))
        mean = np.divide(rise, change, out=np.zeros_like(v), where=~alike)
        return np.where(alike, np.tanh(v / self.width), mean)


def _log_cosh(x: np.ndarray) -> np.ndarray:
    """Logarithm of cosh x, and ln 2 more."""
    return np.logaddexp(x, -x)


def fitted_without(
    fit: Callable[[Dataset], Estimate], dataset: Dataset
) -> tuple[Estimate, Dataset]:
    """Return a fit in which misplaced reversals do not count, and the dataset without them.

    Parameters
    ----------
    fit : by least squares, which is asked twice where there are any.
    dataset : with them.
    """
    estimate = fit(dataset)
    counted = without_misplaced_reversals(estimate, dataset)
    return (estimate if counted is dataset else fit(counted)), counted


def without_misplaced_reversals(estimate: Estimate, dataset: Dataset) -> Dataset:
    """Return a dataset whose recordings say which rows around reversals do not count.

    Of joints whose dry friction filters and sampling misplace by more than the noise hides; where
    that takes too many of a joint's rows, those with the largest errors.

    Parameters
    ----------
    estimate : of the dataset, whose friction and noise count.
    dataset : what was fitted.

    Returns
    -------
    The same object where nothing is to be left out, or the filter keeps the ends.
    """
    friction = _friction_of(estimate)
    keeps = dataset.filter is not None and dataset.filter.ends == "keep"
    if keeps or not friction.level.any():
        return dataset
    recordings, std = [uniform(one) for one in dataset.recordings], estimate.torque_std
    limits = _LEVELS[:, None] * _ROW * std
    power, beyond, moving = np.zeros(len(std)), np.zeros_like(limits), np.zeros(len(std))
    for one in recordings:
        sampled = sample(one, dataset.filter)
        moving += np.sum(~resting(sampled), axis=0)
        for error in friction.misplaced(sampled):
            power += np.sum(error**2, axis=0)
            beyond += [np.sum(np.abs(error) > limit, axis=0) for limit in limits]
    chosen = np.argmax(beyond <= DEFAULTS.sticking.most * moving, axis=0)
    which = power > (_MATTERS * std) ** 2
    limit = np.where(which, limits[chosen, np.arange(len(std))], np.inf)
    masks = [
        np.concatenate([np.abs(error) > limit for error in friction.misplaced(sampled)])
        for sampled in (sample(one, dataset.filter) for one in recordings)
    ]
    rest = np.concatenate([resting(sample(one, dataset.filter)) for one in recordings])
    which &= few_enough(np.concatenate(masks), rest, DEFAULTS.sticking)
    if not which.any():
        return dataset
    pairs = zip(recordings, masks, strict=True)
    marked = [_marked(one, dataset, rows & which) for one, rows in pairs]
    return replace(dataset, recordings=tuple(marked))


def misplaced_note(dataset: Dataset, marked: Dataset) -> str:
    """Say of which joints rows around reversals do not count, and how many; empty for none.

    Parameters
    ----------
    dataset, marked : before and after `without_misplaced_reversals`.
    """
    if marked is dataset:
        return ""
    more = np.mean(
        np.concatenate(
            [
                sample(one, dataset.filter).counting & ~sample(other, dataset.filter).counting
                for one, other in zip(dataset.recordings, marked.recordings, strict=True)
            ]
        ),
        axis=0,
    )
    each = zip(marked.recordings[0].joints, more.tolist(), strict=True)
    shares = [f"{joint} ({percent(share, 0)} of its rows)" for joint, share in each if share > 0]
    if not shares:
        return ""
    return (
        f"Around reversals of {listed(shares)} the filter of the positions and the sampling put "
        "dry friction at another moment than it acts, by enough to bias the fit: these rows do not "
        "count in it."
    )


def _friction_of(estimate: Estimate) -> _Friction:
    model = estimate.model
    level = np.zeros(model.robot.n)
    for j, joint in enumerate(model.robot.names):
        place = model.slices.get(f"coulomb_friction@{joint}")
        if place is not None:
            level[j] = estimate.values[place.start]
    return _Friction(level, np.array(model.friction_widths, dtype=float))


def _marked(recording: Recording, dataset: Dataset, rows: np.ndarray) -> Recording:
    """A recording of which these rows (T, n) do not count, nor those that did not before."""
    sampled = sample(recording, dataset.filter)
    return with_stops(sampled, rows | ~sampled.counting)
