"""From base parameters to standard parameters."""

from __future__ import annotations

import numpy as np

from dynident.robot.base_parameters import BaseParameters
from dynident.robot.tree import Array

_MASS_STAYS = 1e-3
"""Weight of a mass against the other parameters: where it is not told, it stays as described."""
_NEXT_TO_NOTHING = 1e-6
"""Share of the typical mass below which a described mass cannot carry a first moment."""


def nearest_parameters(base: BaseParameters, given: Array, wanted: Array) -> Array:
    """Return the standard parameters nearest to a description, masses kept where they can be.

    The bodies need not be physically possible: every base value is kept. A body without a mass gets
    one, so that it can carry a first moment.

    Parameters
    ----------
    base : of the robot.
    given : (10 n,) the description's parameters of the moving bodies.
    wanted : (b,) base values.

    Returns
    -------
    (10 n,) parameters of the moving bodies, each in its joint's frame.
    """
    theta = np.array(given)
    masses = theta[0::10]
    known = masses[np.isfinite(masses) & (masses > 0)]
    typical = float(np.median(known)) if known.size else 1.0
    theta[0::10] = np.where(masses > _NEXT_TO_NOTHING * typical, masses, typical)
    theta = np.where(np.isfinite(theta), theta, 0.0)
    weight = np.divide(1.0, base.scale, out=np.zeros_like(base.scale), where=base.scale > 0)
    weight[0::10] *= _MASS_STAYS
    B = base.combination * weight
    correction = np.linalg.lstsq(B, wanted - base.coordinates(theta), rcond=None)[0]
    theta = np.asarray(theta + weight * correction, dtype=float)
    # One step of refinement puts what rounding is left into the independent parameters.
    theta[list(base.independent)] += wanted - base.coordinates(theta)
    return theta
