"""Virtual parameters: eleven free numbers per joint, each choice of which is semi-consistent.

J.-A. Ting, M. Mistry, J. Peters, S. Schaal, J. Nakanishi, "A Bayesian approach to nonlinear
parameter identification for rigid body dynamics", RSS 2006, equation (5): the root of the mass,
the centre of mass c in m, the lower Cholesky factor of the inertia about the centre of mass, and
the root of the joint's viscous friction,

    h = (sqrt m, cx, cy, cz, L11, L21, L31, L22, L32, L33, sqrt viscous),
    I = L L' + m (c'c E - c c').

It keeps the mass and the principal moments from being negative, but lets one moment exceed the
sum of the others, which no body can (h = (1, 0, 0, 0, 1, 0, 0, 1, 0, sqrt 3, 0)): see
`log_cholesky` for what is fully consistent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dynident.errors import ConsistencyError
from dynident.inertia.conversions import from_paper
from dynident.inertia.margins import margins
from dynident.inertia.parameters import point_inertia, to_com

VIRTUAL = ("h1", "h2", "h3", "h4", "h5", "h6", "h7", "h8", "h9", "h10", "h11")
"""Names, in the paper's order."""

# Row and column in L of h5 to h10, and where the upper triangle's entries stand in it.
_ROW = np.array([0, 1, 2, 1, 2, 2])
_COLUMN = np.array([0, 0, 0, 1, 1, 2])


@dataclass(frozen=True, eq=False)
class VirtualBody:
    """What eleven virtual parameters stand for.

    Attributes
    ----------
    phi : (10,) ndarray
        Inertial parameters, in the order of `PARAMETERS`.
    viscous : float
        Viscous friction of the body's joint, N m s/rad (N s/m).
    """

    phi: NDArray[np.float64]
    viscous: float


def virtual_entries(h: Any) -> list[Any]:
    """Return ten inertial parameters and the viscous friction as plain arithmetic on symbols.

    Parameters
    ----------
    h : eleven of anything that has arithmetic: numbers, arrays, CasADi symbols

    Returns
    -------
    list
        Eleven, in the paper's order (`PAPER_ORDER`, then the viscous friction).
    """
    h1, h2, h3, h4, h5, h6, h7, h8, h9, h10, h11 = (h[k] for k in range(11))
    m = h1 * h1
    return [
        m,
        h2 * m,
        h3 * m,
        h4 * m,
        h5 * h5 + (h4 * h4 + h3 * h3) * m,
        h5 * h6 - h2 * h3 * m,
        h5 * h7 - h2 * h4 * m,
        h6 * h6 + h8 * h8 + (h2 * h2 + h4 * h4) * m,
        h6 * h7 + h8 * h9 - h3 * h4 * m,
        h7 * h7 + h9 * h9 + h10 * h10 + (h2 * h2 + h3 * h3) * m,
        h11 * h11,
    ]


def from_virtual(h: ArrayLike) -> VirtualBody:
    """Return the body and friction of virtual parameters (11,)."""
    entries = np.array(virtual_entries(_eleven(h)))
    return VirtualBody(from_paper(entries[:10]), float(entries[10]))


def virtual_jacobian(h: ArrayLike) -> NDArray[np.float64]:
    """Return d `virtual_entries` / d h (11, 11) at virtual parameters (11,).

    Rows are in the paper's order, like the entries.
    """
    h = _eleven(h)
    root, com = h[0], h[1:4]
    mass = root * root
    L = np.zeros((3, 3))
    L[_ROW, _COLUMN] = h[4:10]
    jacobian = np.zeros((11, 11))
    jacobian[0, 0] = 2.0 * root
    jacobian[1:4, 0] = 2.0 * root * com
    jacobian[4:10, 0] = _six(2.0 * root * point_inertia(com))
    for k, axis in enumerate(np.eye(3)):
        jacobian[1 + k, 1 + k] = mass
        product = np.outer(axis, com)
        shift = 2.0 * com[k] * np.eye(3) - product - product.T
        jacobian[4:10, 1 + k] = mass * _six(shift)
    for k, (i, j) in enumerate(zip(_ROW, _COLUMN, strict=True)):
        change = np.zeros((3, 3))
        change[i] = L[:, j]
        jacobian[4:10, 4 + k] = _six(change + change.T)
    jacobian[10, 10] = 2.0 * h[10]
    return jacobian


def virtual(phi: ArrayLike, viscous: float = 0.0, where: str = "body") -> NDArray[np.float64]:
    """Return virtual parameters (11,) of a body and a friction; inverse of `from_virtual`.

    Of the signs that give the same body, the roots and the diagonal of L are not negative.
    Singular inertias (points, rods) are given a factor too.

    Parameters
    ----------
    phi : (10,) array_like
        Semi-consistent (`Margins.semi_consistent`), with a mass of zero or more.
    viscous : float
        N m s/rad (N s/m), not negative.
    where : str
        Named in an error.

    Raises
    ------
    ConsistencyError
        If the mass, the smallest moment about the centre of mass or the friction is negative, if
        there is a first moment without mass, or a value that is not finite; says which.
    """
    phi = np.asarray(phi, dtype=float)
    report = margins(phi)
    broken = None
    if not (np.all(np.isfinite(phi)) and np.isfinite(viscous)):
        broken = "a value is not finite"
    elif viscous < 0:
        broken = f"the viscous friction is negative ({viscous:.3g})"
    elif phi[0] < 0:
        broken = f"the mass is negative ({phi[0]:.3g} kg)"
    elif np.isnan(report.inertia_com_min_eig):
        broken = "there is a first moment but no mass"
    elif not report.semi_consistent:
        broken = (
            "the inertia about the centre of mass is not positive semidefinite (smallest "
            f"principal moment {report.inertia_com_min_eig:.3g} kg m^2)"
        )
    if broken:
        raise ConsistencyError(
            f"is not semi-consistent: {broken}; it has no virtual parameters",
            where,
            "project it onto the consistent bodies first",
        )
    body = to_com(phi)
    L = _lower_factor(body.inertia_com)
    return np.array(
        [np.sqrt(body.mass), *body.com, *L[_ROW, _COLUMN], np.sqrt(viscous)], dtype=float
    )


def _lower_factor(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return L (3, 3), lower triangular with L L' the matrix, which may be singular.

    A Cholesky factor would divide by the rounding error of a vanishing pivot. Of R in
    Q R = sqrt(Lambda) V', R' R is V Lambda V' whatever the rank.
    """
    values, axes = np.linalg.eigh(matrix)
    R = np.linalg.qr((axes * np.sqrt(np.clip(values, 0.0, None))).T).R
    return R.T * np.where(np.diag(R) < 0, -1.0, 1.0)


def _six(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the upper triangle row by row: the paper's six."""
    return matrix[_COLUMN, _ROW]


def _eleven(h: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(h, dtype=float)
    if array.shape != (11,):
        raise ValueError(f"eleven numbers are needed, got an array of shape {array.shape}")
    return array
