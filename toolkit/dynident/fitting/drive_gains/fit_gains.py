"""The verb: gains of drives, and loads, from recordings in the unit of the drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynident.errors import FitError
from dynident.fitting.drive_gains.drive_gains import DriveGains
from dynident.fitting.drive_gains.gain_covariance import GainCovariance, gain_covariance
from dynident.fitting.drive_gains.gain_rows import GainProblem
from dynident.fitting.drive_gains.gain_scales import GainScales, as_described, gain_scales
from dynident.fitting.drive_gains.gain_solution import GainSolution, solve_gains
from dynident.fitting.least_squares import sources_of
from dynident.fitting.loads import (
    IdentifiedLoad,
    Load,
    SolvedParts,
    identified_load,
    placement,
)
from dynident.moments.factors import TriangularFactors
from dynident.threads import single_threaded

_ROUNDS = 10  # of columns that depend on the model's own values
_SETTLED = 1e-6


@single_threaded
def fit_drive_gains(problem: GainProblem, unit: str = "A") -> DriveGains:
    """Tell the gains of drives from the inertias that they move.

    The currents i of a joint are (torque) / gain: least squares of i over the gains, the model's
    parameters and the unknown ones of loads, each joint weighted by its residual. What fixes the
    scale is a load that is known, or a gain; without them the description's torque chooses one.

    Parameters
    ----------
    problem : the model, the recordings, what is known of gains and loads.
    unit : of the recorded torques.

    Returns
    -------
    Gains, what is known of each, and the loads.

    Raises
    ------
    FitError
        If there is no recording, too few equations, or the search does not converge.
    StudyError
        If a load or a gain does not fit the robot.
    """
    if not problem.dataset.recordings:
        raise FitError("no recording to fit", remedy='mark some recordings use = "train"')
    factors = problem.factors()
    solution = solve_gains(problem, factors)
    for _ in range(_ROUNDS if problem.model.needs_values else 0):
        before = solution.values
        at = problem.model.at(before[: problem.model.size])
        problem = replace(problem, model=at)
        factors = problem.factors(before)
        solution = solve_gains(problem, factors)
        if np.linalg.norm(solution.values - before) <= _SETTLED * np.linalg.norm(before):
            break
    scales = gain_scales(problem, factors, solution)
    solution = as_described(problem, factors, solution, scales)
    covariance = gain_covariance(problem, factors, solution, scales)
    return _assembled(problem, factors, solution, scales, covariance, unit=unit)


def _assembled(
    problem: GainProblem,
    factors: TriangularFactors,
    solution: GainSolution,
    scales: GainScales,
    found: GainCovariance,
    *,
    unit: str,
) -> DriveGains:
    robot, p = problem.model.robot, problem.model.size
    groups = tuple(tuple(robot.names[j] for j in group) for group in scales.groups)
    per = "" if unit == "N m" else f"/{unit}"
    open_scale = tuple(name for group in groups for name in group)
    return DriveGains(
        joints=robot.names,
        unit=unit,
        units=tuple(f"{one}{per}" for one in robot.torque_units),
        gains=solution.gains,
        given=~problem.free,
        groups=groups,
        covariance=found.matrix,
        values=solution.values[:p],
        residual_std=solution.residual_std,
        joint_errors=solution.residual_std * np.sqrt(factors.counts) / factors.torque_norms,
        lacking=found.lacking,
        loads=tuple(
            _identified(problem, solution, found, load, open_scale) for load in problem.loads
        ),
        rows=found.errors.rows,
        effective_rows=found.errors.effective_rows,
        sources=sources_of(problem.dataset),
    )


def _identified(
    problem: GainProblem,
    solution: GainSolution,
    found: GainCovariance,
    load: Load,
    open_scale: Sequence[str],
) -> IdentifiedLoad:
    n, part = len(solution.gains), problem.slices[load.name]
    own = slice(n + part.start, n + part.stop)
    solved = SolvedParts(
        values=solution.values[part],
        covariance=found.matrix[own, own],
        alone=_told_apart(solution)[part],
        scale=tuple(open_scale),
    )
    where = placement(load, problem.model.robot)
    return identified_load(load, problem.splits[load.name], solved, where)


def _told_apart(solution: GainSolution) -> np.ndarray:
    """Which linear parameters are identified on their own, (size,) bool."""
    basis = solution.basis
    alone = np.zeros(len(solution.values), dtype=bool)
    alone[list(basis.independent)] = np.count_nonzero(basis.told, axis=1) == 1
    return alone
