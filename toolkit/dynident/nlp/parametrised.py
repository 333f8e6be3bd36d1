"""The problem as a nonlinear program: every choice of its variables is a consistent body.

"semi": the virtual parameters of equation (5) of Ting et al., RSS 2006; "full": log-Cholesky
parameters of the pseudo-inertia (Rucker and Wensing, RA-L 2022). Not convex, hence the several
starts, and the conic bound beside the answer; but a program that can be extended at will.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from dynident.errors import FitError
from dynident.inertia import (
    from_log_cholesky,
    from_paper,
    log_cholesky,
    log_cholesky_entries,
    pseudo_inertia,
    virtual,
    virtual_entries,
)
from dynident.nlp.blocks import Constraint, Cost, Residual, Variable
from dynident.nlp.nearest import nearest_body
from dynident.nlp.problem import TOLERANCE, Problem, pseudo_basis
from dynident.nlp.program import Program, ProgramSolution
from dynident.nlp.status import Status

_AGREE = 1e-6  # of the objective: starts that end as near as this have found the same
_INWARD = 0.1  # share of the reference body in a start, which is to lie well inside
_OFF = 1e-5  # share of the reference body in a start from an answer, which may be a flat one
_RANDOM = 4  # random starts at most, where the first ones do not agree
_SPREAD = 0.5  # of a random start about the reference, in units of a body's size


@dataclass(frozen=True, eq=False, kw_only=True)
class Parametrisation:
    """Ten free numbers of a body for which every value is allowed.

    Attributes
    ----------
    name : of the program.
    symbol : of the variables.
    units : (10,).
    forward : the ten inertial parameters of ten symbols.
    inverse : the ten numbers of a body well inside.
    sizes : of the ten numbers, from a body's mass (kg) and length (m).
    """

    name: str
    symbol: str
    units: tuple[str, ...]
    forward: Callable[[Any], list[Any]]
    inverse: Callable[[np.ndarray], np.ndarray]
    sizes: Callable[[float, float], np.ndarray]


def _virtual_forward(h: Any) -> list[Any]:
    # Without the eleventh, the root of viscous friction: an effect of its own, with a bound.
    entries = virtual_entries([*(h[k] for k in range(10)), 0.0])[:10]
    order = np.round(from_paper(np.arange(10.0))).astype(int)
    return [entries[k] for k in order]


def _virtual_sizes(mass: float, length: float) -> np.ndarray:
    root = np.sqrt(mass)
    return np.array([root, *[length] * 3, *[root * length] * 6])


VIRTUAL = Parametrisation(
    name="virtual parameters",
    symbol="h",
    units=("kg^0.5", *("m",) * 3, *("kg^0.5 m",) * 6),
    forward=_virtual_forward,
    inverse=lambda phi: virtual(phi, 0.0)[:10],
    sizes=_virtual_sizes,
)
LOG_CHOLESKY = Parametrisation(
    name="log-Cholesky parameters",
    symbol="eta",
    units=(*("1",) * 4, *("m",) * 6),
    forward=lambda eta: log_cholesky_entries(eta, ca.exp),
    inverse=log_cholesky,
    sizes=lambda mass, length: np.array([1.0, 1.0, 1.0, 1.0, *[length] * 6]),
)
PARAMETRISATIONS = {"semi": VIRTUAL, "full": LOG_CHOLESKY}


@dataclass(frozen=True, eq=False)
class PosedProgram:
    """A problem posed as a nonlinear program.

    Attributes
    ----------
    program : to print, to extend (`program + Constraint(...)`), and to solve.
    x : (s,) CasADi expression of the standard parameters, for more constraints and residuals.
    problem : what it poses, reduced to few rows.
    parametrisation : of the bodies.
    """

    program: Program
    x: Any
    problem: Problem
    parametrisation: Parametrisation

    def standard(self, values: dict[str, np.ndarray]) -> np.ndarray:
        """Standard parameters (s,) of the program's variables."""
        return self.program.evaluate(self.x, values)

    def start(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """The variables' values at, or a little inside of, standard parameters x (s,)."""
        space, found = self.problem.space, {}
        inside = x - self.problem.inset
        for k, body in enumerate(space.bodies):
            # Off the boundary, where the parameters of a flat body are infinite.
            phi = inside[10 * k : 10 * k + 10] + _OFF * space.references[k]
            found[f"{self.parametrisation.symbol}.{body}"] = self.parametrisation.inverse(phi)
        if space.size > space.rigid:
            found["effects"] = np.clip(x, space.lower, space.upper)[space.rigid :]
        return found


def pose(problem: Problem) -> PosedProgram:
    """Pose a problem as a nonlinear program.

    Raises
    ------
    FitError
        If consistency is not asked for: then there is nothing to parametrise.
    """
    chosen = PARAMETRISATIONS.get(problem.within.consistency)
    if chosen is None:
        raise FitError(
            "has no consistent bodies to parametrise", "Within", "choose full or semi, or 'conic'"
        )
    problem = problem.reduced()
    space = problem.space
    numbers = ca.SX.sym("z", 10)
    body_of = ca.Function("body", [numbers], [ca.vertcat(*chosen.forward(numbers))])
    program = Program(f"{chosen.name} of {len(space.bodies)} links")
    parts = []
    for k, body in enumerate(space.bodies):
        mass, length = _size(space.references[k])
        variable = Variable(
            f"{chosen.symbol}.{body}",
            10,
            unit=chosen.units,
            start=chosen.inverse(space.references[k]),
            scale=chosen.sizes(mass, length),
        )
        program = program + variable
        inset = problem.inset[10 * k : 10 * k + 10]
        parts.append(body_of(variable.symbol) + ca.DM(inset))
    if space.size > space.rigid:
        effects = slice(space.rigid, None)
        variable = Variable(
            "effects",
            space.size - space.rigid,
            unit=space.units[effects],
            lower=space.lower[effects],
            upper=space.upper[effects],
            start=np.clip(0.0, space.lower[effects], space.upper[effects]),
            scale=space.scale[effects],
        )
        program = program + variable
        parts.append(variable.symbol)
    x = ca.vertcat(*parts)
    # Numbers of the size of one before they meet the rows: sums of squares keep their digits.
    program = program + Residual(
        "data and prior",
        x / space.scale,
        "noise",
        matrix=problem.A * space.scale,
        target=problem.b,
    )
    if problem.entropy is not None:
        program = program + Cost("entropic prior", _entropy(problem, x))
    return PosedProgram(_constrained(program, problem, x), x, problem, chosen)


def _constrained(program: Program, problem: Problem, x: Any) -> Program:
    linear = problem.linear
    # The first rows are the effects' own bounds, which are bounds of variables already.
    space = problem.space
    own = int(np.sum(np.isfinite(space.lower) | np.isfinite(space.upper)))
    rows = range(own, len(linear.A))
    if rows:
        value = ca.DM(linear.A[rows]) @ x
        lower, upper = linear.lower[rows], linear.upper[rows]
        program = program + Constraint(
            "linear constraints", value, "size", lower=lower, upper=upper
        )
    for k, (cone, rows) in enumerate(zip(problem.cones, problem.cone_rows, strict=True), start=1):
        vector = ca.DM(rows / space.scale) @ x
        inside = vector[0] ** 2 - ca.sumsqr(vector[1:])
        program = program + Constraint(f"{cone.name} ({k})", inside, lower=0.0)
    return program


def _entropy(problem: Problem, x: Any) -> Any:
    assert problem.entropy is not None
    phi = ca.SX.sym("phi", 10)
    P = sum((phi[k] * ca.DM(one) for k, one in enumerate(pseudo_basis())), start=ca.SX.zeros(4, 4))
    total = 0
    for k, centre in enumerate(problem.entropy.centres):
        Q = pseudo_inertia(centre)
        ratio = ca.DM(np.linalg.inv(Q)) @ P
        logdet = ca.log(ca.det(P)) - np.linalg.slogdet(Q)[1]
        one = ca.Function("divergence", [phi], [ca.trace(ratio) - logdet - 4])
        total += one(x[10 * k : 10 * k + 10])
    return problem.entropy.weight * total


def _size(reference: np.ndarray) -> tuple[float, float]:
    mass = float(reference[0])
    return mass, float(np.sqrt((reference[4] + reference[6] + reference[9]) / (2 * mass)))


@dataclass(frozen=True, eq=False, kw_only=True)
class NonlinearSolution:
    """What the nonlinear program found.

    Attributes
    ----------
    x : (s,) standard parameters.
    status : of the best start.
    program : its name.
    objectives : reached from each start.
    solution : of the program, with its multipliers.
    """

    x: np.ndarray
    status: Status
    program: str
    objectives: tuple[float, ...]
    solution: ProgramSolution

    @property
    def inside(self) -> bool:
        """Whether the point satisfies the constraints, however the solver ended."""
        return self.solution.violation <= TOLERANCE


def solve_nonlinear(problem: Problem, bound: float, seed: int = 0) -> NonlinearSolution:
    """Solve a problem as a nonlinear program, from several starts.

    The first starts are the prior's own bodies, and the answer without constraints, each link
    replaced by the nearest possible one; where they end in different places, random ones follow.
    The conic answer is never a start: it is what this one is compared with. None follows one that
    ends at the bound.

    Parameters
    ----------
    problem : to be solved.
    bound : below which no objective can be.
    seed : of the random starts.

    Returns
    -------
    The best of the starts that were tried, with what each of them reached.
    """
    posed = pose(problem)
    random = np.random.default_rng(seed)
    found: list[ProgramSolution] = []
    for start in _starts(posed.problem, random):
        found.append(posed.program.solve([posed.start(start)]))
        if _is_at(found[-1], bound) or _agree(found):
            break
    # Where the solver stopped early the point may still be the best one: so the certificate says.
    best = min(found, key=_rank)
    status = best.status.after(*(s.status for s in found if s is not best))
    return NonlinearSolution(
        x=posed.standard(best.values),
        status=status,
        program=posed.parametrisation.name,
        objectives=tuple(s.objective for s in found),
        solution=best,
    )


def _rank(found: ProgramSolution) -> tuple[bool, bool, float]:
    """Order of preference: a number, inside, small."""
    return not np.isfinite(found.objective), not found.violation <= TOLERANCE, found.objective


def _is_at(found: ProgramSolution, bound: float) -> bool:
    """Whether a start that succeeded ended at a bound: no other can end lower."""
    near = np.isfinite(bound) and abs(found.objective - bound) <= _AGREE * abs(bound)
    return bool(near) and not any(_rank(found)[:2])


def _agree(found: list[ProgramSolution]) -> bool:
    """Whether the two best starts that succeeded ended at the same objective."""
    ends = sorted(s.objective for s in found if not any(_rank(s)[:2]))
    return len(ends) > 1 and ends[1] - ends[0] <= _AGREE * max(abs(ends[0]), 1e-300)


def _starts(problem: Problem, random: np.random.Generator) -> Iterator[np.ndarray]:
    """Standard parameters (s,) to begin with, the most promising first."""
    space = problem.space
    given, repaired = np.array(space.reference), np.array(problem.origin)
    for k, reference in enumerate(space.references):
        part = slice(10 * k, 10 * k + 10)
        _, length = _size(reference)
        # The entropy is one of mass distributions, whatever set it is used with.
        consistency = "full" if problem.entropy else problem.within.consistency
        nearest = nearest_body(repaired[part], length, consistency, float(reference[0]))
        repaired[part] = (1 - _INWARD) * nearest + _INWARD * reference
    given[space.rigid :] = problem.origin[space.rigid :]
    yield given
    yield repaired
    for _ in range(_RANDOM):
        yield _random_start(problem, random)


def _random_start(problem: Problem, random: np.random.Generator) -> np.ndarray:
    """Bodies whose log-Cholesky parameters are those of the references, disturbed."""
    x = np.array(problem.origin)
    for k, reference in enumerate(problem.space.references):
        mass, length = _size(reference)
        step = _SPREAD * LOG_CHOLESKY.sizes(mass, length) * random.normal(size=10)
        x[10 * k : 10 * k + 10] = from_log_cholesky(log_cholesky(reference) + step)
    return x
