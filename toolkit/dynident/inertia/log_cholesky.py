"""Log-Cholesky parameters: ten free numbers, each choice of which is a possible body.

C. Rucker and P. M. Wensing, "Smooth parameterization of rigid-body inertia", RA-L 2022. The
pseudo-inertia is P = U U', U upper triangular with positive diagonal,

    U = e^alpha [[e^d1, s12,  s13,  t1],
                 [0,    e^d2, s23,  t2],
                 [0,    0,    e^d3, t3],
                 [0,    0,    0,    1 ]],

so that the mass is e^(2 alpha) and t is the centre of mass in m. The map is smooth, and one to
one onto the fully consistent bodies; a body without extent along some axis (a plate, a rod, a
point) is at infinity.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dynident.errors import ConsistencyError
from dynident.inertia.conversions import from_pseudo_inertia
from dynident.inertia.margins import margins
from dynident.inertia.parameters import pseudo_inertia

LOG_CHOLESKY = ("alpha", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3")
"""Names, in Rucker and Wensing's order; s and e^d in m, t in m, e^(2 alpha) in kg."""

# Row and column in U of every parameter but alpha.
_ROW = np.array([0, 1, 2, 0, 1, 0, 0, 1, 2])
_COLUMN = np.array([0, 1, 2, 1, 2, 2, 3, 3, 3])

# A second moment of mass that is no larger than this, relative to the inertia, is rounding.
_EXTENT = 64 * np.finfo(float).eps


def log_cholesky_entries(eta: Any, exp: Callable[[Any], Any]) -> list[Any]:
    """Return the ten inertial parameters, in our order, as plain arithmetic on ten symbols.

    Parameters
    ----------
    eta : ten of anything that has arithmetic: numbers, arrays, CasADi symbols
        In the order of `LOG_CHOLESKY`.
    exp : callable
        The exponential for those: `np.exp`, `casadi.exp`.
    """
    alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3 = (eta[k] for k in range(10))
    mass = exp(2 * alpha)
    e1, e2, e3 = exp(d1), exp(d2), exp(d3)
    # Second moments per mass, Sigma / m.
    xx = e1 * e1 + s12 * s12 + s13 * s13 + t1 * t1
    yy = e2 * e2 + s23 * s23 + t2 * t2
    zz = e3 * e3 + t3 * t3
    xy = s12 * e2 + s13 * s23 + t1 * t2
    xz = s13 * e3 + t1 * t3
    yz = s23 * e3 + t2 * t3
    per_mass = [t1, t2, t3, yy + zz, -xy, xx + zz, -xz, -yz, xx + yy]
    return [mass, *(mass * entry for entry in per_mass)]


def from_log_cholesky(eta: ArrayLike) -> NDArray[np.float64]:
    """Return phi (10,) of log-Cholesky parameters (10,): a fully consistent body."""
    return np.array(log_cholesky_entries(_ten(eta), np.exp))


def log_cholesky_jacobian(eta: ArrayLike) -> NDArray[np.float64]:
    """Return d phi / d eta (10, 10) at log-Cholesky parameters (10,)."""
    eta = _ten(eta)
    scale = np.exp(eta[0])
    U = _factor(eta)
    jacobian = np.empty((10, 10))
    jacobian[:, 0] = 2.0 * from_log_cholesky(eta)
    for k, (i, j) in enumerate(zip(_ROW, _COLUMN, strict=True), start=1):
        # dP = dU U' + U dU', and phi is linear in P.
        change = np.zeros((4, 4))
        change[i] = (U[i, i] if i == j else scale) * U[:, j]
        jacobian[:, k] = from_pseudo_inertia(change + change.T)
    return jacobian


def log_cholesky(phi: ArrayLike, where: str = "body") -> NDArray[np.float64]:
    """Return the log-Cholesky parameters (10,) of a body; inverse of `from_log_cholesky`.

    Parameters
    ----------
    phi : (10,) array_like
        Fully consistent, with mass and with extent along every axis.
    where : str
        Named in an error.

    Raises
    ------
    ConsistencyError
        If the body is not fully consistent, or at the edge of it: without mass, or a plate, rod
        or point, whose log-Cholesky parameters are infinite.
    """
    phi = _ten(phi)
    report = margins(phi)
    if not report.consistent:
        rule = report.broken[0]
        raise ConsistencyError(
            f"is not fully consistent ({rule} is {getattr(report, rule):.3g}): it has no "
            "log-Cholesky parameters",
            where,
            "project it onto the consistent bodies first",
        )
    # The triangle's margin is twice the least second moment about the centre of mass.
    if phi[0] <= 0.0 or report.triangle <= _EXTENT * report.inertia_scale:
        raise ConsistencyError(
            "is without mass or without extent along some axis (a plate, rod or point): its "
            "log-Cholesky parameters are infinite",
            where,
            "move it inward first, by a share of a body with mass and extent",
        )
    # With the axes reversed, P = U U' is the usual P = L L'.
    U = np.linalg.cholesky(pseudo_inertia(phi)[::-1, ::-1])[::-1, ::-1]
    U = U / U[3, 3]
    eta = np.empty(10)
    eta[0] = 0.5 * np.log(phi[0])
    eta[1:] = U[_ROW, _COLUMN]
    eta[1:4] = np.log(eta[1:4])
    return eta


def _factor(eta: NDArray[np.float64]) -> NDArray[np.float64]:
    U = np.zeros((4, 4))
    U[_ROW, _COLUMN] = eta[1:]
    U[[0, 1, 2], [0, 1, 2]] = np.exp(eta[1:4])
    U[3, 3] = 1.0
    return np.exp(eta[0]) * U


def _ten(values: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=float)
    if array.shape != (10,):
        raise ValueError(f"ten numbers are needed, got an array of shape {array.shape}")
    return array
