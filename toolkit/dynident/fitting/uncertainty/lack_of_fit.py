"""Whether a model is rejected by what repetitions of a motion say of the noise.

What repetitions of a motion have in common is no noise. Where a residual has more of that than
chance gives it, the model lacks something, and intervals that hold noise alone are too narrow.

Source: the test for lack of fit by replication, N. R. Draper and H. Smith, "Applied Regression
Analysis" (1998), section 2.1, with the correlation of consecutive rows accounted for.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np

from dynident.clusters import over_recordings
from dynident.errors import RecordingError
from dynident.fitting.linear_solution import LinearSolution
from dynident.fitting.sampling import sample
from dynident.fitting.uncertainty.cluster_sandwich import BlockScores, time_blocks
from dynident.fitting.uncertainty.encoder_steps import rounding_power
from dynident.model import Model
from dynident.moments.repetition_drift import Drift, DriftSums, drift_in_words
from dynident.recording import (
    Dataset,
    Filter,
    Recording,
    as_points,
    periods,
    require_repetition,
    turning_round,
)
from dynident.tables import number

_REJECTED = 4.0
"""Standard deviations under the noise alone above which a joint's residual is systematic. Measured:
3.5 is the largest of 600 joints to which nothing was missing."""
_LAGS = 20  # rows up to which noise is correlated


@dataclass(frozen=True, eq=False, kw_only=True)
class LackOfFit:
    """What repetitions say of a residual.

    Attributes
    ----------
    joints, units : n names, and units of their torques.
    systematic : (n,) root mean square of what repetitions have in common, N m or N.
    noise : (n,) standard deviation of what they have not.
    excess : (n,) mean square of the former in standard deviations under the noise alone.
    steps : (n,) root mean square of what encoders' steps leave at most, the same in every
        repetition, N m or N; looked at where more than noise is there.
    beyond_steps : (n,) as `excess`, of what is more than the steps leave.
    drifts : what grows with the distance in time of repetitions, and counts as noise.
    """

    joints: tuple[str, ...]
    units: tuple[str, ...]
    systematic: np.ndarray
    noise: np.ndarray
    excess: np.ndarray
    steps: np.ndarray
    beyond_steps: np.ndarray
    drifts: tuple[Drift, ...] = ()

    @property
    def beyond_noise(self) -> bool:
        """Whether repetitions have more in common than noise leaves, beyond doubt."""
        return bool(np.any(self.excess > _REJECTED))

    @property
    def rejected(self) -> bool:
        """Whether the model lacks something, beyond doubt."""
        return bool(np.any(self.beyond_steps > _REJECTED))

    @property
    def headline(self) -> str:
        """What is to be read before any number; empty where nothing speaks against the model."""
        drifting = drift_in_words(self.drifts)
        if drifting:
            drifting += " Parameters are of a mean over it. `dynident explain` looks for its cause."
        return " ".join(filter(None, (self._rejection, drifting)))

    @property
    def _rejection(self) -> str:
        """What repetitions have in common that speaks against the model; empty for nothing."""
        if not self.beyond_noise:
            return ""
        said = self._at(self.beyond_steps if self.rejected else self.excess)
        if not self.rejected:
            return (
                "What the repetitions of the motion have in common in the residual is no noise, "
                f"{said}. The steps of the encoders, which repeat with it, may leave as much, or "
                "the model lacks something: parameters may be off by more than sigma says. "
                "`dynident explain` looks for what is missing."
            )
        return (
            "The model is rejected by the repetitions of its motion: what they have in common in "
            f"the residual is no noise, {said}. Parameters may be off by more than sigma says. "
            "What is missing, or whether dry friction only reverses over another width than is "
            "stated, `dynident explain` tells."
        )

    def _at(self, excess: np.ndarray) -> str:
        """What is in common at joints at which it is too much, and what may be a part of it."""
        parts = []
        for j in np.flatnonzero(excess > _REJECTED).tolist():
            own, noise, steps = (
                number(one[j], 2) for one in (self.systematic, self.noise, self.steps)
            )
            more = f", steps of encoders up to {steps}" if self.steps[j] > 0 else ""
            parts.append(f"{own} {self.units[j]} at {self.joints[j]} (noise {noise}{more})")
        return ", ".join(parts)


def lack_of_fit(model: Model, dataset: Dataset, values: np.ndarray) -> LackOfFit | None:
    """Compare what repetitions have in common with what they have not.

    Parameters
    ----------
    model, values : (p,) the estimate.
    dataset : what was fitted.

    Returns
    -------
    The comparison; None where no recording repeats often enough.

    Raises
    ------
    RecordingError
        If the positions do not repeat with a recording's period.
    """
    if not any(recording.period for recording in dataset.recordings):
        return None
    passes = [*over_recordings(dataset.recordings, _of_recording, model, dataset.filter, values)]
    found = [one for one in passes if one is not None]
    if not found:
        return None
    sums = zip(*(one for one, _ in found), strict=True)
    systematic, noise, spread, rows = (np.sum(one, axis=0) for one in sums)
    drift = [one for _, one in found if one is not None]
    names, units = model.robot.names, model.robot.torque_units
    scale = np.sqrt(np.maximum(spread, np.finfo(float).tiny))
    judged = LackOfFit(
        joints=names,
        units=units,
        systematic=np.sqrt(np.maximum(systematic / rows, 0.0)),
        noise=np.sqrt(noise / rows),
        excess=systematic / scale,
        steps=np.zeros(model.robot.n),
        beyond_steps=systematic / scale,
        drifts=reduce(add, drift).drifts(names, units) if drift else (),
    )
    if not judged.beyond_noise:
        return judged
    pairs = zip(dataset.recordings, passes, strict=True)
    periodic = tuple(recording for recording, one in pairs if one is not None)
    counting = [(one.t, one.counting) for one in (sample(r, dataset.filter) for r in periodic)]
    repeated = replace(dataset, recordings=periodic)
    power = rounding_power(model, values, repeated, judged=counting)
    beyond = (systematic - rows * power) / scale
    return replace(judged, steps=np.sqrt(power), beyond_steps=beyond)


def _of_recording(
    recording: Recording, model: Model, settings: Filter | None, values: np.ndarray
) -> tuple[tuple[np.ndarray, ...], DriftSums | None] | None:
    """What `_apart` says of a recording, and what drifts; None where it does not repeat."""
    if not recording.period:
        return None
    sampled, folded = sample(recording, settings), None
    left = np.concatenate([one for one, _ in sampled.residuals(model, values)])
    # Less than two periods tell nothing, and are no mistake here.
    with suppress(RecordingError):
        folded = periods(len(left), sampled.rate_hz, recording.period, recording.where)
    if folded is None:
        return None
    even = sampled.recording
    positions = even.q[np.searchsorted(even.t, sampled.t)]
    points = as_points(positions, turning_round(even))
    require_repetition(points, folded, recording.where)
    each, counting = folded.fold(left), folded.fold(sampled.counting)
    return _apart(each, counting), DriftSums.of(each, np.asarray(counting.all(axis=0)))


def scattered(
    model: Model, dataset: Dataset, values: np.ndarray, solution: LinearSolution
) -> tuple[np.ndarray, str]:
    """Return the covariance of a rejected model's estimate, and what it holds in words.

    In one more pass over the columns.

    Parameters
    ----------
    model, dataset, values : as for `lack_of_fit`.
    solution : its weights and independent columns.

    Returns
    -------
    (r, r) of the independent parameters, from the scatter of scores between blocks of time.
    """
    scores = BlockScores(len(solution.basis.independent))
    count = len(dataset.recordings)
    arguments = (model, dataset.filter, values, solution, count)
    for one in over_recordings(dataset.recordings, _scores_of, *arguments):
        scores.join(one)
    meat = solution.inverse.T @ scores.meat @ solution.inverse
    words = (
        f"sigma holds the lack of fit as {scores.count} blocks of time tell it (cluster "
        "sandwich), and at least the noise. A bias that is the same in every block is not in it."
    )
    return solution.inverse @ meat @ solution.inverse.T, words


def _scores_of(
    recording: Recording,
    model: Model,
    settings: Filter | None,
    values: np.ndarray,
    solution: LinearSolution,
    recordings: int,
) -> BlockScores:
    """Scores of a recording, of so many, by blocks of time."""
    kept, weights = list(solution.basis.independent), solution.weights**2
    sampled, scores, start = sample(recording, settings), BlockScores(len(kept)), 0
    blocks = time_blocks(sampled, recordings)
    for columns, torque in sampled.rows(model, values):
        left = (torque - columns @ values) * weights
        part = np.einsum("tjr,tj->tr", columns[:, :, kept], left)
        scores.add(blocks[start : start + len(part)], part, 0)
        start += len(part)
    return scores


def _apart(folded: np.ndarray, counting: np.ndarray) -> tuple[np.ndarray, ...]:
    """Sums over the rows of a period of systematic squares and of noise, and what chance gives.

    Parameters
    ----------
    folded : (P, S, n) residuals, zero where they do not count.
    counting : (P, S, n) where they do.

    Returns
    -------
    (n,) sum of systematic squares, of squared noise, variance of the first under noise alone, and
    rows that count.
    """
    count, length, _ = folded.shape
    # A row that does not count in one repetition says nothing of what they have in common.
    everywhere = np.asarray(counting.all(axis=0))
    folded, rows = folded * everywhere, np.maximum(everywhere.sum(axis=0), 1)
    mean = folded.mean(axis=0)
    noise = folded - mean
    squares = np.sum(noise**2, axis=(0, 1)) / (count - 1)
    systematic = np.sum(mean**2, axis=0) - squares / count
    # Products of correlated noise are correlated, too: as the square.
    alike = 1.0
    for lag in range(1, min(_LAGS, length - 1) + 1):
        products = np.sum(noise[:, :-lag] * noise[:, lag:], axis=(0, 1)) / (count - 1)
        alike = alike + 2.0 * (products / np.maximum(squares, np.finfo(float).tiny)) ** 2
    variance = 2.0 * (squares / count) ** 2 / rows * alike * count / (count - 1)
    return systematic, squares, variance, rows


def widened(covariance: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the least covariance (r, r) that is at least each of two, direction by direction.

    Parameters
    ----------
    covariance : (r, r), positive definite but for rounding.
    other : (r, r).
    """
    size = np.sqrt(np.diag(covariance))
    lengths, axes = np.linalg.eigh(covariance / np.outer(size, size))
    # Of columns that are nearly alike rounding may leave no positive length.
    lengths = np.sqrt(np.maximum(lengths, len(size) * np.finfo(float).eps * lengths[-1]))
    inside = axes.T @ (other / np.outer(size, size)) @ axes / np.outer(lengths, lengths)
    values, vectors = np.linalg.eigh((inside + inside.T) / 2)
    half = size[:, None] * ((axes * lengths) @ (vectors * np.sqrt(np.maximum(values, 1.0))))
    return half @ half.T
