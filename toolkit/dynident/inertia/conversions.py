"""The ten parameters in the forms of other programs and papers, and back.

Nothing is checked for physical consistency and nothing is repaired: broken inertias pass through
as they are. Pinocchio holds the centre of mass and the inertia about it, Drake the inertia per
mass, so that what goes through them keeps its digits relative to the inertia about the origin.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dynident.errors import RobotError
from dynident.inertia.parameters import PARAMETERS, inertia_matrix

if TYPE_CHECKING:
    from pydrake.multibody.tree import SpatialInertia

PAPER_ORDER = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
"""The upper triangle row by row, as An, Atkeson and Hollerbach (1985) and later papers write it."""

_TO_PAPER = [PARAMETERS.index(name) for name in PAPER_ORDER]
_FROM_PAPER = [PAPER_ORDER.index(name) for name in PARAMETERS]

# Mass given to a body that has an inertia but no mass, relative to that inertia: Drake stores
# inertia per mass. Its weight is below rounding.
_TRACE = 1e-13

# How far, relative to a block of a 6x6 matrix, its entries may miss the form that a spatial
# inertia has.
_FORM = 1e-9


def to_paper(phi: ArrayLike) -> NDArray[np.float64]:
    """Return parameters (..., 10) in the papers' order, `PAPER_ORDER`."""
    return _last_ten(phi)[..., _TO_PAPER]


def from_paper(theta: ArrayLike) -> NDArray[np.float64]:
    """Return parameters (..., 10) in our order, `PARAMETERS`, from the papers' order.

    Ten symbols in a list come back in an array of objects.
    """
    return _last_ten(theta)[..., _FROM_PAPER]


def from_pseudo_inertia(matrix: ArrayLike) -> NDArray[np.float64]:
    """Return phi (10,) of a (4, 4) pseudo-inertia; inverse of `pseudo_inertia`.

    Of a matrix that is not symmetric, its symmetric part counts.
    """
    P = _matrix(matrix, 4)
    P = 0.5 * (P + P.T)
    # I = tr(Sigma) E - Sigma, summed so that nothing cancels.
    return np.array(
        [
            P[3, 3],
            *P[:3, 3],
            P[1, 1] + P[2, 2],
            -P[0, 1],
            P[0, 0] + P[2, 2],
            -P[0, 2],
            -P[1, 2],
            P[0, 0] + P[1, 1],
        ]
    )


def spatial_inertia_matrix(phi: ArrayLike) -> NDArray[np.float64]:
    """Return the (6, 6) spatial inertia [[I, S(h)], [S(h)', m E]] about the frame's origin.

    It multiplies a spatial velocity with the angular part first (Featherstone, "Rigid body
    dynamics algorithms", 2008, equation 2.63). It is linear in phi, and positive semidefinite
    exactly when the mass and the inertia about the centre of mass are not negative: the weaker
    consistency, which leaves the triangle inequality open.
    """
    phi = np.asarray(phi, dtype=float)
    matrix = np.empty((6, 6))
    matrix[:3, :3] = inertia_matrix(phi)
    matrix[:3, 3:] = _cross(phi[1:4])
    matrix[3:, :3] = matrix[:3, 3:].T
    matrix[3:, 3:] = phi[0] * np.eye(3)
    return matrix


def from_spatial_inertia_matrix(matrix: ArrayLike) -> NDArray[np.float64]:
    """Return phi (10,) of a (6, 6) spatial inertia; inverse of `spatial_inertia_matrix`.

    Raises
    ------
    RobotError
        If the matrix has not the form [[I, S(h)], [S(h)', m E]], angular part first.
    """
    M = _matrix(matrix, 6)
    S = M[:3, 3:]
    inertia = M[:3, :3]
    six = [inertia[0, 0], inertia[0, 1], inertia[1, 1], inertia[0, 2], inertia[1, 2], inertia[2, 2]]
    phi = np.array([M[3, 3], S[2, 1], S[0, 2], S[1, 0], *six])
    with np.errstate(invalid="ignore"):  # what is not finite passes, as everywhere here
        miss = np.abs(M - spatial_inertia_matrix(phi))
    for block in np.ndindex(2, 2):
        part = tuple(slice(3 * k, 3 * k + 3) for k in block)
        if np.any(miss[part] > _FORM * np.max(np.abs(M[part]))):
            raise RobotError(
                "is no spatial inertia [[I, S(h)], [S(h)', m E]]",
                "the 6x6 matrix",
                "The angular part comes first, and the matrix is about the frame's origin",
            )
    return phi


def to_pinocchio(phi: ArrayLike, where: str = "body") -> Any:
    """Return the `pinocchio.Inertia` of ten parameters.

    Parameters
    ----------
    phi : (10,) array_like
    where : str
        Named in an error.

    Raises
    ------
    RobotError
        If phi is not finite, or has a first moment without mass: Pinocchio holds mass, centre of
        mass and the inertia about it.
    """
    import pinocchio

    pin: Any = pinocchio  # the bindings carry no types
    phi = _holdable(phi, "Pinocchio", where)
    if phi[0] == 0.0:
        return pin.Inertia(0.0, np.zeros(3), inertia_matrix(phi))
    return pin.Inertia.FromDynamicParameters(phi)


def from_pinocchio(inertia: Any) -> NDArray[np.float64]:
    """Return phi (10,) of a `pinocchio.Inertia`; inverse of `to_pinocchio`."""
    return np.array(inertia.toDynamicParameters(), dtype=float)


def to_drake(phi: ArrayLike, where: str = "body") -> SpatialInertia:
    """Return Drake's spatial inertia M_BBo_B of ten parameters about the body's origin.

    Validity is not checked. A massless body with an inertia gets a trace of mass.

    Parameters
    ----------
    phi : (10,) array_like
    where : str
        Named in an error.

    Raises
    ------
    RobotError
        If phi is not finite, or has a first moment without mass.
    """
    from pydrake.multibody.tree import SpatialInertia, UnitInertia

    phi = _holdable(phi, "Drake", where)
    mass = float(phi[0])
    if mass == 0.0:
        if not np.any(phi[4:]):
            return SpatialInertia.Zero()
        mass = _TRACE * float(np.max(np.abs(phi[4:])))
    unit = inertia_matrix(phi) / mass
    # Release builds of Drake do not check this constructor, and the next one is told not to.
    G = UnitInertia(
        Ixx=unit[0, 0],
        Iyy=unit[1, 1],
        Izz=unit[2, 2],
        Ixy=unit[0, 1],
        Ixz=unit[0, 2],
        Iyz=unit[1, 2],
    )
    com: Any = phi[1:4] / mass  # the bindings' array types fit no shape
    return SpatialInertia(mass, com, G, skip_validity_check=True)


def from_drake(inertia: SpatialInertia) -> NDArray[np.float64]:
    """Return phi (10,) of Drake's spatial inertia M_BBo_B; inverse of `to_drake`.

    The trace of mass that `to_drake` gives a massless body is part of Drake's numbers and stays.
    """
    return from_spatial_inertia_matrix(inertia.CopyToFullMatrix6())


def _holdable(phi: ArrayLike, program: str, where: str) -> NDArray[np.float64]:
    """Return a writable copy (the bindings take no other) of what a program can hold."""
    phi = np.array(phi, dtype=float)
    if phi.shape != (10,):
        raise ValueError(f"ten inertial parameters are needed, got an array of shape {phi.shape}")
    if not np.all(np.isfinite(phi)):
        raise RobotError("has inertial parameters that are not finite", where)
    if phi[0] == 0.0 and np.any(phi[1:4]):
        raise RobotError(
            f"has a first moment but no mass, which {program} cannot hold",
            where,
            "lift base parameters onto a prior with mass (BaseParameters.lift)",
        )
    return phi


def _last_ten(phi: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(phi)
    if array.ndim == 0 or array.shape[-1] != 10:
        raise ValueError(f"ten inertial parameters are needed, got an array of shape {array.shape}")
    return array


def _matrix(matrix: ArrayLike, size: int) -> NDArray[np.float64]:
    array = np.asarray(matrix, dtype=float)
    if array.shape != (size, size):
        raise ValueError(f"a {size}x{size} matrix is needed, got an array of shape {array.shape}")
    return array


def _cross(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])
