"""What errors of the measured positions would do to the torque, where they depend on the position.

An eccentric encoder or a gear that is not quite round reports q + e(q). Then the velocity is wrong
by e'(q) v, and the acceleration by e''(q) v^2 + e'(q) a: torques that no function of position and
velocity predicts, as they go with the acceleration, the load and, through the inertia, with the
motion of all joints. For a small error they are linear in it, so that columns of a few polynomials
in each joint's position hold all of them; of a joint that turns round, waves of a turn do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.polynomial import Chebyshev

from dynident.diagnosis.dependence.residual_record import (
    FittedBody,
    ResidualRecord,
    joints_turning_round,
)
from dynident.moments.solution import orthonormal

DEGREE = 6
"""Of the polynomials, over the range of each joint: up to about a wave and a half of an error; of
a joint that turns round as many columns, which are three waves. A
constant error is a joint zero, which the catalogue has."""
_NOTHING = 1e-6
"""Part of a column below which it is one that the fit has."""


_Error = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""An error at positions (N,), and its first and second derivative by the position."""


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
    round_and_round = joints_turning_round(records)
    errors = {
        int(k): _waves() if round_and_round[k] else _polynomials(low[k], high[k]) for k in moving
    }
    wrong = np.zeros((len(rows), len(moving) * DEGREE))
    known = [regressor, motion[2][:, [joint]]]
    for body in dict.fromkeys(bodies):
        here = np.array([one is body for one in bodies])[number]
        part = tuple(one[here] for one in motion)
        wrong[here] = _errors(body, joint, part, errors)
        # Of links that carry a payload in some recordings only.
        other = body.robot.theta != first.robot.theta
        known.append(regressor[:, other] * here[:, None])
    if not np.isfinite(wrong).all():
        return np.empty((len(rows), 0))
    basis = orthonormal(np.hstack(known), _NOTHING)
    wrong = _scaled(wrong)
    left = wrong - basis @ (basis.T @ wrong)
    size = float(np.sqrt(np.mean(left**2))) if left.size else 0.0
    return left / size if size > _NOTHING else left[:, :0]


def _polynomials(low: float, high: float) -> list[_Error]:
    """Errors over a range of positions."""
    each = (Chebyshev.basis(degree, domain=(low, high)) for degree in range(1, DEGREE + 1))
    return [lambda q, one=one: (one(q), one.deriv()(q), one.deriv(2)(q)) for one in each]


def _waves() -> list[_Error]:
    """Errors of an angle, the same after each turn."""
    each = ((k, phase) for k in range(1, DEGREE // 2 + 1) for phase in (0.0, np.pi / 2))
    return [
        lambda q, k=k, phase=phase: (
            np.sin(k * q + phase),
            k * np.cos(k * q + phase),
            -(k**2) * np.sin(k * q + phase),
        )
        for k, phase in each
    ]


def _errors(
    body: FittedBody,
    joint: int,
    motion: tuple[np.ndarray, ...],
    errors: Mapping[int, Sequence[_Error]],
) -> np.ndarray:
    """Torque at a joint of errors of one unit in each joint's position, (N, k).

    Parameters
    ----------
    body : the robot.
    joint : column of the joint.
    motion : q, v, a, (N, n) each.
    errors : of the positions of joints that move, by their columns.
    """
    q, v, a = motion
    by, found = body.robot.torque_derivatives(q, v, a), []
    for k, own in errors.items():
        inertia = by.by_a[:, joint, k] + (body.rotor[joint] if k == joint else 0.0)
        for error in own:
            size, slope, bend = error(q[:, k])
            found.append(
                by.by_q[:, joint, k] * size
                + by.by_v[:, joint, k] * slope * v[:, k]
                + inertia * (bend * v[:, k] ** 2 + slope * a[:, k])
            )
    return np.column_stack(found) if found else np.empty((len(q), 0))


def _scaled(columns: np.ndarray) -> np.ndarray:
    """Columns of mean square one; without those that are nothing."""
    size = np.sqrt(np.mean(columns**2, axis=0))
    return columns[:, size > 0] / size[size > 0]
