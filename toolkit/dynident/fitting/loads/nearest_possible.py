"""The body that can exist and is nearest to what was identified, by its errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.constraints import ParameterSpace, Within, body_scale
from dynident.fitting.consistent.programs import solve
from dynident.inertia import PARAMETERS, UNITS, reference_body
from dynident.nlp import Certificate, Problem

_LENGTH = 0.1  # m, of a load of which nothing says how large it is
_HELD = 1e-6  # of a body's size: sigma of what was given
_RANGE = 1e-7  # of the largest sigma, in units of that size: what is less is as good as given


@dataclass(frozen=True, eq=False, kw_only=True)
class PossibleLoad:
    """A body that can exist.

    Attributes
    ----------
    phi : (10,) in the frame of what it is nearest to.
    distance : from that, in standard deviations: the root of (difference)' C^-1 (difference).
    certificate : that none is nearer.
    """

    phi: np.ndarray
    distance: float
    certificate: Certificate


def nearest_possible(phi: np.ndarray, covariance: np.ndarray) -> PossibleLoad:
    """Project parameters onto those that some mass distribution has, under their covariance.

    Parameters
    ----------
    phi : (10,) finite.
    covariance : (10, 10); what has no variance hardly moves.

    Returns
    -------
    The nearest body whose pseudo-inertia is positive semidefinite.

    Raises
    ------
    FitError
        If the program is not solved.
    """
    mass = phi[0] if phi[0] > 0 else max(abs(phi[0]), 1e-3)
    reach = np.sqrt(max(abs(phi[4] + phi[6] + phi[9]) / (2 * mass), 1e-6))
    length = float(np.clip(reach, 1e-3, None)) if np.any(phi[1:]) else _LENGTH
    reference = reference_body(phi, mass, length)
    scale = body_scale(reference)
    # Nothing is known better than so much of its size, or rounding would decide. Of a given centre
    # combinations of parameters are known, and none of them alone.
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    least = max(_HELD**2, _RANGE**2 * values[-1])
    root = (vectors / np.sqrt(np.maximum(values, least))).T / scale
    none = np.full(10, np.inf)
    space = ParameterSpace(
        names=PARAMETERS,
        units=UNITS,
        bodies=("load",),
        references=reference[None, :],
        lower=-none,
        upper=none,
        combination=np.eye(10),
        given=phi,
        scale=scale,
    )
    found = solve(Problem(space, root, root @ phi, Within()), "conic")
    return PossibleLoad(
        phi=found.x,
        distance=float(np.linalg.norm(root @ (found.x - phi))),
        certificate=found.certificate,
    )
