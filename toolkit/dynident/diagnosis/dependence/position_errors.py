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

from dynident.diagnosis.dependence.residual_record import ResidualRecord

DEGREE = 6
"""Of the polynomials, over the range of each joint: up to about a wave and a half of an error. A
constant error is a joint zero, which the catalogue has."""


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
    (N, k), each with a mean square of one. None of joints that stand still, and none at all where
    no robot is known.
    """
    q, v, a = (np.concatenate([getattr(one, name) for one in records]) for name in "qva")
    number = np.repeat(np.arange(len(records)), [len(one.t) for one in records])[rows]
    low, high = q.min(axis=0), q.max(axis=0)
    moving = np.flatnonzero(high - low > 1e-6 * np.abs(q).max(axis=0))
    q, v, a = q[rows], v[rows], a[rows]
    columns = np.zeros((len(rows), len(moving) * DEGREE))
    for i, one in enumerate(records):
        here = number == i
        if one.torque_derivatives is None or not here.any():
            continue
        by = one.torque_derivatives(q[here], v[here], a[here])
        found = []
        for k in moving:
            at, speed, acceleration = q[here, k], v[here, k], a[here, k]
            for degree in range(1, DEGREE + 1):
                error = Chebyshev.basis(degree, domain=(low[k], high[k]))
                slope, bend = error.deriv()(at), error.deriv(2)(at)
                found.append(
                    by.by_q[:, joint, k] * error(at)
                    + by.by_v[:, joint, k] * slope * speed
                    + by.by_a[:, joint, k] * (bend * speed**2 + slope * acceleration)
                )
        columns[here] = np.column_stack(found)
    size = np.sqrt(np.mean(columns**2, axis=0))
    return columns[:, size > 0] / size[size > 0]
