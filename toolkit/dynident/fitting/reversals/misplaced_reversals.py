"""Reversals that are seen at another moment than they were.

Where dry friction turns round the acceleration jumps. Behind a low-pass of the positions the speed
then passes through zero at another moment, and between two samples friction that reverses within
one is no function of the mean speed. Rows around such a reversal have a wrong friction, by little;
but the same way at each, so that inertias and friction are biased by many of their standard
deviations where the noise is small. These rows of that joint do not count in a fit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.fitting.estimate import Estimate
from dynident.fitting.reversals.joint_speeds import JointSpeeds
from dynident.fitting.reversals.standing_joints import few_enough, resting, with_stops
from dynident.fitting.sampling import Sampled, sample
from dynident.model import coulomb_levels
from dynident.recording import Dataset, Recording, lowpass, uniform
from dynident.tables import listed, number, percent

_AGAIN = 2.4
"""What a low-pass moves a reversal by, over what it moves it further if it is passed once more:
1 / (sqrt 2 - 1), as the variances of its response add up."""
_MATTERS = 3.0
"""Friction's error over the noise, root of the sum of squares over all rows, from which a joint's
reversals are left out, and from which an estimate says that they bias it. No parameter is off by
more of its sigma than that; by a seventh of it, in simulated arms."""
_ROW = 0.1
"""The same in one row, from which it is left out."""
_FINE, _OCTAVES = 4, 40
"""Parts of an octave to which the error is counted, and how many octaves above `_ROW`."""
_AROUND, _PADDED = 3.0, 12
"""Periods of the cut-off, on either side of a part, that show in the low-pass of its speeds by more
than a thousandth; and samples that it needs at least."""
_ALIKE = 1e-3
"""Change of speed within a sample over the friction width, below which its mean is its middle."""
_FAST = 12.0
"""Speed over the width, above which friction has turned to a billionth."""


@dataclass(frozen=True, eq=False)
class _Friction:
    """Dry friction of n joints, by Coulomb friction alone.

    Attributes
    ----------
    level, width : (n,) N m or N, and rad/s or m/s.
    """

    level: np.ndarray
    width: np.ndarray

    @classmethod
    def of(cls, estimate: Estimate) -> _Friction:
        """Return what an estimate says of it; a level of zero where it says nothing."""
        level = coulomb_levels(estimate.model, estimate.values)
        return cls(level, np.array(estimate.model.friction_widths, dtype=float))

    def misplaced(self, sampled: Sampled) -> Iterator[np.ndarray]:
        """Yield its expected error in the rows that are used, (T, n) N m or N, part by part."""
        rate, cutoff = sampled.recording.rate_hz, sampled.parallel.filter.position_cutoff_hz
        some = np.flatnonzero(self.level)

        def error(speeds: np.ndarray) -> np.ndarray:
            found = np.zeros_like(speeds)
            again = cutoff and len(speeds) > _PADDED
            for j in some:
                v, width = speeds[:, j], self.width[j]
                seen = lowpass(v[:, None], rate, cutoff)[:, 0] if cutoff and again else v
                off = within_samples(v, width) + _AGAIN * (turned(v, width) - turned(seen, width))
                found[:, j] = self.level[j] * off
            return found

        around = ceil(_AROUND * rate / cutoff) if cutoff else 1
        return JointSpeeds(sampled).passed(error, around)


def turned(v: np.ndarray, width: float) -> np.ndarray:
    """Return the direction of dry friction at speeds (T,), rad/s or m/s."""
    return np.tanh(v / width)


def within_samples(v: np.ndarray, width: float) -> np.ndarray:
    """Return what the mean direction over each sample's step has more than that of its speed.

    Parameters
    ----------
    v : (T,) speeds; between the middles of two steps they change steadily.
    width : of the friction.
    """
    middle = (v[:-1] + v[1:]) / 2.0
    begin, end = np.concatenate([v[:1], middle]), np.concatenate([middle, v[-1:]])
    change, found = end - begin, np.zeros_like(v)
    slow = np.abs(v) < _FAST * width + np.abs(change)
    slow &= np.abs(change) > _ALIKE * width
    begin, end, change = begin[slow], end[slow], change[slow]
    rise = width * (_log_cosh(end / width) - _log_cosh(begin / width))
    found[slow] = rise / change - turned(v[slow], width)
    return found


def _log_cosh(x: np.ndarray) -> np.ndarray:
    """Logarithm of cosh x, and ln 2 more."""
    return np.logaddexp(x, -x)


def fitted_without(
    fit: Callable[[Dataset], Estimate], dataset: Dataset
) -> tuple[Estimate, Dataset]:
    """Return a fit in which misplaced reversals do not count, and the dataset without them.

    Parameters
    ----------
    fit : that is asked twice where there are any.
    dataset : with them.

    Returns
    -------
    The estimate says so where what is left of them still biases it.
    """
    estimate = fit(dataset)
    counted = without_misplaced_reversals(estimate, dataset)
    if counted is dataset:
        return estimate, dataset
    estimate = fit(counted)
    headlines = (estimate.headline, _still_misplaced(estimate, counted))
    return replace(estimate, headline=" ".join(filter(None, headlines))), counted


def without_misplaced_reversals(estimate: Estimate, dataset: Dataset) -> Dataset:
    """Return a dataset whose recordings say which rows around reversals do not count.

    Of joints whose dry friction filters and sampling misplace by more than the noise hides; where
    that takes too many of a joint's rows, those with the largest errors.

    Parameters
    ----------
    estimate : of the same robot, whose friction and noise count.
    dataset : what was fitted, or is to be judged.

    Returns
    -------
    The same object where nothing is to be left out, or the filter keeps the ends.
    """
    friction, std = _Friction.of(estimate), estimate.torque_std
    keeps = dataset.filter is not None and dataset.filter.ends == "keep"
    if keeps or not friction.level.any():
        return dataset
    recordings = tuple(uniform(one) for one in dataset.recordings)
    least = np.where(std > 0, _ROW * std, np.inf)
    errors = _counted(friction, recordings, dataset)
    power, octaves = _spread(errors, least)
    which = (power > (_MATTERS * std) ** 2) & (std > 0)
    if not which.any():
        return dataset
    rest = np.concatenate([resting(sample(one, dataset.filter)) for one in recordings])
    limit = least * _limits(octaves, DEFAULTS.sticking.most * np.sum(~rest, axis=0))
    masks = []
    for one in recordings:
        parts = [np.abs(error) > limit for error in _counted(friction, [one], dataset)]
        masks.append(np.concatenate(parts) & which)
    which &= few_enough(np.concatenate(masks), rest, DEFAULTS.sticking)
    pairs = zip(recordings, masks, strict=True)
    marked = [_marked(sample(one, dataset.filter), rows & which) for one, rows in pairs]
    return replace(dataset, recordings=tuple(marked)) if which.any() else dataset


def misplaced_note(dataset: Dataset, marked: Dataset, so: str) -> str:
    """Say of which joints reversals are misplaced, and in how many rows; empty for none.

    Parameters
    ----------
    dataset, marked : before and after `without_misplaced_reversals`.
    so : what follows from it, a clause.

    Returns
    -------
    A sentence.
    """
    if marked is dataset:
        return ""
    pairs = zip(dataset.recordings, marked.recordings, strict=True)
    more = [
        sample(one, dataset.filter).counting & ~sample(other, dataset.filter).counting
        for one, other in pairs
    ]
    each = zip(marked.recordings[0].joints, np.concatenate(more).mean(axis=0).tolist(), strict=True)
    shares = [f"{joint} ({percent(share, 1)} of its rows)" for joint, share in each if share > 0]
    if not shares:
        return ""
    return (
        f"Around reversals of {listed(shares)} the filter of the positions and the sampling put "
        f"dry friction at another moment than it acts, which {so}."
    )


def _still_misplaced(estimate: Estimate, dataset: Dataset) -> str:
    """What is to be read before any number: reversals bias the estimate even so; empty if not."""
    friction, std = _Friction.of(estimate), estimate.torque_std
    recordings = tuple(uniform(one) for one in dataset.recordings)
    power = sum(np.sum(error**2, axis=0) for error in _counted(friction, recordings, dataset))
    rows = sum(np.sum(sample(one, dataset.filter).counting, axis=0) for one in recordings)
    worse = np.flatnonzero(power > (_MATTERS * std) ** 2)
    if not len(worse):
        return ""
    robot, off = estimate.model.robot, np.sqrt(power / np.maximum(rows, 1))
    parts = [
        f"{number(float(off[j]), 2)} {robot.torque_units[j]} at {robot.names[j]} "
        f"(residual {number(float(std[j]), 2)})"
        for j in worse
    ]
    return (
        "Dry friction that reverses within a few samples is not known as well as the noise is "
        f"small, though the worst rows are left out: about {listed(parts)}. sigma does not hold "
        "that, and gives no 95 % intervals: record at a higher rate, or more slowly."
    )


def _counted(
    friction: _Friction, recordings: Iterable[Recording], dataset: Dataset
) -> Iterator[np.ndarray]:
    """Yield friction's error in the rows of recordings, (T, n), zero in those that do not count."""
    for one in recordings:
        sampled, first = sample(one, dataset.filter), 0
        for error in friction.misplaced(sampled):
            yield np.where(sampled.counting[first : first + len(error)], error, 0.0)
            first += len(error)


def _spread(errors: Iterable[np.ndarray], least: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sum of squares of errors (T, n), and how many lie in each part of an octave above `least`.

    Parameters
    ----------
    errors : part by part.
    least : (n,) error from which they are counted.

    Returns
    -------
    (n,) and (n, `_OCTAVES` * `_FINE`).
    """
    places = _OCTAVES * _FINE
    power, octaves = np.zeros(len(least)), np.zeros((len(least), places), dtype=int)
    for error in errors:
        power += np.sum(error**2, axis=0)
        for j, found in enumerate(np.abs(error).T):
            high = found[found > least[j]] / least[j]
            octave = np.minimum(_FINE * np.log2(high), places - 1)
            octaves[j] += np.bincount(octave.astype(int), minlength=places)
    return power, octaves


def _limits(octaves: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Error over the least, above which no more rows lie than may be left out, (n,)."""
    above = np.cumsum(octaves[:, ::-1], axis=1)[:, ::-1]
    return 2.0 ** (np.argmax(above <= most[:, None], axis=1) / _FINE)


def _marked(sampled: Sampled, rows: np.ndarray) -> Recording:
    """A recording of which these rows (T, n) do not count, nor those that did not before."""
    return with_stops(sampled, rows | ~sampled.counting)
