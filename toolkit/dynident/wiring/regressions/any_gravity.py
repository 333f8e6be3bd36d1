"""Regressions of one motion under many gravities.

The regressor is affine in gravity: it is evaluated under none and along three axes, and every
other is a sum of these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.model import Model
from dynident.robot import Robot
from dynident.robot.base_parameters import structural_motion, structurally_independent
from dynident.wiring.regressions.wiring_regression import WiringRegression, inertia_columns
from dynident.wiring.regressions.wiring_rows import WiringRows


@dataclass(frozen=True, eq=False)
class _Affine:
    """A regressor along a motion without gravity, and its rise by each axis' unit of gravity."""

    without: np.ndarray
    rises: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, robot: Robot, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> _Affine:
        without, *along = (
            robot.with_gravity(gravity).regressor(q, v, a) for gravity in (np.zeros(3), *np.eye(3))
        )
        return cls(without, tuple(one - without for one in along))

    def under(self, gravity: np.ndarray) -> np.ndarray:
        return self.without + sum(
            size * rise for size, rise in zip(gravity, self.rises, strict=True)
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class AnyGravity:
    """What regressions of a motion have in common, whatever the gravity.

    Attributes
    ----------
    model, rows : the robot and the width of friction, and the motion with the torques.
    along : the regressor of the motion.
    showing : that of the motion that shows which parameters can be told, with accelerations `a`.
    a : (T, n) of that motion.
    inertia : (n, 10 n) mean inertia at each joint.
    """

    model: Model
    rows: WiringRows
    along: _Affine
    showing: _Affine
    a: np.ndarray
    inertia: np.ndarray

    @classmethod
    def of(cls, model: Model, rows: WiringRows) -> AnyGravity:
        """Evaluate the regressors of a motion."""
        robot = model.robot
        q, v, a = structural_motion(robot)
        return cls(
            model=model,
            rows=rows,
            along=_Affine.of(robot, rows.q, rows.v, rows.a),
            showing=_Affine.of(robot, q, v, a),
            a=a,
            inertia=inertia_columns(robot, rows, list(range(10 * robot.n))),
        )

    def regression(self, gravity: np.ndarray) -> WiringRegression:
        """As `WiringRegression.of` the robot under a gravity (3,), m/s^2, up to rounding."""
        robot = self.model.robot.with_gravity(gravity)
        kept = structurally_independent(robot, self.showing.under(gravity), self.a)
        rigid = self.along.under(gravity)[:, :, kept]
        return WiringRegression.of_rigid(rigid, self.inertia[:, kept], self.model, self.rows)
