"""Whose motion the responses behind springs and gaps are predicted along.

They amplify the noise of measured positions. A simulated motion has none, and errs where the loop or
its first instants are not the real ones. Which of the two is less, the training recordings tell.
"""

from __future__ import annotations

import numpy as np

from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.joint_columns import JointColumns, WhiteColumns
from dynident.evidence.runs import Run


def simulation_predicts_better(fitted: EvidenceFit) -> bool:
    """Whether dynamic responses predict the training torque better along simulated motions.

    Parameters
    ----------
    fitted : a model, and the columns of the recordings that it was fitted to.

    Returns
    -------
    False where no effect is such a response, or nothing was simulated.
    """
    whole = np.append(-fitted.values, 1.0)
    response = np.zeros_like(whole)
    for effect in fitted.model.effects:
        if effect.is_dynamic_response:
            at = fitted.model.slices[effect.label]
            response[at] = whole[at]
    if not response.any():
        return False
    squares = np.zeros(2)
    for here in fitted.white:
        for j, columns in enumerate(here):
            for run, parts in zip(columns.stack.runs, columns.parts, strict=True):
                if run.columns_from == "simulation":
                    found = _squares(run, j, columns, parts, whole, response)
                    squares += found / fitted.variances[j]
    return bool(squares[1] < squares[0])


def _squares(
    run: Run,
    joint: int,
    columns: WhiteColumns,
    parts: tuple[tuple[np.ndarray, ...], ...],
    whole: np.ndarray,
    response: np.ndarray,
) -> np.ndarray:
    """Squared residual of a run, its responses along the measured and the simulated motion, (2,)."""
    measured, simulated = (
        JointColumns(columns.size, columns.places, each) for each in (parts[0], parts[-1])
    )
    left = measured.times(whole)
    other = left - measured.times(response) + simulated.times(response)
    rows = run.kept & run.certain_rows[:, joint]
    return np.array([np.sum(each[rows] ** 2) for each in (left, other)])
