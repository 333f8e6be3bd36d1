"""Where the iterations begin."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from dynident.errors import FitError
from dynident.fitting.estimate import Estimate
from dynident.model import Model

Start = Literal["least_squares", "description", "regular"]
START_NAMES: tuple[str, ...] = get_args(Start)


def start_values(start: Start | Estimate, model: Model, least_squares: Estimate) -> np.ndarray:
    """Return the parameters (p,) at which the iterations begin.

    Raises
    ------
    FitError
        If an earlier estimate is one of another model.
    """
    if isinstance(start, Estimate):
        if start.names != model.names:
            remedy = "fit the same model, or start from least squares"
            raise FitError("the estimate to start from has other parameters", "IV.start", remedy)
        return np.array(start.values)
    if start == "least_squares":
        return least_squares.values
    return regular(model) if start == "regular" else model.given_values()


def regular(model: Model) -> np.ndarray:
    """Return the regular start (Janot et al., equations 48 to 51), (p,).

    Each motor's inertia is 1 where the model has them, else each body's inertia about its joint's
    axis (its mass, if the joint slides); all else is 0. The inertia matrix is then regular at
    every pose.
    """
    values, robot = np.zeros(model.size), model.robot
    theta = np.zeros((robot.n, 10))
    for j, joint in enumerate(robot.joints):
        rotor = model.slices.get(f"rotor_inertia@{joint.name}")
        if rotor is not None:
            values[rotor] = 1.0
        elif joint.kind == "prismatic":
            theta[j, 0] = 1.0
        else:
            x, y, z = joint.axis
            theta[j, 4:] = (x * x, x * y, y * y, x * z, y * z, z * z)
    values[: model.base.rank] = model.base.coordinates(theta.ravel())
    return values
