"""What the steps of encoders do to a prediction: a residual that repeats, and lacks no physics.

Where a motion repeats, so do its rounding errors. They are no noise, as the repetitions agree on
them, and nothing of the robot's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynident.criteria import VerdictCriteria
from dynident.diagnosis.verdict import within_noise
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.held_out import HeldOut, HeldOutRun
from dynident.evidence.windows import shared_motion
from dynident.fitting.sampling import sample
from dynident.recording import Dataset, Recording, resolution, uniform

_DRAWS = 2  # whose product has no noise in the mean


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

    The filtered motion is rounded again, on a lattice that is moved, with two draws of the noise
    that the recording has: what both do to the prediction is what repeats. How much that is depends
    on where the motion lies between the steps, which nobody knows: it is said from the mean and the
    spread over several places.

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
        first, second = (np.stack(rounded[draw::_DRAWS]) - smooth for draw in range(_DRAWS))
        common = np.sum(first * second, axis=1, where=certain) / np.maximum(rows, 1)
        total += np.clip(common, 0.0, None)
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
    """Return the recording with its filtered positions, and these rounded with draws of noise.

    Two draws, one after the other, at each place of the lattice.
    """
    recording = uniform(recording)
    motion = sample(recording, dataset.filter).motion
    rows = slice(motion.first, motion.first + motion.samples)
    smooth = np.array(recording.q)
    smooth[rows] = motion.q
    # What the filter took away is noise, and the rounding itself.
    power = np.mean((recording.q[rows] - motion.q) ** 2, axis=0) - steps**2 / 12.0
    std = np.sqrt(np.clip(power, 0.0, None))
    rng, safe = np.random.default_rng(0), np.where(steps > 0, steps, 1.0)
    # Other places of the lattice: what the filter left of the first rounding is in `smooth`.
    shifts = steps * rng.uniform(0.0, 1.0, (places, len(steps)))
    found = [recording.replace(q=smooth)]
    for shift in np.repeat(shifts, _DRAWS, axis=0):
        noisy = smooth + shift + std * rng.standard_normal(smooth.shape)
        rounded = np.where(steps > 0, np.round(noisy / safe) * safe - shift, smooth)
        found.append(recording.replace(q=rounded))
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
