"""The verb: what hangs on a wrench sensor, and the constants of the sensor, by least squares."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular

from dynident.errors import FitError
from dynident.fitting.least_squares import sources_of
from dynident.fitting.linear_solution import require_rows
from dynident.fitting.loads import IdentifiedLoad, SolvedParts, identified_load
from dynident.fitting.sampling import Sampled
from dynident.fitting.uncertainty.scattered_errors import (
    ScatteredErrors,
    SolvedRows,
    scattered_errors,
)
from dynident.fitting.wrench_sensor.sensed_loads import SensedLoads
from dynident.fitting.wrench_sensor.told_apart import ToldApart, noise_in_columns, told_apart
from dynident.fitting.wrench_sensor.wrench_rows import WrenchProblem
from dynident.moments.factors import TriangularFactors, factorise
from dynident.threads import single_threaded


@single_threaded
def fit_wrench(problem: WrenchProblem) -> SensedLoads:
    """Weigh what hangs on a wrench sensor.

    Least squares of the wrench over the ten parameters of each body and six constants of the
    sensor, each component weighted by its residual. Whether the sensor records what moves the load
    or what the load does to it is told by the sign of the mass.

    Parameters
    ----------
    problem : the robot that moves the sensor, the recordings, and what is known of loads.

    Returns
    -------
    Each load, the constants, and how far either is known.

    Raises
    ------
    FitError
        If there is no recording, too few rows, or no load at all.
    """
    if not problem.dataset.recordings:
        raise FitError("no recording to fit", remedy='mark some recordings use = "train"')
    if all(load.is_known for load in problem.bodies):
        what, remedy = "every load is known", "leave out what is to be identified"
        raise FitError(what, f"wrench.{problem.frame}", remedy)
    whole = _solved(problem.as_one_body())
    mass = whole.values[0]
    if not whole.told.alone[0]:
        what = "nothing weighs on the sensor: the recordings do not tell a mass from its constants"
        raise FitError(what, f"wrench.{problem.frame}", "turn the sensor about level axes")
    if mass < 0:
        problem = replace(problem, records="what the load does")
    found = whole
    if len(problem.bodies) > 1 or problem.loads or mass < 0:
        found = _solved(problem)
    return _assembled(problem, found, _errors(problem, found))


@dataclass(frozen=True, eq=False, kw_only=True)
class _Solution:
    """Values (u,) of the unknowns, those that are not solved for at zero.

    `plain` are those of least squares, before what noise in the columns takes is put right;
    `mixing` (6, 6) makes the errors of components independent.
    """

    values: np.ndarray
    plain: np.ndarray
    told: ToldApart
    factors: TriangularFactors
    mixing: np.ndarray


def _solved(problem: WrenchProblem) -> _Solution:
    trembles = noise_in_columns(problem)
    mixing = np.eye(6)
    for last in (False, True):
        factors = factorise(problem.rows(mixing))
        require_rows(factors)
        R = factors.pooled(np.ones(6))
        noise = np.tensordot(mixing.T @ mixing, trembles, axes=2)
        told = told_apart(problem, R[:, :-1], noise)
        kept = list(told.kept)
        values, plain = np.zeros((2, factors.size))
        Q, triangle = np.linalg.qr(R[:, kept])
        plain[kept] = solve_triangular(triangle, Q.T @ R[:, -1])
        values[kept] = told.correction @ plain[kept]
        if not last:
            mixing = _apart(problem, plain)
    found = _Solution(values=values, plain=plain, told=told, factors=factors, mixing=mixing)
    return found


def _apart(problem: WrenchProblem, values: np.ndarray) -> np.ndarray:
    """Mixing (6, 6) by which what is left of the components becomes independent, of variance one.

    Noise of the positions makes errors of force and moment that go together.
    """
    left, whole, count = np.zeros((6, 6)), np.zeros(6), 0
    for block, wrench in problem.rows():
        rest = wrench - block @ values
        left += rest.T @ rest
        whole += np.sum(wrench**2, axis=0)
        count += len(wrench)
    # What is exact counts no more than a billion times what is not.
    least = np.diag(1e-18 * np.maximum(whole, 1e-18 * whole.max()))
    return np.linalg.inv(np.linalg.cholesky((left + least) / count))


def _errors(problem: WrenchProblem, found: _Solution) -> ScatteredErrors:
    kept = list(found.told.kept)

    def rows_of(sampled: Sampled) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        for block, wrench in problem.rows_of(sampled, found.mixing):
            # Of the corrected values noise in the columns would pull every block the same way.
            yield block[:, :, kept], wrench - block @ found.plain

    solved = SolvedRows(
        weights=np.ones(6), inverse=found.told.inverse, squares=found.factors.torque_norms**2
    )
    errors = scattered_errors(problem.samples(), rows_of, solved)
    turn = found.told.correction
    return replace(errors, covariance=turn @ errors.covariance @ turn.T)


def _assembled(problem: WrenchProblem, found: _Solution, errors: ScatteredErrors) -> SensedLoads:
    size, kept = len(found.values), list(found.told.kept)
    covariance = np.zeros((size, size))
    covariance[np.ix_(kept, kept)] = errors.covariance
    values = np.where(found.told.alone, found.values, np.nan)
    constants = problem.constants
    sigma = np.sqrt(np.clip(np.diag(covariance)[constants], 0.0, None))
    left, whole = _sizes(problem, found.values)
    return SensedLoads(
        frame=problem.frame,
        records=problem.records,
        loads=tuple(
            _identified(problem, number, found, covariance) for number in range(len(problem.bodies))
        ),
        constants=values[constants],
        sigma=np.where(found.told.alone[constants], sigma, np.nan),
        residual_std=left,
        wrench_rms=whole,
        lacking=errors.lacking,
        rows=errors.errors.rows,
        effective_rows=errors.errors.effective_rows,
        sources=sources_of(problem.dataset),
    )


def _sizes(problem: WrenchProblem, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviation of what is left of each component, and root mean square of it, (6,)."""
    left, whole, count = np.zeros(6), np.zeros(6), 0
    for block, wrench in problem.rows():
        left += np.sum((wrench - block @ values) ** 2, axis=0)
        whole += np.sum(wrench**2, axis=0)
        count += len(wrench)
    return np.sqrt(left / count), np.sqrt(whole / count)


def _identified(
    problem: WrenchProblem, number: int, found: _Solution, covariance: np.ndarray
) -> IdentifiedLoad:
    load, parts, own = problem.bodies[number], problem.splits[number], problem.slices[number]
    return identified_load(
        load,
        parts,
        SolvedParts(
            values=found.values[own],
            covariance=covariance[own, own],
            alone=found.told.alone[own],
        ),
        problem.placement(load),
    )
