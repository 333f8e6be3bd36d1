"""Columns of a model and the torque, joint by joint, along the recordings of the evidence."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.evidence.columns.joint_columns import JointColumns
from dynident.evidence.evidence import Evidence
from dynident.evidence.runs import Signals
from dynident.model import Model

_PART = 8192
"""Rows of all joints that are written out at a time."""


def model_columns(
    evidence: Evidence, model: Model, run: int, joint: int, values: np.ndarray | None
) -> Signals:
    """Columns of a model and the torque at one joint.

    Parameters
    ----------
    evidence, run : recordings, and which one of them.
    model : with its effects and their shapes.
    joint : column of the joint.
    values : (p,) at which columns that depend on the fit are taken; None for zeros.

    Returns
    -------
    (T, p + 1) for each replicate of the run.
    """
    return [one.dense() for one in joint_columns(evidence, model, run, joint, values)]


def joint_columns(
    evidence: Evidence, model: Model, run: int, joint: int, values: np.ndarray | None
) -> list[JointColumns]:
    """As `model_columns`, without columns that are zero throughout.

    Parameters
    ----------
    evidence, run, model, joint, values : as for `model_columns`.

    Returns
    -------
    One for each replicate of the run.
    """
    first = evidence.runs[run].replicates[0]
    acting = model.acting_at(joint, carries_payload=bool(first.recording.payload))
    places = np.concatenate([evidence.loading(first, joint), acting.places, [model.size]])
    moved = [(evidence.of(e, run, model, values), at) for e, at in acting.dependent]
    return [
        JointColumns(
            model.size + 1,
            places,
            (
                *evidence.motion.parts(one, model, joint),
                *(each[r][:, at] for each, at in moved),
                evidence.torque(one, joint),
            ),
        )
        for r, one in enumerate(evidence.runs[run].replicates)
    ]


def rows_of_run(
    evidence: Evidence, model: Model, run: int, values: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Rows of the regression of one recording as measured, a part of it at a time.

    Parameters
    ----------
    evidence, run, model, values : as for `model_columns`.

    Yields
    ------
    columns (T, n, p) and torque (T, n)
    """
    joints = range(model.robot.n)
    measured = [joint_columns(evidence, model, run, j, values)[0] for j in joints]
    for start in range(0, len(evidence.runs[run].replicates[0].t), _PART):
        part = slice(start, start + _PART)
        whole = np.stack([one.among(part).dense() for one in measured], axis=1)
        yield whole[:, :, :-1], whole[:, :, -1]
