"""What the steps of encoders do to a prediction: a residual that repeats, and lacks no physics.

Where a motion repeats, so do its rounding errors. They are no noise, as the repetitions agree on
them, and nothing of the robot's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtr

from dynident.criteria import VerdictCriteria
from dynident.diagnosis.verdict import within_noise
from dynident.evidence.columns.windows import shared_motion
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.held_out import HeldOut, HeldOutRun
from dynident.fitting.sampling import sample
from dynident.recording import Dataset, Recording, resolution, uniform

_FADED = 1.0
"""Steps of noise from which on rounding does not repeat: it is 1e-9 of a step in the mean."""


def with_rounding(judged: HeldOut, fitted: EvidenceFit, dataset: Dataset) -> HeldOut:
    """Return a judgement that knows what the encoders' steps do, where anything is left at all.

    Parameters
    ----------
    judged : what the model misses.
    fitted : the model.
    dataset : the recordings behind `judged`.
    """
    if judged.least_ratio is None or within_noise(judged, fitted.criteria.verdict):
        return judged
    return replace(judged, rounding=rounding_power(fitted, dataset, judged.runs))


def nothing_but_rounding(judged: HeldOut, fitted: EvidenceFit, dataset: Dataset) -> bool:
    """Whether a residual beyond the noise is no more than encoders' steps leave.

    Parameters
    ----------
    judged : what the model misses.
    fitted : the model.
    dataset : the recordings behind `judged`.

    Returns
    -------
    False where nothing is beyond the noise, as nothing is looked at then.
    """
    rounded = with_rounding(judged, fitted, dataset)
    return rounded.rounding is not None and within_noise(rounded, fitted.criteria.verdict)


def rounding_power(
    fitted: EvidenceFit, dataset: Dataset, judged: Sequence[HeldOutRun] = ()
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
    fitted : the model.
    dataset : recordings; positions that lie on no lattice count as not rounded.
    judged : the recordings as they are judged, in the same order: the mean is over their certain
        rows, as that of the residual is. All rows count without it.

    Returns
    -------
    Mean over the recordings in which rows of a joint count; zero where none does.
    """
    own = fitted.criteria.nuisances
    looked_at = dataset.recordings[: own.rounding_recordings]
    total = np.zeros((own.rounding_places, fitted.model.robot.n))
    recordings = np.zeros(fitted.model.robot.n)
    for number, recording in enumerate(looked_at):
        steps = resolution(recording.q)
        if not steps.any():
            recordings += 1
            continue
        again = _again(recording, dataset, steps, own.rounding_places)
        t, (smooth, *rounded) = _predicted(fitted, dataset, again)
        certain = _certain(t, judged[number]) if judged else np.ones(smooth.shape, dtype=bool)
        rows = certain.sum(axis=0)
        repeated = (np.stack(rounded) - smooth) ** 2
        total += np.sum(repeated, axis=1, where=certain) / np.maximum(rows, 1)
        recordings += rows > 0
    power = total / np.maximum(recordings, 1)
    spread = np.std(power, axis=0, ddof=1)
    return np.mean(power, axis=0) + own.rounding_deviations * spread


def _certain(t: np.ndarray, judged: HeldOutRun) -> np.ndarray:
    """Rows at times t (T,) by which each joint is judged, (T, n) mask."""
    certain = np.zeros((len(t), judged.certain.shape[1]), dtype=bool)
    certain[np.searchsorted((t[1:] + t[:-1]) / 2, judged.t)] = judged.certain
    return certain


def _again(
    recording: Recording, dataset: Dataset, steps: np.ndarray, places: int
) -> list[Recording]:
    """Return the recording with its filtered positions, and with these rounded at each place."""
    recording = uniform(recording)
    motion = sample(recording, dataset.filter).motion
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
    fitted: EvidenceFit, dataset: Dataset, recordings: list[Recording]
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Times (T,) s, and the torque that the model predicts along each recording, (T, n)."""
    least_hz = fitted.criteria.fit.samples_hz
    each = [shared_motion(sample(one, dataset.filter).thinned(least_hz)) for one in recordings]
    predicted = []
    for one in each:
        parts = one.residuals(fitted.model, fitted.values)
        predicted.append(np.concatenate([measured - left for left, measured in parts]))
    return each[0].t, predicted


def rounding_notes(
    judged: HeldOut, names: tuple[str, ...], criteria: VerdictCriteria
) -> tuple[str, ...]:
    """Say where the steps of an encoder leave a part of the residual, in plain words.

    Parameters
    ----------
    judged : what the final model misses.
    names : of the joints.
    criteria : from which part of the noise it is said.

    Returns
    -------
    A sentence for each joint concerned.
    """
    if judged.rounding is None or judged.noise_std is None:
        return ()
    share = np.sqrt(judged.rounding) / np.where(judged.noise_std > 0, judged.noise_std, np.inf)
    return tuple(
        f"The steps of the encoder at {name} leave a residual of up to {part:.2g} times the noise, "
        "the same in every repetition: what is smaller than that cannot be told from them."
        for name, part in zip(names, share, strict=True)
        if part > criteria.within_noise
    )
