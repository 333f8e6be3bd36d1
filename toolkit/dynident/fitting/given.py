"""Parameters that are given, as an estimate: a description's own, or a list of numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.errors import FitError
from dynident.fitting.estimate import Estimate
from dynident.model import Model
from dynident.robot import BaseParameters, Robot


def given_estimate(robot: Robot, model: Model | None = None) -> Estimate:
    """Return a robot description as an estimate without data.

    Parameters
    ----------
    robot : its links' parameters are the estimate's.
    model : with effects, which are at zero; default: the rigid body alone.
    """
    model = replace(model, robot=robot) if model else Model(robot)
    p, n = model.size, robot.n
    unit = BaseParameters(
        names=model.names,
        independent=tuple(range(p)),
        dependent=(),
        K=np.zeros((p, 0)),
        expressions=model.names,
        scale=np.ones(p),
        diagonal=np.ones(p),
        tolerance=0.0,
    )
    unknown = np.full(n, np.nan)
    values = model.given_values()
    return Estimate(
        model=model,
        values=values,
        covariance=np.zeros((p, p)),
        basis=unit,
        torque_std=unknown,
        joint_errors=unknown,
        error=float("nan"),
        condition_number=float("nan"),
        rows=0,
        method="as given",
        status="not fitted",
        links={link.name: link.phi for link in robot.links if link.source != "absent"},
    )


def prior_model(model: Model, robot: Robot) -> Model:
    """Return a model over another description of the same robot.

    Raises
    ------
    FitError
        If it is another robot: joints, links or base parameters differ.
    """
    if robot is model.robot:
        return model
    remedy = "give a description of the same robot"
    if robot.names != model.robot.names or robot.bodies != model.robot.bodies:
        raise FitError(
            "has other joints or links than the estimate", f"prior '{robot.name}'", remedy
        )
    other = replace(model, robot=robot)
    same = other.base.independent == model.base.independent and np.allclose(
        other.base.K, model.base.K, rtol=1e-6, atol=1e-9
    )
    if not same:
        raise FitError("has other kinematics than the estimate", f"prior '{robot.name}'", remedy)
    return other
