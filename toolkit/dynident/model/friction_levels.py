"""Levels of dry friction that a model's values say, and whether it may have them.

In: a model, its values with their covariance, and the torques that moved its joints. Out: levels,
and which of them these joints would not have overcome.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.criteria import GateCriteria
from dynident.effects import Parameter
from dynident.model.possible_values import Impossible
from dynident.model.torque_model import Model
from dynident.tables import number


def dry_joints(model: Model) -> tuple[str, ...]:
    """Joints that have Coulomb friction in a model, in its order."""
    return tuple(one for one in model.robot.names if _coulomb(one) in model.slices)


def coulomb_levels(model: Model, values: np.ndarray) -> np.ndarray:
    """Return the Coulomb friction of each joint, (n,) N m or N; zero where a model has none.

    Parameters
    ----------
    model, values : (p,) of its parameters.
    """
    found = np.zeros(model.robot.n)
    for joint in dry_joints(model):
        found[model.robot.names.index(joint)] = values[model.slices[_coulomb(joint)].start]
    return found


def _coulomb(joint: str) -> str:
    return f"coulomb_friction@{joint}"


def levels_not_met(
    model: Model,
    values: np.ndarray,
    covariance: np.ndarray,
    peaks: np.ndarray,
    criteria: GateCriteria,
) -> Iterator[Impossible]:
    """Levels of dry friction above the largest torque that the joint can have overcome.

    A law may rise to such a level only where nothing was recorded: what fits is its foot.

    Parameters
    ----------
    model, values, covariance, criteria : as in `impossible_joints`.
    peaks : (n,) largest torque that was measured at each joint and that its bodies make, N m or N:
        friction balances no more than both.

    Yields
    ------
    Each level that is beyond doubt above the peak of its joint.
    """
    sigma = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    for effect in model.effects:
        own = model.slices[effect.label]
        parameters = effect.parameters(model.robot)
        for parameter, value, s in zip(parameters, values[own], sigma[own], strict=True):
            if effect.joint is None or not parameter.is_level:
                continue
            peak = float(peaks[model.robot.names.index(effect.joint)])
            if value > peak + criteria.beyond_bounds * s:
                yield Impossible(
                    where=f"{parameter.name} of {effect.label}",
                    what=not_met(parameter, float(value), effect.joint, peak),
                    value=float(peak - value),
                    std=float(s),
                )


def not_met(parameter: Parameter, value: float, joint: str, peak: float) -> str:
    """Say of a level of friction that the joint has overcome less.

    Parameters
    ----------
    parameter, value, joint : the level, and where.
    peak : largest torque measured there and of its bodies, N m or N.

    Returns
    -------
    A clause with both.
    """
    return (
        f"{parameter.name} = {number(value, 3)} {parameter.unit} at {joint}, where drive and "
        f"bodies make {number(peak, 3)} {parameter.unit} at most"
    )
