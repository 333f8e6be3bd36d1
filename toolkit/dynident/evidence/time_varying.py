"""Columns that depend on the time in the session: no repetition is another one's equal.

Their instrument is the motion of the next repetition at the time of this one. What the time does to
a column comes before the noise is whitened: a ramp that went through the filter is not in
proportion to a later part of it that went through the filter.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.noise_model import NoiseModel
from dynident.evidence.stacks import Stack
from dynident.model import Model
from dynident.moments.replicates import TimeVarying

_NOTHING = 1e-12
"""Part of its largest value below which a factor of the time is zero."""


def steady(white: np.ndarray) -> TimeVarying:
    """Columns and the torque after them, (R, P, S, p + 1), of which none depends on the time."""
    instruments = np.roll(white, -1, axis=1)
    return TimeVarying(white, instruments, np.arange(white.shape[3]) == white.shape[3] - 1)


def time_varying_columns(
    evidence: Evidence, model: Model, stack: Stack, joint: int, noise: NoiseModel, white: np.ndarray
) -> TimeVarying:
    """Columns of a model and the torque at one joint with their instruments.

    Parameters
    ----------
    evidence, stack : recordings, and which of them.
    model : with its effects.
    joint, noise : column of the joint, and its noise.
    white : (R, P, S, p + 1) whitened columns and torque.

    Returns
    -------
    The columns, and what the next repetition has in their place.
    """
    found = steady(white)
    for effect in model.effects:
        joints = effect.acting_at(model.robot)
        if effect.time_varying and joint in joints:
            for r, instruments in zip(stack.numbers, found.instruments, strict=True):
                measured = evidence.of(effect, r, model, None)[0][:, joints.index(joint)]
                moved = _at_this_time(evidence, effect, r, joint, noise, measured)
                instruments[..., model.slices[effect.label]] = moved
    return found


def time_varying_variants(
    evidence: Evidence,
    variants: Sequence[Effect],
    stack: Stack,
    joint: int,
    noise: NoiseModel,
    columns: tuple[Sequence[Sequence[np.ndarray]], np.ndarray],
) -> TimeVarying:
    """Columns of an effect with several shapes at one joint with their instruments.

    Parameters
    ----------
    evidence, stack : recordings, and which of them.
    variants : one effect at one place.
    joint, noise : column of the joint, and its noise.
    columns : of each recording (T, k) of each variant as they are, and (R, P, S, k of all)
        whitened.

    Returns
    -------
    The columns of all variants, and what the next repetition has in their place.
    """
    measured, white = columns
    instruments = np.roll(white, -1, axis=1)
    if variants[0].time_varying:
        for r, each, found in zip(stack.numbers, measured, instruments, strict=True):
            moved = [
                _at_this_time(evidence, effect, r, joint, noise, one)
                for effect, one in zip(variants, each, strict=True)
            ]
            found[...] = np.concatenate(moved, axis=2)
    return TimeVarying(white, instruments, np.zeros(white.shape[3], dtype=bool))


def of_the_torque(new: TimeVarying, model: TimeVarying, values: np.ndarray) -> TimeVarying:
    """Columns in proportion to the predicted torque, which the time changes where it changes that.

    Parameters
    ----------
    new : the columns, (R, P, S, k).
    model, values : columns of the model and the torque, and the (p,) parameters that predict.

    Returns
    -------
    With the torque that is predicted of the next repetition's motion at the time of this one.
    """
    here, there = (one[..., :-1] @ values for one in (model.columns, model.instruments))
    power = max(float(np.sum(here**2)), np.finfo(float).tiny)
    factors = np.einsum("rpsk,rps->k", new.columns, here) / power
    return TimeVarying(new.columns, there[..., None] * factors, new.is_torque)


def _at_this_time(
    evidence: Evidence,
    effect: Effect,
    run: int,
    joint: int,
    noise: NoiseModel,
    columns: np.ndarray,
) -> np.ndarray:
    """Columns (T, k) of the next repetition's motion at this one's time, whitened, (P, S, k)."""
    recorded = evidence.runs[run]
    speed = recorded.replicates[0].v[:, joint]
    factor = effect.time_factor(recorded.rows(model=evidence.model))
    sound = np.abs(factor) > _NOTHING * np.abs(factor).max()
    rows, found = np.arange(len(columns)), []
    for here, there in zip(recorded.index, np.roll(recorded.index, -1, axis=0), strict=True):
        # Whole rows, since whitening looks back; those of no use are out of the repetition.
        now = factor[np.clip(rows + here[0] - there[0], 0, len(columns) - 1)]
        ratio = np.where(sound, now / np.where(sound, factor, 1.0), 1.0)
        white = noise.whiten(columns * ratio[:, None], speed, recorded.told(joint))
        found.append(white[there])
    return np.stack(found)
