"""What errors of the measured positions would do to the torque, where they depend on the position.

An eccentric encoder or a gear that is not quite round reports q + e(q). Then the velocity is wrong
by e'(q) v, and the acceleration by e''(q) v^2 + e'(q) a: torques that no function of position and
velocity predicts, as they go with the acceleration, the load and, through the inertia, with the
motion of all joints. For a small error they are linear in it, so that columns of a few polynomials
in each joint's position hold all of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.linalg import orth

from dynident.diagnosis.dependence.residual_record import FittedBody, ResidualRecord

DEGREE = 6
"""Of the polynomials, over the range of each joint: up to about a wave and a half of an error. A
constant error is a joint zero, which the catalogue has."""
_NOTHING = 1e-6
"""Part of a column below which it is one that the fit has."""


def position_error_columns(
    records: Sequence[ResidualRecord], rows: np.ndarray, joint: int
) -> np.ndarray:
    """Return what errors of the measured positions do to the torque of a joint.

    Parameters
    ----------
    records : all records.
    rows : (N,) increasing, of all records one after another.
    joint : column of the joint.

    Returns
    -------
    (N, k), less what other inertial parameters would make of them, as a fit has taken that; of
    mean square one on average. None where no robot is known, or its derivatives are not: of a body
    with a first moment and no mass, as a fit may leave one that the description has without mass.
    """
    bodies = [one.body for one in records if one.body is not None]
    if len(bodies) < len(records):
        return np.empty((len(rows), 0))
    number = np.repeat(np.arange(len(records)), [len(one.t) for one in records])[rows]
    q, v, a = (np.concatenate([getattr(one, name) for one in records]) for name in "qva")
    low, high = q.min(axis=0), q.max(axis=0)
    moving = np.flatnonzero(high - low > _NOTHING * np.abs(q).max(axis=0))
    motion = q[rows], v[rows], a[rows]
    first, regressor = bodies[0], bodies[0].robot.regressor(*motion)[:, joint]
    wrong = np.zeros((len(rows), len(moving) * DEGREE))
    known = [regressor, motion[2][:, [joint]]]
    for body in dict.fromkeys(bodies):
        here = np.array([one is body for one in bodies])[number]
        part = tuple(one[here] for one in motion)
        wrong[here] = _errors(body, joint, part, {int(k): (low[k], high[k]) for k in moving})
        # Of links that carry a payload in some recordings only.
        other = body.robot.theta != first.robot.theta
        known.append(regressor[:, other] * here[:, None])
    if not np.isfinite(wrong).all():
        return np.empty((len(rows), 0))
    basis = orth(_scaled(np.hstack(known)), rcond=_NOTHING)
    wrong = _scaled(wrong)
    left = wrong - basis @ (basis.T @ wrong)
    size = float(np.sqrt(np.mean(left**2))) if left.size else 0.0
    return left / size if size > _NOTHING else left[:, :0]


def _errors(
    body: FittedBody,
    joint: int,
    motion: tuple[np.ndarray, ...],
    ranges: dict[int, tuple[float, float]],
) -> np.ndarray:
    """Torque at a joint of errors of one unit, polynomials in each joint's position, (N, k).

    Parameters
    ----------
    body : the robot.
    joint : column of the joint.
    motion : q, v, a, (N, n) each.
    ranges : of the positions of joints that move, by their columns.
    """
    q, v, a = motion
    by, found = body.robot.torque_derivatives(q, v, a), []
    for k, domain in ranges.items():
        inertia = by.by_a[:, joint, k] + (body.rotor[joint] if k == joint else 0.0)
        for degree in range(1, DEGREE + 1):
            error = Chebyshev.basis(degree, domain=domain)
            slope, bend = error.deriv()(q[:, k]), error.deriv(2)(q[:, k])
            found.append(
                by.by_q[:, joint, k] * error(q[:, k])
                + by.by_v[:, joint, k] * slope * v[:, k]
                + inertia * (bend * v[:, k] ** 2 + slope * a[:, k])
            )
    return np.column_stack(found) if found else np.empty((len(q), 0))


def _scaled(columns: np.ndarray) -> np.ndarray:
    """Columns of mean square one; without those that are nothing."""
    size = np.sqrt(np.mean(columns**2, axis=0))
    return columns[:, size > 0] / size[size > 0]
