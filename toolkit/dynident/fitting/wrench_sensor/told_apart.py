"""Which unknowns of a wrench sensor's load the motion tells, with noise in the positions.

Noise of the encoders makes accelerations where nothing accelerates, and columns that look as if
they were excited: least squares then finds an inertia next to zero, and is sure of it. What the
noise makes of the columns is measured with as much noise again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from dynident.fitting.wrench_sensor.wrench_rows import WrenchProblem
from dynident.moments.factors import RANK_TOLERANCE
from dynident.robot import base_parameters

_NOISE = 0.2
"""Share of noise in what a column has of its own, beyond which its parameter is not identified.
Below it the parameter would come out smaller by so much, which is set right."""
_SHARED = 0.3
"""Share of a parameter that is not identified, in one that is, beyond which that one is not either:
noise makes up to 0.1."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ToldApart:
    """Unknowns by what the motion says of them.

    Attributes
    ----------
    kept : columns that are solved for.
    alone : (u,) bool, which unknowns are identified on their own.
    inverse : (k, k) of the triangular factor of the kept columns.
    correction : (k, k) by which their least squares is multiplied: it undoes what the noise in the
        columns takes.
    """

    kept: tuple[int, ...]
    alone: np.ndarray
    inverse: np.ndarray
    correction: np.ndarray


def noise_in_columns(problem: WrenchProblem) -> np.ndarray:
    """Return the products (6, 6, u, u) of what noise in the positions adds to the columns.

    Parameters
    ----------
    problem : the recordings.
    """
    size = problem.constants.stop
    found = np.zeros((6, 6, size, size))
    for (own, _), (other, _) in zip(problem.rows(), problem.trembling().rows(), strict=True):
        added = other - own
        flat = added.reshape(len(added), -1)
        found += (flat.T @ flat).reshape(6, size, 6, size).transpose(0, 2, 1, 3)
    return found


def told_apart(problem: WrenchProblem, R: np.ndarray, noise: np.ndarray) -> ToldApart:
    """Return the unknowns that the motion tells.

    Parameters
    ----------
    problem : for the names of its u unknowns.
    R : (m, u) factor of the columns, components in units of their errors.
    noise : (u, u) products of what is noise in these columns.
    """
    basis = base_parameters(R, problem.names, RANK_TOLERANCE)
    kept = list(basis.independent)
    scale = np.where(basis.scale > 0, basis.scale, 1.0)
    whole, shaken = R.T @ R / np.outer(scale, scale), noise / np.outer(scale, scale)
    while kept:
        part = np.ix_(kept, kept)
        shares = np.diag(np.linalg.solve(whole[part], shaken[part]))
        worst = int(np.argmax(shares))
        if shares[worst] <= _NOISE:
            break
        del kept[worst]
    part, left = np.ix_(kept, kept), [k for k in range(len(scale)) if k not in kept]
    signal = whole - shaken
    alone = np.zeros(len(scale), dtype=bool)
    alone[kept] = True
    if left:
        across = np.linalg.solve(signal[part], signal[np.ix_(kept, left)])
        alone[kept] = np.all(np.abs(across) < _SHARED, axis=1)
    triangle = np.linalg.qr(R[:, kept], mode="r")
    correction = np.linalg.solve(signal[part], whole[part])
    return ToldApart(
        kept=tuple(kept),
        alone=alone,
        inverse=solve_triangular(triangle, np.eye(len(kept))),
        correction=correction * scale[kept][None, :] / scale[kept][:, None],
    )
