"""The nearest consistent body to ten given parameters: what makes a link consistent, and least."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dynident.constraints.sets import Consistency, Within
from dynident.constraints.space import ParameterSpace, body_scale
from dynident.errors import FitError
from dynident.inertia import PARAMETERS, UNITS, distance_rows, reference_body
from dynident.nlp.conic import solve_conic
from dynident.nlp.problem import Problem


def nearest_body(
    phi: ArrayLike, length: float, consistency: Consistency = "full", mass: float = 1.0
) -> np.ndarray:
    """Return the consistent parameters (10,) nearest to given ones.

    Nearest in `inertia.distance_rows` of a body of their size, so that neither units nor frame
    decide. Consistent parameters come back as they are.

    Parameters
    ----------
    phi : (10,) array_like
        Finite.
    length : float
        m, extent of the body.
    consistency : see `Consistency`.
    mass : float
        kg, the size of the mass where the given one is not positive.

    Raises
    ------
    FitError
        If phi is not finite, or the conic solver fails.
    """
    phi = np.array(phi, dtype=float)
    if phi.shape != (10,) or not np.all(np.isfinite(phi)):
        raise FitError("ten finite inertial parameters are needed", "body")
    reference = reference_body(phi, mass, length)
    rows = distance_rows(reference)
    free = np.full(10, np.inf)
    space = ParameterSpace(
        names=PARAMETERS,
        units=UNITS,
        bodies=("body",),
        references=reference[None],
        lower=-free,
        upper=free,
        combination=np.eye(10),
        given=phi,
        scale=body_scale(reference),
    )
    problem = Problem(space, rows, rows @ phi, Within(consistency))
    if problem.feasible(phi):
        return phi
    solution = solve_conic(problem)
    if not solution.status.ok:
        raise FitError(f"no nearest consistent body was found ({solution.status})", "body")
    return problem.retracted(solution.x)
