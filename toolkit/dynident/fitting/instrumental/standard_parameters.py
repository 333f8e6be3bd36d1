"""From base parameters to standard parameters that a simulator can hold.

Base parameters say all that the torque depends on; a plant wants ten parameters of each body. Any
choice gives the same motion, as long as no body has a first moment without a mass.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.constraints import Within
from dynident.fitting.consistent.metric import Metric
from dynident.fitting.consistent.prior import Prior
from dynident.fitting.consistent.projection import project
from dynident.fitting.given import given_estimate
from dynident.model import Model
from dynident.robot import nearest_parameters

_FIRM = 1e3
"""Weight of the base values against the description: they are kept where a robot can have them."""


def minimum_norm(model: Model, values: np.ndarray) -> np.ndarray:
    """Return the standard parameters nearest to the description, masses kept where they can be.

    The bodies need not be physically possible: every base value is kept.

    Parameters
    ----------
    model : its robot is the description.
    values : (p,) the model's parameters.

    Returns
    -------
    (10 n,) parameters of the moving bodies, each in its joint's frame.
    """
    return nearest_parameters(model.base, model.robot.theta, values[: model.base.rank])


def consistent(model: Model, values: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Return the standard parameters of possible bodies nearest to base values.

    What a possible robot can have is kept; what none can have moves where the data mind least,
    and effects that may not be negative become zero.

    Parameters
    ----------
    model : its robot decides what the base values leave open.
    values : (p,) the model's parameters.
    root : (r, p) R with R'R the information that the data hold, in units of their noise.

    Returns
    -------
    (10 n + k,) parameters of the moving bodies, then those of the effects.

    Raises
    ------
    FitError
        If the projection fails.
    """
    robot = model.robot
    before = replace(given_estimate(robot), model=model, values=np.array(values))
    metric = Metric(_FIRM * root, model.names, rows=0, source="the last iteration")
    found = project(before, Prior(robot), metric, Within("full"))
    effects = found.values[model.base.rank :]
    return np.concatenate([found.robot.theta, effects])
