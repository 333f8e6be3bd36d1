"""The search for shape parameters, in which a model is not linear.

The linear parameters are solved for at each trial (variable projection; Golub and Pereyra, "The
differentiation of pseudo-inverses and nonlinear least squares problems whose variables separate",
1973), so that a problem knows nothing but the shapes. They are sought by their
coordinates, see `dynident.effects.ShapeParameter`. `search` takes a problem and a solver:

- `TrustRegion`, where residual and derivatives are known;
- `Simplex` and, of one unknown, `Bracket`, where they are not;
- `Evolution`, where there are many peaks: the global search.

What is minimised is the caller's: `row_objective` reduces rows, the diagnosis moments.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from scipy.optimize import (
    OptimizeResult,
    differential_evolution,
    least_squares,
    minimize,
    minimize_scalar,
)

_MARGIN = 1e-9  # beyond the bounds, where a start that lies on one is inside


class Trial(Protocol):
    """What some shapes leave.

    Those of a differentiable problem are least-squares problems: they have a `residual` (r,), and
    its derivatives by the coordinates as `jacobian` (r, s), as well.
    """

    @property
    def loss(self) -> float:
        """What is minimised."""
        ...

    @property
    def admissible(self) -> bool:
        """Whether it may be the answer."""
        ...


T = TypeVar("T", bound=Trial)
V = TypeVar("V")


@dataclass(frozen=True, eq=False, kw_only=True)
class ShapeProblem(Generic[T]):
    """Shapes that are sought by their coordinates, see `dynident.effects.ShapeParameter`.

    Attributes
    ----------
    lower, upper : (s,) bounds.
    start : (s,) where a local search begins.
    evaluate : the trials of several shapes at once, each (s,).
    differentiable : whether the trials know their residual and its derivatives.
    """

    lower: np.ndarray
    upper: np.ndarray
    start: np.ndarray
    evaluate: Callable[[Sequence[np.ndarray]], Sequence[T]]
    differentiable: bool = False

    def at(self, coordinates: np.ndarray) -> T:
        """Return the trial of one."""
        return self.evaluate([coordinates])[0]


@dataclass(frozen=True, eq=False, kw_only=True)
class ShapeSolution(Generic[T]):
    """Where a search ended.

    Attributes
    ----------
    coordinates : (s,) of the shapes.
    converged : whether the solver says so.
    message : of the solver.
    best : the admissible trials with the least loss on the way, best first.
    evaluations : number of trials.
    """

    coordinates: np.ndarray
    converged: bool
    message: str
    best: tuple[T, ...]
    evaluations: int


class ShapeSolver(Protocol):
    """A way to search; it asks for trials and returns what SciPy says."""

    @property
    def finalists(self) -> int:
        """Number of the best trials that are kept."""
        ...

    def run(self, problem: ShapeProblem[Any], log: _Log[Any]) -> OptimizeResult:
        """Search; every trial is taken from the log."""
        ...


def search(problem: ShapeProblem[T], solver: ShapeSolver) -> ShapeSolution[T]:
    """Find the shapes at which the loss is least."""
    log = _Log(problem, solver.finalists)
    found = solver.run(problem, log)
    return ShapeSolution(
        coordinates=np.atleast_1d(found.x),
        converged=bool(found.success),
        message=str(found.message),
        best=log.best,
        evaluations=log.evaluations,
    )


def screened(
    variants: Sequence[Sequence[V]], loss: Callable[[tuple[V, ...]], float], most: int
) -> tuple[V, ...]:
    """Return the best of the variants, one of each group, from which a local search begins.

    Parameters
    ----------
    variants : groups, in each of which the first is what there is now.
    loss : of one choice from every group.
    most : combinations up to which all are tried; beyond, each group is gone through in turn.

    Returns
    -------
    One variant of each group
    """
    if np.prod([len(group) for group in variants]) <= most:
        return min(product(*variants), key=loss)
    best = tuple(group[0] for group in variants)
    for k, group in enumerate(variants):
        best = min([(*best[:k], one, *best[k + 1 :]) for one in group], key=loss)
    return best


@dataclass(frozen=True, kw_only=True)
class TrustRegion:
    """Least squares with exact derivatives, within the bounds.

    Attributes
    ----------
    precision : of the coordinates, relative to their norm.
    fall : relative, of what is left, below which a step is the last one.
    slope : of what is left, below which it ends.
    evaluations : at most.
    """

    precision: float
    fall: float
    evaluations: int
    slope: float = 1e-8
    finalists: int = 1

    def run(self, problem: ShapeProblem[Any], log: _Log[Any]) -> OptimizeResult:
        """See `ShapeSolver`."""
        return least_squares(
            lambda x: log.at(x).residual,
            problem.start,
            lambda x: log.at(x).jacobian,  # type: ignore[arg-type]
            bounds=(problem.lower - _MARGIN, problem.upper + _MARGIN),
            xtol=self.precision,
            ftol=self.fall,
            gtol=self.slope,
            max_nfev=self.evaluations,
        )


@dataclass(frozen=True)
class Simplex:
    """Nelder and Mead's search, without derivatives.

    Attributes
    ----------
    precision : of the coordinates.
    fall : absolute, of the loss.
    evaluations : at most; None for 200 an unknown, and as many iterations.
    """

    precision: float = 1e-4
    fall: float = 1e-4
    evaluations: int | None = None
    finalists: int = 1

    def run(self, problem: ShapeProblem[Any], log: _Log[Any]) -> OptimizeResult:
        """See `ShapeSolver`."""
        options = {"xatol": self.precision, "fatol": self.fall}
        if self.evaluations is not None:
            options["maxfev"] = self.evaluations
        bounds = np.column_stack([problem.lower, problem.upper])
        return minimize(
            lambda x: log.at(x).loss,
            problem.start,
            method="Nelder-Mead",
            bounds=bounds,
            options=options,
        )


@dataclass(frozen=True)
class Bracket:
    """Golden sections and parabolas between the bounds of a single unknown.

    Attributes
    ----------
    precision : of the coordinate.
    evaluations : at most.
    """

    precision: float = 1e-5
    evaluations: int = 500
    finalists: int = 1

    def run(self, problem: ShapeProblem[Any], log: _Log[Any]) -> OptimizeResult:
        """See `ShapeSolver`."""
        found: Any = minimize_scalar(
            lambda x: log.at(np.array([x])).loss,
            bounds=(float(problem.lower[0]), float(problem.upper[0])),
            method="bounded",
            options={"xatol": self.precision, "maxiter": self.evaluations},
        )
        return found


@dataclass(frozen=True, kw_only=True)
class Evolution:
    """Differential evolution (Storn and Price 1997) over all that the bounds admit.

    Attributes
    ----------
    population : trials of a generation, per unknown; as Sobol points, of which there are powers of
        two, no fewer than that.
    generations : at most.
    enough : loss below which it ends.
    hope : loss that must be reached within `patience` generations, twice of it within twice as
        many, and so on.
    finalists : number of the best trials that are kept.
    """

    population: int
    generations: int
    enough: float = -np.inf
    hope: float = np.inf
    patience: int = 1
    finalists: int = 1

    def run(self, problem: ShapeProblem[Any], log: _Log[Any]) -> OptimizeResult:
        """See `ShapeSolver`."""
        count = 0

        def ends(intermediate_result: OptimizeResult) -> bool:
            nonlocal count
            count += 1
            best = log.best[0].loss if log.best else 0.0
            hopeless = count >= self.patience and best > self.hope * count / self.patience
            return hopeless or best < self.enough

        return differential_evolution(
            lambda points: np.array([one.loss for one in log.many(points.T)]),
            np.column_stack([problem.lower, problem.upper]),
            popsize=self.population,
            maxiter=self.generations,
            init="sobol",
            rng=0,
            polish=False,
            updating="deferred",
            vectorized=True,
            callback=ends,
        )


class _Log(Generic[T]):
    """The trials of a search: the last one, since residual and derivatives ask alike, and the best.

    Attributes
    ----------
    best : admissible ones, least loss first.
    evaluations : number of all.
    """

    def __init__(self, problem: ShapeProblem[T], finalists: int) -> None:
        self._problem, self._finalists = problem, finalists
        self._last: tuple[bytes, T] | None = None
        self.best: tuple[T, ...] = ()
        self.evaluations = 0

    def at(self, coordinates: np.ndarray) -> T:
        """Return the trial of one."""
        key = coordinates.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, self.many([coordinates])[0])
        return self._last[1]

    def many(self, points: Sequence[np.ndarray] | np.ndarray) -> Sequence[T]:
        """Return the trials of several."""
        trials = self._problem.evaluate(list(points))
        self.evaluations += len(trials)
        possible = [one for one in trials if one.admissible]
        ranked = sorted([*self.best, *possible], key=lambda one: one.loss)
        self.best = tuple(ranked[: self._finalists])
        return trials
