"""Least squares on data directly under constraints, as one program."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field, replace
from typing import ClassVar, Literal

import numpy as np

from dynident.arguments import checked
from dynident.constraints import ParameterSpace, Within
from dynident.errors import FitError
from dynident.fitting.consistent.active import active_set
from dynident.fitting.consistent.metric import Metric
from dynident.fitting.consistent.posterior import prior_centre, sized
from dynident.fitting.consistent.prior import Prior
from dynident.fitting.consistent.programs import Solver, require_solver, solve
from dynident.fitting.consistent.projection import project
from dynident.fitting.estimate import Estimate
from dynident.fitting.given import prior_model
from dynident.fitting.least_squares import LeastSquares, estimate_of
from dynident.fitting.linear_solution import solve_factors, solve_weighted
from dynident.fitting.sampling import rows
from dynident.fitting.uncertainty.row_errors import row_errors
from dynident.model import Model
from dynident.moments.factors import TriangularFactors, factorise
from dynident.nlp import Problem
from dynident.recording import Dataset
from dynident.robot import Robot
from dynident.tables import percent
from dynident.threads import single_threaded

_DIGITS = 1e-5  # of a torque's root mean square, that its noise is at least


@checked
@dataclass(frozen=True, eq=False)
class Constrained:
    """Least squares under constraints, with a prior where the data leave parameters open.

    Minimises the squared torque residual, each joint in units of its noise, plus the squared
    distance from the prior in units of its spread, over the inertial parameters of all links
    within a set.

    Attributes
    ----------
    within : default: fully consistent links.
    prior : default: the model's robot description.
    solver : "conic" (Clarabel, the optimum) or "nlp" (Ipopt, certified by the conic bound).
    weighting, errors : as of `LeastSquares`, from the residual of unconstrained least squares.
    """

    within: Within = field(default_factory=Within)
    prior: Robot | Prior | None = None
    solver: Solver = "conic"
    _: KW_ONLY
    weighting: Literal["joint", "none"] = "joint"
    errors: Literal["correlated", "independent"] = "correlated"
    name: ClassVar[str] = "constrained least squares"

    def __post_init__(self) -> None:
        require_solver(self.solver)

    @single_threaded
    def fit(self, model: Model, dataset: Dataset) -> Estimate:
        """Fit a model whose shape parameters are fixed.

        Raises
        ------
        FitError
            If nothing satisfies the constraints, or the solver fails; and as `LeastSquares`.
        """
        prior = self.prior if isinstance(self.prior, Prior) else Prior(self.prior or model.robot)
        model = prior_model(model, prior.robot)
        free = LeastSquares(self.weighting, "independent").fit(model, dataset)
        # Columns that depend on the fit are taken where least squares converged.
        model = free.model
        factors = factorise(rows(model, dataset, free.values))
        size = factors.torque_norms / np.sqrt(np.maximum(factors.counts, 1))
        # What is fitted to more digits than a prior can be weighed against is no measured torque.
        std = np.maximum(free.torque_std, _DIGITS * size)
        if self.weighting == "none":
            std = np.full(len(std), np.sqrt(np.mean(std**2)))
        R = factors.pooled(1.0 / std)
        p = model.size
        space = ParameterSpace.of(model)
        data = R[:p, :p] @ space.combination
        effects = free.values[len(model.base.independent) :]
        x_free = np.concatenate([space.given[: space.rigid], effects])
        space = sized(space, data, factors.rows, x_free)
        centre, notes = prior_centre(space, x_free)
        held, held_at = prior.rows(space, centre)
        problem = Problem(
            space,
            np.vstack([data, held]),
            np.concatenate([R[:p, p], held_at]),
            self.within,
            entropy=prior.entropy(space),
        )
        answer = solve(problem, self.solver)
        active = active_set(problem, answer.x)
        C = space.combination
        values = C @ answer.x
        covariance = active.covariance
        if self.errors == "correlated":
            weighted = solve_weighted(model, factors, 1.0 / std)
            found = row_errors(model, dataset, free.values, weighted)
            # Rows that share noise say less than as many independent ones; the prior says the same.
            more = C.T @ found.meat @ C - data.T @ data
            covariance = covariance + covariance @ more @ covariance
        solution = replace(
            solve_factors(model, factors, self.weighting),
            values=values,
            covariance=C @ covariance @ C.T,
        )
        estimate = estimate_of(self.name, self.weighting, model, dataset, factors, solution)
        links = {b: answer.x[10 * k : 10 * k + 10] for k, b in enumerate(space.bodies)}
        estimate = replace(
            estimate,
            status=str(answer.certificate.status),
            links=links,
            certificate=answer.certificate,
        )
        compared = _compared(estimate, free, factors, prior, self.within)
        return replace(estimate, notes=(*estimate.notes, *notes, active.sentence, *compared))


def _compared(
    estimate: Estimate, free: Estimate, factors: TriangularFactors, prior: Prior, within: Within
) -> tuple[str, ...]:
    """The fit beside what fitting first and projecting later would have given."""
    found = [("this fit", estimate.error), ("without constraints", free.error)]
    ways = (
        ("fitted first, then projected under X'X", lambda: Metric.of_estimate(free)),
        ("fitted first, then projected link by link without data", lambda: None),
    )
    for name, metric in ways:
        try:
            base = replace(free, rows=0) if metric() is None else free
            later = project(base, prior, metric(), within)
        except FitError as error:
            return (f"Fit first and project later: {error}",)
        residuals = factors.residual_norms(later.values)
        error = float(np.linalg.norm(residuals) / np.linalg.norm(factors.torque_norms))
        found.append((name, error))
    words = "; ".join(f"{name} {percent(error, 3)}" for name, error in found)
    return (f"Torque error on the data of the fit: {words}.",)
