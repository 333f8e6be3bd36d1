"""The ten inertial parameters of a rigid body, in the one order used everywhere.

phi = (m, mx, my, mz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz): mass, first moment and the rotational
inertia *about the frame's origin* (not about the centre of mass), all in the axes of that
frame. It is Pinocchio's order. The inverse dynamics is linear in these numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

PARAMETERS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
UNITS = ("kg", "kg m", "kg m", "kg m", *(("kg m^2",) * 6))
MEANINGS = (
    "mass",
    *(f"first moment: mass times the {x} of its centre" for x in "xyz"),
    "moment of inertia about x",
    "product of inertia, minus the integral of x y",
    "moment of inertia about y",
    "product of inertia, minus the integral of x z",
    "product of inertia, minus the integral of y z",
    "moment of inertia about z",
)
"""What each is, in the frame of its joint and about its origin."""

# Row and column in the symmetric matrix of each of the six inertia parameters.
_ROW = np.array([0, 0, 1, 0, 1, 2])
_COLUMN = np.array([0, 1, 1, 2, 2, 2])

LARGEST = 1e30
"""SI: beyond this a number is no property of a robot, and its square may overflow."""


@dataclass(frozen=True, eq=False)
class MassProperties:
    """A body's inertia in the form that descriptions and data sheets use.

    Attributes
    ----------
    mass : float
        kg.
    com : (3,) ndarray
        Centre of mass in the frame, m; NaN where the mass is zero and the first moment is not.
    inertia_com : (3, 3) ndarray
        Rotational inertia about the centre of mass, in the frame's axes, kg m^2.
    """

    mass: float
    com: NDArray[np.float64]
    inertia_com: NDArray[np.float64]


def _ten(phi: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(phi, dtype=float)
    if array.shape != (10,):
        raise ValueError(f"ten inertial parameters are needed, got an array of shape {array.shape}")
    return array


def inertia_matrix(phi: ArrayLike) -> NDArray[np.float64]:
    """Return the (3, 3) rotational inertia about the frame's origin, kg m^2."""
    six = _ten(phi)[4:]
    matrix = np.empty((3, 3))
    matrix[_ROW, _COLUMN] = six
    matrix[_COLUMN, _ROW] = six
    return matrix


def point_inertia(place: ArrayLike) -> NDArray[np.float64]:
    """Return the (3, 3) inertia about the origin of a unit mass at a place (3,) in m, m^2.

    Of squares of distances from the axes: of a place far along one of them, |place|^2 less the
    square along it keeps no digit.
    """
    x, y, z = np.asarray(place, dtype=float)
    xx, yy, zz = x * x, y * y, z * z
    return np.array(
        [
            [yy + zz, -x * y, -x * z],
            [-x * y, xx + zz, -y * z],
            [-x * z, -y * z, xx + yy],
        ]
    )


def from_com(mass: float, com: ArrayLike, inertia_com: ArrayLike) -> NDArray[np.float64]:
    """Return phi (10,) from mass, centre of mass and inertia about the centre of mass.

    Parameters
    ----------
    mass : float
        kg; may be zero, negative or NaN, which a validity check reads later.
    com : (3,) array_like
        Centre of mass in the frame, m.
    inertia_com : (3, 3) array_like
        About the centre of mass, in the frame's axes, kg m^2.
    """
    com = np.asarray(com, dtype=float)
    shift = mass * point_inertia(com)
    about_origin = np.asarray(inertia_com, dtype=float) + shift
    return np.concatenate([[mass], mass * com, about_origin[_ROW, _COLUMN]])


def to_com(phi: ArrayLike) -> MassProperties:
    """Return mass, centre of mass and inertia about the centre of mass; inverse of `from_com`.

    A massless body without a first moment has its centre of mass at the origin; one *with* a
    first moment has none, and gets NaN.
    """
    phi = _ten(phi)
    mass, moment = float(phi[0]), phi[1:4]
    if mass == 0.0:
        com = np.zeros(3) if not np.any(moment) else np.full(3, np.nan)
    else:
        com = moment / mass
    shift = mass * point_inertia(com)
    return MassProperties(mass, com, inertia_matrix(phi) - shift)


def pseudo_inertia(phi: ArrayLike) -> NDArray[np.float64]:
    """Return the (4, 4) pseudo-inertia [[Sigma, h], [h', m]], Sigma = tr(I)/2 E - I.

    It is positive semidefinite exactly when some mass distribution has these parameters
    (Wensing, Kim, Slotine, "Linear matrix inequalities for physically consistent inertial
    parameter identification", RA-L 2018).
    """
    phi = _ten(phi)
    inertia = inertia_matrix(phi)
    matrix = np.empty((4, 4))
    matrix[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    matrix[:3, 3] = matrix[3, :3] = phi[1:4]
    matrix[3, 3] = phi[0]
    return matrix


def frame_change(R: ArrayLike, p: ArrayLike) -> NDArray[np.float64]:
    """Return the (10, 10) map that gives phi in frame A from phi in frame B.

    Parameters
    ----------
    R : (3, 3) array_like
        Orientation of B in A: x_A = R x_B + p.
    p : (3,) array_like
        Origin of B in A, m.
    """
    R = np.asarray(R, dtype=float)
    p = np.asarray(p, dtype=float)
    change = np.zeros((10, 10))
    change[0, 0] = 1.0
    change[1:4, 0] = p
    change[1:4, 1:4] = R
    # Inertia about A's origin: R I R' + terms in the rotated first moment h = R h_B and the mass,
    # I_A = R I_B R' + [2 (p.h) E - p h' - h p'] + m [(p.p) E - p p'].
    change[4:, 0] = point_inertia(p)[_ROW, _COLUMN]
    for k in range(3):
        h = R[:, k]
        cross = 2.0 * (p @ h) * np.eye(3) - np.outer(p, h) - np.outer(h, p)
        change[4:, 1 + k] = cross[_ROW, _COLUMN]
    for k in range(6):
        unit = np.zeros(6)
        unit[k] = 1.0
        basis = np.zeros((3, 3))
        basis[_ROW, _COLUMN] = unit
        basis[_COLUMN, _ROW] = unit
        change[4:, 4 + k] = (R @ basis @ R.T)[_ROW, _COLUMN]
    return change
