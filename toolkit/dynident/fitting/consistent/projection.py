"""Projection: the nearest possible robot, under the metric of what the data know."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dynident.arguments import checked
from dynident.constraints import ParameterSpace, Within
from dynident.errors import FitError
from dynident.fitting.consistent.active import active_set
from dynident.fitting.consistent.metric import Metric
from dynident.fitting.consistent.posterior import mapping_of, posterior
from dynident.fitting.consistent.prior import Prior
from dynident.fitting.consistent.programs import (
    CertifiedPoint,
    Solver,
    require_solver,
    solve,
    solve_apart,
    trivial,
)
from dynident.fitting.estimate import Estimate
from dynident.fitting.given import given_estimate, prior_model
from dynident.inertia import distance_rows, margins
from dynident.model import Model
from dynident.nlp import Certificate, Problem
from dynident.robot import Robot
from dynident.robot.patching import write
from dynident.tables import Shown, Table, number
from dynident.threads import single_threaded


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Projection(Shown):
    """The nearest estimate within a set.

    Attributes
    ----------
    estimate : the projected estimate; its `links` are the new inertial parameters.
    before : what was projected.
    problem : whose answer it is: `nlp.pose` makes a program of it that can be extended.
    x, x_before : (s,) standard parameters, after and before.
    certificate : that it is the nearest.
    metric : in which it is, None where only the prior's metric was there.
    prior : what decided where the metric does not.
    notes : caveats.
    """

    estimate: Estimate
    before: Estimate
    problem: Problem
    x: np.ndarray
    x_before: np.ndarray
    certificate: Certificate
    metric: Metric | None
    prior: Prior
    notes: tuple[str, ...]

    @property
    def space(self) -> ParameterSpace:
        """The standard parameters."""
        return self.problem.space

    @property
    def robot(self) -> Robot:
        """The robot with the projected parameters."""
        return self.estimate.robot

    @property
    def values(self) -> np.ndarray:
        """The model's parameters, (p,)."""
        return self.estimate.values

    def write_robot(self, path: str | Path) -> Path:
        """Write the robot description with the projected parameters; see `robot.patching.write`."""
        return write(self.robot, path)

    @property
    def misfit(self) -> float | None:
        """What the move changes in the predicted torque, in units of the noise: root mean square
        over the equations; None without data.
        """
        if self.metric is None or self.metric.rows == 0:
            return None
        step = (
            self.metric.R
            @ mapping_of(self.space, self.metric, self.before.names)
            @ (self.x - self.x_before)
        )
        return float(np.linalg.norm(step) / np.sqrt(self.metric.rows))

    def changes(self) -> Table:
        """Each link before and after: how far it moved, its mass, and the rule that it broke."""
        rows = []
        for k, body in enumerate(self.space.bodies):
            part = slice(10 * k, 10 * k + 10)
            old, new = self.x_before[part], self.x[part]
            moved = np.linalg.norm(distance_rows(self.space.references[k]) @ (new - old))
            margin = margins(old)
            rule, value = margin.worst
            broken = "" if margin.consistent else f"{rule} {number(value, 3)}"
            if margin.consistent and old[0] == 0.0 and np.any(old != new):
                broken = "inertia, but no mass"
            after = margins(new).pseudo_inertia_min_eig
            mass = f"{number(old[0], 4)} -> {number(new[0], 4)}"
            rows.append((body, number(float(moved), 3), mass, broken, f"{after:.1e}"))
        notes = ["Moved: distance in units of the link's own size (0.2: all parameters by 10 %)."]
        if self.misfit is not None:
            notes.append(
                f"On the data behind the metric the predicted torque moves by "
                f"{number(self.misfit, 3)} of the noise (root mean square)."
            )
        columns = ("link", "moved", "mass, kg", "broke", "margin now")
        return Table("Links before and after", columns, tuple(rows), tuple(notes))

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        return (self.changes(), self.certificate.table(), *self.notes)

    def to_dict(self) -> dict[str, Any]:
        """The projection as JSON holds it."""
        links = []
        for k, body in enumerate(self.space.bodies):
            part = slice(10 * k, 10 * k + 10)
            old, new = self.x_before[part], self.x[part]
            moved = np.linalg.norm(distance_rows(self.space.references[k]) @ (new - old))
            links.append(
                {
                    "name": body,
                    "moved": float(moved),
                    "was_consistent": margins(old).consistent,
                    "before": old.tolist(),
                    "after": new.tolist(),
                }
            )
        return {
            "links": links,
            "metric": self.metric.source if self.metric else None,
            "prior": {
                "distance": self.prior.distance if self.metric else "quadratic",
                "spread": self.prior.spread,
            },
            "misfit": self.misfit,
            "certificate": self.certificate.to_dict(),
            "notes": list(self.notes),
        }


@checked
@single_threaded
def project(
    what: Estimate | Robot | Projection,
    prior: Robot | Prior | None = None,
    metric: Metric | None = None,
    within: Within | None = None,
    solver: Solver = "conic",
) -> Projection:
    """Return the nearest estimate within a set, by default the nearest physically possible robot.

    Minimises 1/2 |R (values - estimate)|^2 + 1/2 (distance from the prior / its spread)^2 over the
    inertial parameters of all links, R the root of the metric in units of noise: the maximum a
    posteriori estimate, for which the data enter through the estimate alone (Ting et al., RSS
    2006, equations 6 to 8). What lies within already comes back as it is.

    Parameters
    ----------
    what : an estimate; a robot description, which without a metric is moved under the prior's own
        metric; or a projection, which is projected again.
    prior : robot description that decides what the metric leaves open; default: that of `what`.
    metric : default: the inverse covariance of the estimate.
    within : default: fully consistent links.
    solver : see `Solver`.

    Raises
    ------
    FitError
        If nothing satisfies the constraints, the solver fails, or a parameter is not finite.
    """
    require_solver(solver)
    within = within or Within()
    _require_kind("within", within, Within)
    _require_kind("metric", metric, Metric | None)
    before = _estimate(what)
    if not isinstance(prior, Prior):
        prior = Prior(prior or before.model.robot)
    model = prior_model(before.model, prior.robot)
    space = ParameterSpace.of(model)
    x_hat = _standard(before, model, space)
    if metric is None and before.rows:
        metric = Metric.of_estimate(before)
    problem, notes = posterior(space, x_hat, before.names, prior, metric, within)
    if problem.feasible(x_hat):
        answer = trivial(problem, x_hat)
    elif metric is None and not within.sets and within.consistency != "none":
        answer = solve_apart(problem, solver, x_hat)
    else:
        answer = solve(problem, solver, x_hat)
    return _projection(answer, before, problem, x_hat, metric, prior, notes)


def _require_kind(name: str, value: object, kind: Any) -> None:
    if not isinstance(value, kind):
        wanted = getattr(kind, "__name__", "Metric")
        raise FitError(f"a {type(value).__name__} where a {wanted} is needed", name)


def _estimate(what: Estimate | Robot | Projection) -> Estimate:
    if isinstance(what, Projection):
        return what.estimate
    if isinstance(what, Robot):
        return given_estimate(what)
    if not isinstance(what, Estimate):
        remedy = "give an Estimate, a Robot or a Projection"
        raise FitError(f"a {type(what).__name__} cannot be projected", remedy=remedy)
    return what


def _standard(before: Estimate, model: Model, space: ParameterSpace) -> np.ndarray:
    """Standard parameters (s,) of an estimate, what it leaves open taken from the prior."""
    if before.links is not None:
        robot = model.robot.with_links(before.links)
    else:
        rigid = before.values[: len(model.base.independent)]
        robot = model.robot.with_theta(model.base.lift(rigid, model.robot.theta))
    by_name = {link.name: link.phi for link in robot.links}
    inertial = [by_name[body] for body in space.bodies]
    x = np.concatenate([*inertial, before.values[len(model.base.independent) :]])
    if not np.all(np.isfinite(x)):
        names = [n for n, v in zip(space.names, x, strict=True) if not np.isfinite(v)]
        remedy = "state a number for it first: nothing is near to what is not a number"
        raise FitError("is not finite", ", ".join(names[:5]), remedy)
    return x


def _projection(
    answer: CertifiedPoint,
    before: Estimate,
    problem: Problem,
    x_hat: np.ndarray,
    metric: Metric | None,
    prior: Prior,
    notes: tuple[str, ...],
) -> Projection:
    space, x = problem.space, answer.x
    moved = not np.array_equal(x, x_hat)
    covariance, active_notes = before.covariance, ()
    if moved and metric is not None:
        active = active_set(problem, x)
        covariance = space.combination @ active.covariance @ space.combination.T
        active_notes = (active.sentence,)
    links = {body: x[10 * k : 10 * k + 10] for k, body in enumerate(space.bodies)}
    estimate = replace(
        before,
        model=prior_model(before.model, prior.robot),
        values=space.combination @ x if moved else before.values,
        covariance=covariance,
        method=f"{before.method}; projected" if moved else before.method,
        notes=(*before.notes, *notes, *active_notes) if moved else before.notes,
        links=links,
        certificate=answer.certificate,
    )
    return Projection(
        estimate=estimate,
        before=before,
        problem=problem,
        x=x,
        x_before=x_hat,
        certificate=answer.certificate,
        metric=metric,
        prior=prior,
        notes=(*notes, *active_notes),
    )
