"""Whether what a model leaves is more than the steps of encoders do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.criteria import VerdictCriteria
from dynident.diagnosis.verdict import within_noise
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.held_out import HeldOut
from dynident.fitting.uncertainty.encoder_steps import rounding_power
from dynident.recording import Dataset


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
    power = rounding_power(
        fitted.model,
        fitted.values,
        dataset,
        fitted.criteria,
        [(run.t, run.certain) for run in judged.runs],
    )
    return replace(judged, rounding=power)


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
