"""How far mass is spread, and how far the geometry of a link lets it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dynident.inertia import to_com
from dynident.robot.hull import Hull

Array = NDArray[np.float64]

IMPOSSIBLE_SPREAD = 10.0
"""Second moment of mass over the largest that the geometry allows in any direction, from which on
the rule is broken. Shapes are often simplified (a rod or a few balls for a link, no motor, no
cable), so that good descriptions exceed them severalfold; by more than this it is units or digits.
Across a thin shape next to nothing is allowed: an excess there is compared with its long side."""


def second_moment(phi: Array) -> Array:
    """Return the (3, 3) second moment of mass about the centre of mass, kg m^2."""
    return spread_of(to_com(phi).inertia_com)


def spread_of(inertia: Array) -> Array:
    """Return the second moment of mass that has this rotational inertia (both (3, 3))."""
    return 0.5 * np.trace(inertia) * np.eye(3) - inertia


def worst_spread(phi: Array, hull: Hull) -> tuple[float, Array]:
    """Return the largest excess of spread over what a hull allows, kg m^2, and its direction."""
    directions, own, allowed = _along_directions(phi, hull)
    excess = own - allowed
    worst = int(np.argmax(excess))
    return float(excess[worst]), directions[worst]


def relative_spread(phi: Array, hull: Hull) -> float:
    """Largest second moment in any direction over the largest that is allowed in any."""
    _, own, allowed = _along_directions(phi, hull)
    return float(np.max(own) / np.max(allowed))


def _along_directions(phi: Array, hull: Hull) -> tuple[Array, Array, Array]:
    """Directions (k, 3) in which spread is judged, second moments and bounds in them, (k,)."""
    spread = second_moment(phi)
    _, principal = np.linalg.eigh(spread)
    directions = np.vstack([np.eye(3), principal.T, hull.normals])
    low, high = hull.reach(directions)
    along = directions @ to_com(phi).com
    own = np.einsum("ki,ij,kj->k", directions, spread, directions)
    return directions, own, phi[0] * (high - along) * (along - low)


def axis_name(direction: Array) -> str:
    """Return "x", "y" or "z" where a direction is (nearly) an axis, else its coordinates."""
    axis = int(np.argmax(np.abs(direction)))
    if abs(direction[axis]) > 0.999:
        return "xyz"[axis]
    return "({})".format(" ".join(f"{x:.2g}" for x in direction))
