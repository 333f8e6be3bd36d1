"""What the steps of encoders do to a prediction: a residual that repeats, and lacks no physics.

Where a motion repeats, so do its rounding errors. They are no noise, as the repetitions agree on
them, and nothing of the robot's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtr

from dynident.criteria import DEFAULTS, Criteria
from dynident.fitting.sampling import sample
from dynident.model import Model
from dynident.recording import Dataset, Filter, Recording, resolution, uniform

_FADED = 1.0
"""Steps of noise from which on rounding does not repeat: it is 1e-9 of a step in the mean."""


def rounding_power(
    model: Model,
    values: np.ndarray,
    dataset: Dataset,
    criteria: Criteria = DEFAULTS,
    judged: Sequence[tuple[np.ndarray, np.ndarray]] = (),
) -> np.ndarray:
    """Largest usual mean square of the torque error that repeats as positions are rounded, (n,).

    The filtered motion is rounded again, on a lattice that is moved, in the mean over the noise
    that the recording has, for noise is another in each repetition: what that does to the
    prediction is what repeats, to first order: what noise itself does to columns that bend, as dry
    friction's do, is none of the encoders' steps. How much it is depends on where the motion lies
    between the steps, which nobody knows: it is said from the mean and the spread over several
    places.

    Parameters
    ----------
    model, values : (p,) the estimate.
    dataset : recordings; positions that lie on no lattice count as not rounded.
    criteria : along how many recordings, at how many places, and how much is usual.
    judged : times (S,), s, and the rows by which each joint is judged (S, n), of each recording:
        the mean is over these, as that of the residual is. All rows count without it.

    Returns
    -------
    Mean over the recordings in which rows of a joint count; zero where none does.
    """
    own = criteria.nuisances
    looked_at = dataset.recordings[: own.rounding_recordings]
    total = np.zeros((own.rounding_places, model.robot.n))
    recordings = np.zeros(model.robot.n)
    for number, recording in enumerate(looked_at):
        steps = resolution(recording.q)
        if not steps.any():
            recordings += 1
            continue
        again = _again(recording, dataset.filter, steps, own.rounding_places)
        t, (smooth, *rounded) = _predicted(
            model, values, again, dataset.filter, criteria.fit.samples_hz
        )
        certain = _certain(t, *judged[number]) if judged else np.ones(smooth.shape, dtype=bool)
        rows = certain.sum(axis=0)
        repeated = (np.stack(rounded) - smooth) ** 2
        total += np.sum(repeated, axis=1, where=certain) / np.maximum(rows, 1)
        recordings += rows > 0
    power = total / np.maximum(recordings, 1)
    spread = np.std(power, axis=0, ddof=1)
    return np.mean(power, axis=0) + own.rounding_deviations * spread


def _certain(t: np.ndarray, of: np.ndarray, certain: np.ndarray) -> np.ndarray:
    """Rows at times t (T,) by which each joint is judged, (T, n) mask; from that of other times."""
    found = np.zeros((len(t), certain.shape[1]), dtype=bool)
    found[np.searchsorted((t[1:] + t[:-1]) / 2, of)] = certain
    return found


def _again(
    recording: Recording, settings: Filter | None, steps: np.ndarray, places: int
) -> list[Recording]:
    """Return the recording with its filtered positions, and with these rounded at each place."""
    recording = uniform(recording)
    motion = sample(recording, settings).motion
    rows = slice(motion.first, motion.first + motion.samples)
    smooth = np.array(recording.q)
    smooth[rows] = motion.q
    # What the filter took away is noise, and the rounding itself.
    power = np.mean((recording.q[rows] - motion.q) ** 2, axis=0) - steps**2 / 12.0
    std = np.sqrt(np.clip(power, 0.0, None))
    # Other places of the lattice: what the filter left of the first rounding is in `smooth`.
    shifts = steps * np.random.default_rng(0).uniform(0.0, 1.0, (places, len(steps)))
    moved = (smooth + mean_rounding(smooth + shift, steps, std) for shift in shifts)
    return [recording.replace(q=one) for one in (smooth, *moved)]


def mean_rounding(q: np.ndarray, steps: np.ndarray, std: np.ndarray) -> np.ndarray:
    """Return what rounding adds to positions in the mean over Gaussian noise.

    Noise of a third of a step takes off nine tenths of it (a dither): E[round(x + noise)] - x,
    with every edge between two steps crossed with its probability.

    Parameters
    ----------
    q : (T, n) rad or m, without noise.
    steps : (n,) of the encoders; nothing is added where it is 0.
    std : (n,) of the noise before rounding.

    Returns
    -------
    (T, n) rad or m.
    """
    found = np.zeros_like(q)
    for j, (step, noise) in enumerate(zip(steps, std, strict=True)):
        if step == 0 or noise >= _FADED * step:
            continue
        place = q[:, j] / step
        place -= np.round(place)
        width = max(noise / step, np.finfo(float).tiny)
        edges = np.arange(np.ceil(5.0 * width) + 1) + 0.5
        crossed = (ndtr((place - e) / width) - ndtr((-place - e) / width) for e in edges)
        found[:, j] = step * (sum(crossed) - place)
    return found


def _predicted(
    model: Model,
    values: np.ndarray,
    recordings: list[Recording],
    settings: Filter | None,
    samples_hz: float,
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Times (T,) s, and the torque that the model predicts along each recording, (T, n)."""
    each = [sample(one, settings).thinned(samples_hz) for one in recordings]
    predicted = []
    for one in each:
        parts = one.residuals(model, values)
        predicted.append(np.concatenate([measured - left for left, measured in parts]))
    return each[0].t, predicted
