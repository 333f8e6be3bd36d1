"""Columns of a model in all runs of the evidence, whitened, and their moments."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import add

import numpy as np

from dynident.evidence.columns.joint_columns import JointColumns, WhiteColumns
from dynident.evidence.evidence import Evidence
from dynident.evidence.noise_model import NoiseModel
from dynident.evidence.runs import Run
from dynident.evidence.time_varying import time_varying_columns
from dynident.model import Model
from dynident.moments.replicates import (
    TimeVarying,
    instrumental_values,
    time_varying_products,
    with_torque_again,
)
from dynident.moments.second_moments import SecondMoments

ColumnsOfRuns = Sequence[Sequence[Sequence[JointColumns]]]
"""Columns of a model and the torque, for each run, joint and replicate."""

White = tuple[tuple[WhiteColumns, ...], ...]
"""Whitened columns of each stack of runs, of each joint."""


def whiten(
    evidence: Evidence,
    columns: ColumnsOfRuns,
    noise: Sequence[NoiseModel],
    values: np.ndarray,
    before: White | None = None,
) -> White:
    """Whiten the columns; those that were whitened before, of whatever model, are known.

    Parameters
    ----------
    evidence, columns : recordings, and their columns for each run, joint and replicate.
    noise : of each joint.
    values : (p,) the latest parameters.
    before : of an earlier round, or of the fit of a like model.

    Returns
    -------
    Those of each stack of runs, of each joint.
    """
    found = []
    for s, stack in enumerate(evidence.stacks):
        here = []
        for j, own in enumerate(noise):
            known, signals = None, [columns[r][j] for r in stack.numbers]
            if before is not None and s < len(before):
                known = before[s][j].again(stack, own, signals)
            if known is None:
                pairs = zip(stack.runs, signals, strict=True)
                moved = [_moved(run, one, values) for run, one in pairs]
                known = WhiteColumns.of(stack, j, own, moved)
            here.append(known)
        found.append(tuple(here))
    return tuple(found)


def _moved(run: Run, signals: Sequence[JointColumns], values: np.ndarray) -> Sequence[JointColumns]:
    """Move the torque from the measured to the simulated motion, where there is one.

    Instrumental variables V' (y - W x) = 0, with columns W along the measured motion and V along
    the simulated one, are not symmetric. They are the least squares of y - (W - V) x on V, taken at
    the x that they find. So the simulated replicate's torque becomes that at the latest x, and
    everything that follows is plain regression on columns without noise (but for responses behind
    springs and gaps, see `Evidence.responses`). What another column would bring is then its
    instrumental moment with the residual y - W x: zero in the mean if nothing is missing, wherever
    the simulated motion may lie.

    Parameters
    ----------
    run : the recording.
    signals : columns of the model and the torque at a joint, for each replicate.
    values : (p,) the latest parameters.
    """
    if run.columns_from == "recording":
        return signals
    measured, simulated = signals[0], signals[-1]
    torque = measured.times(np.append(-values, 1.0)) + simulated.times(np.append(values, 0.0))
    return [*signals[:-1], simulated.with_torque(torque)]


def moments_of(
    evidence: Evidence, model: Model, noise: Sequence[NoiseModel], white: White
) -> SecondMoments:
    """Moments of a model's whitened columns and the torque over all joints.

    Parameters
    ----------
    evidence, model : the recordings, and whose columns they are.
    noise : of each joint, by which they were whitened.
    white : these columns.

    Returns
    -------
    (B, p + 1, p + 1)
    """
    if model.is_time_varying:
        return _of_the_session(evidence, model, noise, white)
    return SecondMoments.stacked([WhiteColumns.moments(joints) for joints in white])


def _of_the_session(
    evidence: Evidence, model: Model, noise: Sequence[NoiseModel], white: White
) -> SecondMoments:
    """Moments of a model of which some columns depend on the time, see `with_next`."""
    parts = [
        [
            time_varying_columns(evidence, model, stack, j, noise[j], w.dense())
            for j, w in enumerate(joints)
        ]
        if stack.kind == "repeated"
        else []
        for stack, joints in zip(evidence.stacks, white, strict=True)
    ]
    return with_next(white, parts)


def with_next(white: White, parts: Sequence[Sequence[TimeVarying]]) -> SecondMoments:
    """Moments with the next repetition as the instrument of each; of other recordings, as ever.

    Products of all repetitions tell the same in the mean. But of a column that hardly changes with
    the time, beside its like that does not, the difference of two estimates would be all there is.

    Parameters
    ----------
    white : columns and the torque of each stack of runs, of each joint.
    parts : the same with their instruments; nothing for a stack that does not repeat.
    """
    values, found = None, []
    for joints, own in zip(white, parts, strict=True):
        here, edges = WhiteColumns.moments(joints), joints[0].stack.runs[0].edges
        if own:
            if values is None:
                values = instrumental_values([one for part in parts for one in part])
            about = (one.about(values) for one in own)
            products = np.sum([time_varying_products(x, x, edges) for x in about], axis=0)
            half = with_torque_again(products, values).swapaxes(1, 2)
            here = here.with_signal(with_torque_again(half, values).swapaxes(1, 2))
        found.append(here)
    return SecondMoments.stacked(found)


def pooled_moments_of(
    evidence: Evidence, model: Model, noise: Sequence[NoiseModel], white: White
) -> SecondMoments:
    """The moments of all blocks together, in less time where nothing depends on the time.

    Parameters
    ----------
    evidence, model, noise, white : as for `moments_of`.

    Returns
    -------
    (p + 1, p + 1)
    """
    if model.is_time_varying:
        return moments_of(evidence, model, noise, white).pooled()
    return reduce(add, (WhiteColumns.pooled(joints) for joints in white))


def systematic_squares(evidence: Evidence, white: White, values: np.ndarray) -> np.ndarray:
    """Return the squared whitened residual at each joint, (n,), of what replicates have in common.

    Parameters
    ----------
    evidence, white : the recordings, and a model's columns there.
    values : (p,) of the model.
    """
    combination, found = np.append(-values, 1.0), np.zeros(len(white[0]))
    for stack, joints in zip(evidence.stacks, white, strict=True):
        for j, one in enumerate(joints):
            left = one.times(combination)
            found[j] += stack.moments(left, left).signal.sum()
    return found
