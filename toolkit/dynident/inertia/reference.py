"""A reference body, possible and of the size of a given one: the unit of inertias' distances."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dynident.inertia.parameters import from_com, pseudo_inertia, to_com

_THINNEST = 0.1
"""Least radius of gyration along any axis, relative to the body's length.

A data sheet that calls a rod infinitely thin is not that sure of it: distances to a singular
body would be infinite.
"""

# The pseudo-inertia per unit of each of the ten parameters.
_BASIS = np.array([pseudo_inertia(unit) for unit in np.eye(10)])


def reference_body(phi: ArrayLike, mass: float, length: float) -> NDArray[np.float64]:
    """Return the parameters (10,) of a consistent body of the size of a given one.

    It keeps what is possible of the given one: a positive mass, a centre of mass within reach,
    and the second moments of mass, each radius of gyration brought between a tenth of the length
    and the length. Turning the frame, or changing the units, turns or changes the result alike.

    Parameters
    ----------
    phi : (10,) array_like
        The given parameters, consistent or not; NaN counts as unknown.
    mass : float
        kg, positive: taken where the given mass is not positive.
    length : float
        m, positive: the body's extent.
    """
    phi = np.asarray(phi, dtype=float)
    com, spread = np.zeros(3), np.zeros((3, 3))
    if np.isfinite(phi[0]) and phi[0] > 0:
        mass = float(phi[0])
        properties = to_com(phi)
        if np.all(np.isfinite(properties.com)) and np.linalg.norm(properties.com) <= 2 * length:
            com = properties.com
            if np.all(np.isfinite(properties.inertia_com)):
                inertia = properties.inertia_com
                spread = (0.5 * np.trace(inertia) * np.eye(3) - inertia) / mass
    values, axes = np.linalg.eigh(spread)
    values = np.clip(values, (_THINNEST * length) ** 2, length**2)
    second = mass * (axes * values) @ axes.T
    return from_com(mass, com, np.trace(second) * np.eye(3) - second)


def distance_rows(reference: ArrayLike) -> NDArray[np.float64]:
    """Return the rows L (10, 10) of the quadratic distance |L (phi - phi_0)| between two bodies.

    |L d|^2 = tr(P^-1 D P^-1 D), D the pseudo-inertia of the difference d and P that of the
    reference: second-order the same as twice the log-det divergence of pseudo-inertias, and like
    it independent of units and of the frame (Lee, Wensing, Park, "Geometric robot dynamic
    identification: a convex programming approach", T-RO 2020). A body whose parameters all differ
    by a tenth from the reference is at distance 0.2.

    Parameters
    ----------
    reference : (10,) array_like
        With a positive definite pseudo-inertia.
    """
    factor = np.linalg.cholesky(pseudo_inertia(reference))
    rows, columns = np.tril_indices(4)
    weight = np.where(rows == columns, 1.0, np.sqrt(2.0))
    root = np.linalg.inv(factor)
    whitened = root @ _BASIS @ root.T
    return weight[:, None] * whitened[:, rows, columns].T
