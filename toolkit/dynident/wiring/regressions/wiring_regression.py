"""One assignment of positions to joints, and quick fits of torques assigned to them.

The regressor of a motion is evaluated once; of it only the second moments of each joint's rows
are kept. A fit to torques in another order, of another sign or scale is then one small system of
equations. Beside the rigid body every joint has viscous and dry friction, a rotor, a spring and an
offset, so that what a model lacks is not taken for a fault of the wiring.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from scipy.linalg import get_lapack_funcs

from dynident.model import Model
from dynident.robot import Robot
from dynident.wiring.regressions.wiring_rows import WiringRows

OF_A_JOINT = 5
"""Columns of a joint's own: Fv, Fc, rotor inertia, spring, offset."""
_ROUNDS = 3  # of weighting joints by what is left at them
_RIDGE = 1e-11
_LEAST = 1e-5
"""Share of the torque's power below which a residual is as good as none."""
_STATES = 12  # positions at which the inertia is looked at
_potrf, _potrs = get_lapack_funcs(("potrf", "potrs"), (np.zeros((0, 0)),))


@dataclass(frozen=True, eq=False, kw_only=True)
class TorqueFit:
    """A fit to torques that are assigned to joints in some way.

    Attributes
    ----------
    values : (p,) of the columns.
    unexplained : (n,) residual power of each joint over the torque's.
    inertia, friction : (n,) mean joint-space inertia (kg m^2 or kg) and power lost to friction (W).
    inertia_z, friction_z : (n,) the same over their standard deviations, per root of a row.
    """

    values: np.ndarray
    unexplained: np.ndarray
    inertia: np.ndarray
    friction: np.ndarray
    inertia_z: np.ndarray
    friction_z: np.ndarray

    @property
    def score(self) -> float:
        """Logarithmic likelihood per row, of fits whose inertias and frictions are possible.

        An impossible value costs what it would cost to hold it at zero.
        """
        z = np.minimum(np.concatenate([self.inertia_z, self.friction_z]), 0.0)
        lost = 0.5 * float(np.sum(np.log1p(z**2)))
        return self.fit_score - lost

    @property
    def fit_score(self) -> float:
        """The part of the score that the residual makes."""
        return -0.5 * float(np.sum(np.log(np.maximum(self.unexplained, _LEAST))))

    @property
    def misfit(self) -> float:
        """Share of the torque that the fit leaves, joints alike."""
        return float(np.sqrt(np.mean(self.unexplained)))


@dataclass(frozen=True, eq=False, kw_only=True)
class WiringRegression:
    """Second moments of a motion's columns with themselves and with every torque.

    Attributes
    ----------
    gram : (n, p, p) of each joint's rows.
    cross : (n, n, p) of joint i's rows with torque column k.
    power : (n, n) sum of squares of torque column k over joint i's rows.
    inertia_of, friction_of : (n, p) mean inertia and friction power, linear in the values.
    """

    gram: np.ndarray
    cross: np.ndarray
    power: np.ndarray
    inertia_of: np.ndarray
    friction_of: np.ndarray

    @classmethod
    def of(cls, model: Model, rows: WiringRows) -> WiringRegression:
        """Evaluate the columns along a motion.

        Parameters
        ----------
        model : of which the robot and the width of friction count.
        rows : the motion and the torques.
        """
        robot, kept = model.robot, list(model.base.independent)
        rigid = robot.regressor(rows.q, rows.v, rows.a)[:, :, kept]
        return cls.of_rigid(rigid, inertia_columns(robot, rows, kept), model, rows)

    @classmethod
    def of_rigid(
        cls, rigid: np.ndarray, inertia: np.ndarray, model: Model, rows: WiringRows
    ) -> WiringRegression:
        """Put what joints and motors have of their own beside columns of the rigid body.

        Parameters
        ----------
        rigid : (T, n, r) along the motion.
        inertia : (n, r) as of `inertia_columns`.
        model : of which the width of friction counts.
        rows : the motion and the torques.

        Returns
        -------
        Their second moments.
        """
        columns = _columns(rigid, model, rows)
        n = columns.shape[1]
        by_joint = columns.transpose(1, 0, 2) * rows.counts.T[:, :, None]
        own = columns.shape[2] - OF_A_JOINT * n
        friction_of = np.zeros((n, columns.shape[2]))
        dry = np.tanh(rows.v / model.friction_widths)
        for j in range(n):
            at = own + OF_A_JOINT * j
            friction_of[j, at] = np.mean(rows.v[:, j] ** 2)
            friction_of[j, at + 1] = np.mean(rows.v[:, j] * dry[:, j])
        return cls(
            gram=by_joint.transpose(0, 2, 1) @ by_joint,
            cross=np.swapaxes(by_joint.transpose(0, 2, 1) @ rows.tau, 1, 2),
            power=rows.counts.T @ rows.tau**2,
            inertia_of=_inertia_of(inertia, columns.shape[2]),
            friction_of=friction_of,
        )

    def fit(self, order: np.ndarray, scale: np.ndarray) -> TorqueFit:
        """Fit torques that are `scale[i]` times the column `order[i]` at joint i.

        Parameters
        ----------
        order : (n,) numbers of torque columns.
        scale : (n,) by which each is multiplied.
        """
        n = len(order)
        cross = self.cross[np.arange(n), order] * scale[:, None]
        power = np.maximum(self.power[np.arange(n), order] * scale**2, 1e-300)
        left, columns = power, self.gram.shape[1]
        for _ in range(_ROUNDS):
            weight = 1.0 / np.maximum(left, _LEAST * power)
            A = (weight @ self.gram.reshape(n, -1)).reshape(columns, columns)
            diagonal = A.diagonal()
            # A column of zeros, of a joint at rest, is known by the ridge alone.
            size = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
            A /= size
            A /= size[:, None]
            A.flat[:: columns + 1] += _RIDGE
            factor = _cholesky(A)
            values = _solved(factor, (weight @ cross) / size) / size
            quadratic = (self.gram.reshape(-1, columns) @ values).reshape(n, columns) @ values
            left = np.maximum(power - 2 * cross @ values + quadratic, 0.0)
        wanted = np.concatenate([self.inertia_of, self.friction_of])
        spread = np.sqrt(np.sum((wanted / size) * _solved(factor, (wanted / size).T).T, axis=1))
        found = wanted @ values
        z = np.divide(found, spread, out=np.zeros_like(found), where=spread > 0)
        return TorqueFit(
            values=values,
            unexplained=left / power,
            inertia=found[:n],
            friction=found[n:],
            inertia_z=z[:n],
            friction_z=z[n:],
        )


def _columns(rigid: np.ndarray, model: Model, rows: WiringRows) -> np.ndarray:
    """Columns of base parameters, of shared motors, and five of each joint's own, (T, n, p)."""
    samples, n, kept = rigid.shape
    shared = _of_shared_motors(rows, model.friction_widths)
    first = kept + len(shared)
    columns = np.zeros((samples, n, first + OF_A_JOINT * n))
    columns[:, :, :kept] = rigid
    for k, one in enumerate(shared, start=kept):
        columns[:, :, k] = one
    dry = np.tanh(rows.v / model.friction_widths)
    for j in range(n):
        own = [rows.v[:, j], dry[:, j], rows.a[:, j], rows.q[:, j], np.ones(samples)]
        at = first + OF_A_JOINT * j
        columns[:, j, at : at + OF_A_JOINT] = np.stack(own, axis=1)
    return columns


def _of_shared_motors(rows: WiringRows, widths: np.ndarray) -> list[np.ndarray]:
    """Friction and rotors of motors that turn several joints, (T, n) each: they act at all."""
    found = []
    for turns, width in zip([] if rows.motors is None else rows.motors, widths, strict=False):
        if np.count_nonzero(turns) > 1:
            v, a = rows.v @ turns, rows.a @ turns
            found += [np.outer(one, turns) for one in (v, np.tanh(v / width), a)]
    return found


def _cholesky(A: np.ndarray) -> np.ndarray:
    """The factor of a matrix so small that SciPy's own functions would take longer than it does."""
    factor, failed = _potrf(A, lower=0, clean=0)
    last = float(factor[-1, -1]) if len(factor) else 1.0
    if failed or not isfinite(last):  # LAPACK lets what is not finite pass
        raise np.linalg.LinAlgError("the moments of the wiring are not positive definite")
    return factor


def _solved(factor: np.ndarray, right: np.ndarray) -> np.ndarray:
    return _potrs(factor, right, lower=0)[0]


def inertia_columns(robot: Robot, rows: WiringRows, kept: list[int]) -> np.ndarray:
    """Return the mean inertia at each joint: the torque of a unit of acceleration, gravity off.

    Parameters
    ----------
    robot : whose bodies' parameters it is linear in.
    rows : positions at some of which it is looked at.
    kept : numbers of the r parameters.

    Returns
    -------
    (n, r)
    """
    n = robot.n
    at = np.linspace(0, len(rows.q) - 1, min(_STATES, len(rows.q))).round().astype(int)
    q = rows.q[at]
    rest = np.zeros_like(q)
    still = robot.regressor(q, rest, rest)
    found = np.zeros((n, len(kept)))
    for j in range(n):
        pushed = np.array(rest)
        pushed[:, j] = 1.0
        column = (robot.regressor(q, rest, pushed) - still)[:, j, kept]
        found[j] = column.mean(axis=0)
    return found


def _inertia_of(bodies: np.ndarray, size: int) -> np.ndarray:
    """Mean inertia at each joint, (n, p): of the bodies, (n, r), and of the joint's rotor."""
    n, rigid = bodies.shape
    found = np.zeros((n, size))
    found[:, :rigid] = bodies
    for j in range(n):
        found[j, size - OF_A_JOINT * (n - j) + 2] = 1.0
    return found
