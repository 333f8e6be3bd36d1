"""Test recordings that are not as the training ones: a load, a mounting, another temperature.

What the training recordings show may also be absent from the test recordings: a joint that rattles
at one place, say, where these never are. Held-out errors do not tell of it.

What a model lacks it lacks in training as well, as long as the motions are alike. So a recording
that is predicted far worse than the training ones are fitted, and worse than the uncertainty of the
parameters makes expect, was recorded under other circumstances, or moves where they do not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import chdtri

from dynident.criteria import VerdictCriteria
from dynident.diagnosis.verdict import beyond_noise
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.held_out import HeldOut, HeldOutRun, on_recordings, prediction_variance
from dynident.evidence.model_columns import joint_columns
from dynident.tables import percent

_SHOWN = 4
"""Recordings that are named."""


def unlike_notes(evidence: Evidence, held: Evidence | None, fitted: EvidenceFit) -> tuple[str, ...]:
    """Name the test recordings that are predicted far worse than training makes expect.

    Parameters
    ----------
    evidence, held : of the training and of the test recordings; `held` may be None.
    fitted : the final model.

    Returns
    -------
    One sentence or two; empty where every recording is as expected.
    """
    if held is None:
        return ()
    trained, judged = on_recordings(evidence, fitted), on_recordings(held, fitted)
    model, names = fitted.model, fitted.model.robot.names
    criteria = evidence.criteria.verdict
    # As large as the parameters' error is at worst, not in the mean.
    largest = float(chdtri(1, 1.0 - evidence.criteria.noise.confidence))
    found = []
    for r, run in enumerate(judged.runs):
        each = [joint_columns(held, model, r, j, fitted.values)[0] for j in range(len(names))]
        doubt = np.array([prediction_variance(one, fitted) for one in each])
        alone = judged.of(run)
        expected = np.sqrt(trained.residual_rms**2 + largest * doubt)
        over = alone.residual_rms / np.where(expected > 0, expected, np.inf)
        over[alone.residual_rms <= criteria.resolution * alone.torque_rms] = 0.0
        worst = int(np.argmax(over))
        if over[worst] >= criteria.unlike:
            here, there = (percent(one.joint_errors[worst]) for one in (alone, trained))
            found.append(f"{run.name} ({names[worst]}: {here} of its torque, {there} in training)")
    if not found:
        return ()
    shown = found[:_SHOWN] + ([f"{len(found) - _SHOWN} more"] if len(found) > _SHOWN else [])
    return (
        f"Predicted far worse than the training recordings are fitted: {', '.join(shown)}. "
        "Something is not as there (a load, the mounting, a temperature, a calibration), or it "
        "moves as they do not. A load is said by payload = true in the entry of the "
        "recording, and known only if a training recording has it too.",
    )


def training_notes(
    trained: HeldOut, after: HeldOut, names: Sequence[str], criteria: VerdictCriteria
) -> tuple[str, ...]:
    """Say what the training recordings leave beyond their noise and the test recordings do not.

    Parameters
    ----------
    trained, after : what the final model leaves of the training and of the test recordings.
    names : of the joints.
    criteria : of the verdict.

    Returns
    -------
    Two sentences; empty where the test recordings show as much, or nothing is beyond the noise.
    """
    there = beyond_noise(trained, criteria) & ~beyond_noise(after, criteria)
    if not there.any() or trained.ratio is None or after.ratio is None:
        return ()
    found = []
    for j in (int(place) for place in np.flatnonzero(there)):
        run = max(trained.runs, key=lambda one: float(np.max(np.abs(_judged_rows(one, j)))))
        t = float(run.t[np.argmax(np.abs(_judged_rows(run, j)))])
        doubt = ""
        if after.least_ratio is not None and after.ratio[j] > criteria.most_left:
            doubt = ", no more than rounding and the processing leave"
            if after.least_ratio[j] <= criteria.most_left:
                doubt = ", no more than the errors of parameters fitted to training make"
        found.append(
            f"{names[j]} ({trained.ratio[j]:.3g} times the noise, "
            f"{after.ratio[j]:.3g} in the test recordings{doubt}; largest in {run.name} at "
            f"t = {t:.4g} s)"
        )
    return (
        f"The training recordings show what the test recordings do not, at {', '.join(found)}: the "
        "held-out error says nothing of it. Hold out a recording with a motion like theirs.",
    )


def _judged_rows(run: HeldOutRun, joint: int) -> np.ndarray:
    """The residual (T,) of a joint; zero in rows by which it is not judged."""
    return np.where(run.certain[:, joint], run.residual[:, joint], 0.0)
