"""The prior of a robot: a description, and how far its parameters may be from the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import eigh

from dynident.arguments import checked
from dynident.constraints import ParameterSpace
from dynident.errors import FitError
from dynident.inertia import distance_rows, pseudo_inertia
from dynident.nlp import Entropy
from dynident.robot import Robot

_EFFECTS = 100.0
"""Standard deviation of an effect's parameter in units of what would cause the torque noise.

Descriptions say nothing of effects; this holds them only where no data do.
"""

_THIN = 1e-4
"""Second moment relative to that of a body of the link's size, below which a link is too thin."""


@checked
@dataclass(frozen=True, eq=False)
class Prior:
    """A prior of the inertial parameters of every link.

    The weight is that of a maximum a posteriori estimate: distances are in units of `spread`,
    data in units of their noise. A prior that is off by a tenth of its spread costs as much as
    data that are off by a tenth of their noise.

    Attributes
    ----------
    robot : the description: where the prior has its centre.
    distance : "quadratic" in the pseudo-inertia of the description (`inertia.distance_rows`), or
        "entropic", the log-det divergence of pseudo-inertias, which grows without bound towards
        bodies that cannot be and therefore keeps off the boundary.
    spread : relative standard deviation of mass and second moments; that of the centre of mass is
        0.7 times as much of the radius of gyration. 0.3 suits drawings and data sheets; weighed
        links deserve 0.05, guessed ones 1.
    """

    robot: Robot
    distance: Literal["quadratic", "entropic"] = "quadratic"
    spread: float = 0.3

    def __post_init__(self) -> None:
        if self.distance not in ("quadratic", "entropic"):
            remedy = "choose quadratic or entropic"
            raise FitError(f"no distance '{self.distance}' of a prior", remedy=remedy)
        if not 0 < self.spread < np.inf:
            raise FitError(f"spread = {self.spread:g} of a prior", remedy="choose it above 0")

    def rows(self, space: ParameterSpace, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of least squares, (k, s) and (k,): |A x - b|^2 in units of the spread.

        Parameters
        ----------
        centre : (s,) where the distance is zero; only the effects count for an entropic prior.
        """
        A = np.zeros((space.size, space.size))
        if self.distance == "quadratic":
            for k, reference in enumerate(space.references):
                part = slice(10 * k, 10 * k + 10)
                A[part, part] = distance_rows(reference) / self.spread
        effects = np.arange(space.rigid, space.size)
        A[effects, effects] = 1.0 / (_EFFECTS * space.scale[effects])
        A = A[np.any(A != 0, axis=1)]
        return A, A @ centre

    def entropy(self, space: ParameterSpace) -> Entropy | None:
        """The log-det divergence, if that is the distance.

        Its centre is the description; a link that is broken, or so thin that every other body is
        infinitely far from it, is replaced by a body of its size.
        """
        if self.distance == "quadratic":
            return None
        given = space.given[: space.rigid].reshape(-1, 10)
        centres = [
            phi if _solid(phi, reference) else reference
            for phi, reference in zip(given, space.references, strict=True)
        ]
        return Entropy(self.spread**-2, np.array(centres))


def _solid(phi: np.ndarray, reference: np.ndarray) -> bool:
    """Whether a body has mass, and extent along every axis."""
    if not np.all(np.isfinite(phi)):
        return False
    P, Q = pseudo_inertia(phi), pseudo_inertia(reference)
    return bool(eigh(P, Q, eigvals_only=True)[0] > _THIN)
