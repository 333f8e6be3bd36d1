"""Which gains the data fix, and which they know only relative to one another.

A change du of the logarithms of the gains shows in the residual as far as no change of the linear
parameters makes up for it. Where nothing fixes a scale, du = (1, ..., 1) never shows: the robot of
twice the masses draws the same currents through twice the gains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.fitting.drive_gains.gain_rows import GainProblem
from dynident.fitting.drive_gains.gain_solution import GainSolution, WeightedFactors, at_gains
from dynident.moments.factors import RANK_TOLERANCE, TriangularFactors

UNSEEN = 1e-6
"""Share of the joints' torque below which what a change of gains shows is rounding. What is above
it and yet drowned in noise has a large standard deviation, and needs no rule."""
_EQUAL = 1e-4
"""Difference of two gains' shares in unseen changes, relative to the largest, that is rounding."""


@dataclass(frozen=True, eq=False, kw_only=True)
class GainScales:
    """What of the gains the data leave open.

    Attributes
    ----------
    groups : joints (by number) whose gains are known relative to one another only, in groups; a
        group of one shares no inertia with a joint whose gain is known, or nothing of its is seen.
    unseen : (d, n) changes of the logarithms of the gains that no current shows.
    shares : (d,) what of the torque is left of them, at most `UNSEEN`; and of the first seen one,
        (d + 1,) where there is one.
    """

    groups: tuple[tuple[int, ...], ...]
    unseen: np.ndarray
    shares: np.ndarray

    @property
    def fixed_by_groups(self) -> bool:
        """Whether a scale of each group is all that is open, as it is for any usual robot."""
        return len(self.groups) == len(self.unseen)


def gain_scales(
    problem: GainProblem, factors: TriangularFactors, solution: GainSolution
) -> GainScales:
    """Return what is open at a solution.

    Parameters
    ----------
    problem, factors : as of `solve_gains`.
    solution : where the columns are taken.
    """
    free = np.flatnonzero(problem.free)
    n = len(solution.gains)
    if not len(free):
        return GainScales(groups=(), unseen=np.zeros((0, n)), shares=np.zeros(0))
    weighted = WeightedFactors(problem, factors, solution.weights)
    kappa = 1.0 / solution.gains
    found = weighted.linear(kappa)[0]
    size = np.linalg.norm(weighted.gain_columns(found, kappa), axis=0)[free]
    size = np.maximum(size, np.finfo(float).tiny)
    projected = weighted.projected(kappa, kappa)[1][:, free] / size
    _, shares, V = np.linalg.svd(projected, full_matrices=False)
    count = int(np.count_nonzero(shares <= UNSEEN))
    unseen = np.zeros((count, n))
    unseen[:, free] = V[len(V) - count :] / size
    unseen /= np.maximum(np.linalg.norm(unseen, axis=1, keepdims=True), np.finfo(float).tiny)
    return GainScales(groups=_groups(unseen), unseen=unseen, shares=shares[::-1][: count + 1])


def _groups(unseen: np.ndarray) -> tuple[tuple[int, ...], ...]:
    """Joints that any unseen change scales, those that it always scales alike together."""
    if not len(unseen):
        return ()
    # Orthonormal, so that no choice of the basis decides what is large.
    parts = np.linalg.qr(unseen.T)[0]
    largest = float(np.linalg.norm(parts, axis=1).max())
    groups: list[list[int]] = []
    for j, part in enumerate(parts):
        if np.linalg.norm(part) <= _EQUAL * largest:
            continue
        for group in groups:
            if np.linalg.norm(part - parts[group[0]]) <= _EQUAL * largest:
                group.append(j)
                break
        else:
            groups.append([j])
    return tuple(tuple(group) for group in groups)


def as_described(
    problem: GainProblem, factors: TriangularFactors, solution: GainSolution, scales: GainScales
) -> GainSolution:
    """Return the solution whose open scales are those at which the description's torque fits best.

    Parameters
    ----------
    problem, factors : as of `solve_gains`.
    solution : of which nothing changes that currents show.
    scales : what they do not.
    """
    if not scales.groups or not scales.fixed_by_groups:
        return solution
    rank = problem.model.base.rank
    given, gains = problem.given_values()[:rank], np.array(solution.gains)
    for group in scales.groups:
        R = (
            factors.R[list(group)]
            * (solution.weights[list(group)] / np.abs(solution.gains[list(group)]))[:, None, None]
        )
        # A rotor that turns as a body does is not described: what both can make tells no scale.
        ours, described = (
            _beside(R[:, :, rank : problem.model.size], R[:, :, :rank] @ one)
            for one in (solution.values[:rank], given)
        )
        square = float(np.sum(ours**2))
        scale = float(np.sum(ours * described)) / square if square > 0 else 0.0
        # A robot of negative masses draws the same currents: the sign is a scale like any other.
        if scale != 0 and np.isfinite(scale):
            gains[list(group)] *= scale
    return at_gains(problem, factors, solution, gains)


def _beside(columns: np.ndarray, torque: np.ndarray) -> np.ndarray:
    """What of a torque (g, m) of some joints columns (g, m, k) cannot make, (g m,)."""
    A, b = columns.reshape(torque.size, -1), torque.ravel()
    size = np.linalg.norm(A, axis=0)
    A = A[:, size > 0] / size[size > 0]
    return b - A @ np.linalg.lstsq(A, b, rcond=RANK_TOLERANCE)[0]
