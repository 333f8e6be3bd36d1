"""The program that Ipopt is given: its slopes are those of its rows."""

from __future__ import annotations

import numpy as np
import pytest

from chains import chain_text
from dynident.experiment_design import MotionLimits
from dynident.experiment_design.column_function import ColumnFunction
from dynident.experiment_design.geometry.workspace import RoomCut
from dynident.experiment_design.information import Information
from dynident.experiment_design.motion_solver import LimitedTorque, MotionSolver
from dynident.experiment_design.motions.fourier_motions import FourierMotions
from dynident.experiment_design.motions.motion_family import MotionFamily
from dynident.experiment_design.motions.spline_motions import SplineMotions
from dynident.model import Model
from dynident.robot import Robot
from synthetic import true_values

ROBOT = Robot.from_text("prismatic".join(chain_text(3).rsplit("revolute", 1)))
"""Three joints, the last of which slides."""
MODEL = Model(ROBOT) + "viscous_friction"
LIMITS = MotionLimits.of(ROBOT)
FAMILIES: tuple[MotionFamily, ...] = (
    FourierMotions(limits=LIMITS, period=4.0, harmonics=3),
    SplineMotions(limits=LIMITS, period=4.0, intervals=8),
)
CUTS = (RoomCut(1.3, np.array([0.2, -0.5, 0.1]), -0.4),)


MOST = np.array([3.0, 20.0, 7.0])
"""N m, N m, N."""


def limited_torque(columns: ColumnFunction, joints: tuple[int, ...]) -> LimitedTorque:
    return LimitedTorque(function=columns.torque, most=MOST, joints=joints)


def information(columns: ColumnFunction, last: int) -> Information:
    return Information(
        columns=columns,
        mix=np.eye(columns.count),
        last=last,
        weight=np.array([2.0, 5.0, 1.0]),
        prior=np.eye(columns.count),
        scale=np.ones(columns.count),
    )


@pytest.mark.parametrize("family", FAMILIES, ids=lambda one: type(one).__name__)
@pytest.mark.parametrize("limited", [(), (1,), (0, 1, 2)])
@pytest.mark.parametrize("asked", [1, 3])
def test_slopes_are_those_of_the_rows(
    family: MotionFamily, limited: tuple[int, ...], asked: int
) -> None:
    columns = ColumnFunction.of(MODEL, true_values(MODEL))
    torque = limited_torque(columns, limited)
    every = tuple(information(columns, k + 1) for k in range(asked))
    solver = MotionSolver.of(family, every, (25, 12), 10, torque, CUTS)
    rows = solver.function.get_function("nlp_g")
    x = np.append((0.2 * family.random(5)).ravel(), [0.3] * (asked > 1))
    values, slopes = (np.array(one) for one in solver.function.get_function("nlp_jac_g")(x, []))
    np.testing.assert_allclose(values, np.array(rows(x, [])), atol=1e-12)
    step = 1e-6
    ways = step * np.eye(len(x))
    plain = np.hstack(
        [(np.array(rows(x + way, [])) - np.array(rows(x - way, []))) / (2 * step) for way in ways]
    )
    np.testing.assert_allclose(slopes, plain, atol=1e-6 * np.abs(plain).max())
    objective, slope = solver.function.get_function("nlp_grad_f")(x, [])
    losses = solver.function.get_function("nlp_f")
    assert float(objective) == pytest.approx(float(losses(x, [])))
    along = [(float(losses(x + w, [])) - float(losses(x - w, []))) / (2 * step) for w in ways]
    np.testing.assert_allclose(np.array(slope).ravel(), along, atol=1e-6 * np.abs(along).max())


def test_torques_are_limited_as_shares_of_what_they_may_be() -> None:
    (family, _), columns = FAMILIES, ColumnFunction.of(MODEL, true_values(MODEL))
    solvers = [
        MotionSolver.of(family, (information(columns, 2),), (25, 12), 10, torque)
        for torque in (limited_torque(columns, joints) for joints in ((), (0, 2)))
    ]
    variables = 0.2 * family.random(2)
    without, limited = (
        np.array(one.function.get_function("nlp_g")(variables.ravel(), [])).ravel()
        for one in solvers
    )
    t = family.times(12)
    torque = columns.torque_along(t, *family.trajectory(variables).at(t))[:, [0, 2]] / MOST[[0, 2]]
    np.testing.assert_allclose(limited[len(without) :], torque.T.ravel(), atol=1e-12)
