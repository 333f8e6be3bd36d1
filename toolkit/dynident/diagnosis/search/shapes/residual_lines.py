"""Lines over position in what a fitted model leaves, see `dynident.effects.position_lines`."""

from __future__ import annotations

import numpy as np

from dynident.effects import Effect
from dynident.effects.position_lines import PositionLines
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.model_columns import joint_columns
from dynident.robot import Robot


def line_width(evidence: Evidence, effect: Effect) -> float | None:
    """Return by how much lines must differ to be told apart, in units of an effect's shape.

    Parameters
    ----------
    evidence : the recordings.
    effect : at a joint, with a shape.

    Returns
    -------
    pi over the travel of its joint; None where no spectrum is taken of such shapes.
    """
    found = _looked_for(evidence, effect)
    return None if found is None or effect.shape[0] < found.low else found.width


def shapes_tried(evidence: Evidence, effect: Effect) -> int:
    """Return how many shapes of an effect count as tried within its grid, lines among them."""
    found = _looked_for(evidence, effect)
    return sum(1 for _ in effect.variants(evidence.model.robot)) if found is None else found.tried


def lines_beyond(evidence: Evidence, effect: Effect) -> int:
    """Return how many lines beyond its grid a spectrum could name."""
    found = _looked_for(evidence, effect)
    return 0 if found is None else found.beyond


def is_beyond(effect: Effect, robot: Robot) -> bool:
    """Whether an effect has the shape of a line beyond its grid."""
    limits = effect.lines_over_position(robot)
    return limits is not None and effect.shape[0] > effect.shape_parameters(robot)[0].grid[-1]


def lines(evidence: Evidence, fitted: EvidenceFit, effect: Effect) -> tuple[Effect, ...]:
    """Return an effect with the shapes at which the spectrum of the residual is highest.

    Parameters
    ----------
    evidence, fitted : the recordings, and the model as it fits them.
    effect : at a joint, with any shape.

    Returns
    -------
    Highest first; none for effects whose grid is near enough to every line.
    """
    found = _looked_for(evidence, effect)
    if found is None:
        return ()
    joint, left = _joint(evidence, effect), []
    combination = np.append(-fitted.values, 1.0)
    for r, run in enumerate(evidence.runs):
        columns = joint_columns(evidence, fitted.model, r, joint, fitted.values)
        residual = run.fold([one.times(combination) for one in columns])
        left.append((residual * run.certain(joint)).ravel())
    return found.highest(_positions(evidence, joint), np.concatenate(left))


def _looked_for(evidence: Evidence, effect: Effect) -> PositionLines | None:
    """Where lines of an effect are looked for; None for one that has none."""
    robot = evidence.model.robot
    if effect.lines_over_position(robot) is None:
        return None
    joint = _joint(evidence, effect)
    speed = np.concatenate([run.replicates[0].v[:, joint] for run in evidence.runs])
    rate = max(run.replicates[0].rate_hz for run in evidence.runs)
    return PositionLines.of(effect, robot, (_positions(evidence, joint), speed), rate)


def _positions(evidence: Evidence, joint: int) -> np.ndarray:
    """Positions of a joint in all runs, where its residuals are."""
    every = (run.fold([one.q[:, joint] for one in run.replicates]) for run in evidence.runs)
    return np.concatenate([one.ravel() for one in every])


def _joint(evidence: Evidence, effect: Effect) -> int:
    return evidence.model.robot.names.index(str(effect.joint))
