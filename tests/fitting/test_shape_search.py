"""Every solver of the shape search against problems whose answer is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from dynident.fitting.shape_search import (
    Bracket,
    Evolution,
    ShapeProblem,
    ShapeSolver,
    Simplex,
    TrustRegion,
    screened,
    search,
)

T = np.linspace(0.0, 4.0, 200)


@dataclass(frozen=True)
class Decays:
    """c exp(-x t) fitted to y, the linear c solved for, with Kaufman's derivative."""

    rates: np.ndarray
    y: np.ndarray
    admissible: bool = True

    @property
    def columns(self) -> np.ndarray:
        return np.exp(-np.outer(T, self.rates))

    @property
    def values(self) -> np.ndarray:
        return np.linalg.lstsq(self.columns, self.y, rcond=None)[0]

    @property
    def residual(self) -> np.ndarray:
        return self.y - self.columns @ self.values

    @property
    def loss(self) -> float:
        return float(self.residual @ self.residual)

    @property
    def jacobian(self) -> np.ndarray:
        rise = -self.columns * np.outer(T, self.rates) * self.values
        return self.columns @ np.linalg.lstsq(self.columns, rise, rcond=None)[0] - rise


def decays(true: Sequence[float], start: Sequence[float]) -> ShapeProblem[Decays]:
    y = np.exp(-np.outer(T, true)) @ np.arange(2.0, 2.0 + len(true))
    span = np.log(np.tile([[0.05], [20.0]], len(start)))
    return ShapeProblem(
        lower=span[0],
        upper=span[1],
        start=np.log(start),
        evaluate=lambda points: [Decays(np.exp(x), y) for x in points],
        differentiable=True,
    )


LOCAL: tuple[ShapeSolver, ...] = (
    TrustRegion(precision=1e-8, fall=1e-15, slope=1e-15, evaluations=60),
    Simplex(1e-6, fall=1e-14, evaluations=2000),
)


@pytest.mark.parametrize(
    "solver", [*LOCAL, Bracket(1e-8), Evolution(population=12, generations=40)], ids=repr
)
def test_one_shape_is_found_by_every_solver(solver: ShapeSolver) -> None:
    found = search(decays([0.7], [2.0]), solver)
    assert np.exp(found.coordinates) == pytest.approx([0.7], rel=1e-2)
    assert found.best[0].values == pytest.approx([2.0], rel=2e-2)
    assert found.evaluations > 2 and found.message


@pytest.mark.parametrize("solver", LOCAL, ids=repr)
def test_two_shapes_are_found_with_and_without_derivatives(solver: ShapeSolver) -> None:
    found = search(decays([0.4, 3.0], [0.7, 2.0]), solver)
    assert found.converged
    assert np.exp(found.coordinates) == pytest.approx([0.4, 3.0], rel=1e-4)


def test_a_shape_outside_its_bounds_ends_at_the_bound() -> None:
    problem = decays([30.0], [2.0])
    found = search(problem, LOCAL[0])
    assert found.coordinates == pytest.approx(problem.upper, abs=1e-6)


@dataclass(frozen=True)
class Peak:
    """A narrow valley that no slope leads to, beside a deeper one that is not possible."""

    x: float

    @property
    def loss(self) -> float:
        deep = 2.0 * np.exp(-(((self.x + 1.0) / 0.1) ** 2))
        return float(-np.exp(-(((self.x - 1.0) / 0.1) ** 2)) - deep)

    @property
    def admissible(self) -> bool:
        return self.x > 0


def peak() -> ShapeProblem[Peak]:
    return ShapeProblem(
        lower=np.array([-3.0]),
        upper=np.array([3.0]),
        start=np.zeros(1),
        evaluate=lambda points: [Peak(float(x[0])) for x in points],
    )


def test_the_global_search_finds_what_a_local_one_misses() -> None:
    local = search(peak(), Simplex())
    assert local.best == () or local.best[0].loss > -0.1
    wide = search(peak(), Evolution(population=24, generations=40, finalists=5))
    assert len(wide.best) == 5
    assert wide.best[0].x == pytest.approx(1.0, abs=0.05)
    assert all(a.loss <= b.loss for a, b in zip(wide.best, wide.best[1:], strict=False))
    assert all(one.admissible for one in wide.best)


def test_the_global_search_ends_when_enough_is_found_or_nothing_is_to_be_hoped_for() -> None:
    every = search(peak(), Evolution(population=24, generations=40)).evaluations
    assert search(peak(), Evolution(population=24, generations=40, enough=-0.5)).evaluations < every
    hopeless = search(peak(), Evolution(population=24, generations=40, hope=-1.5, patience=3))
    assert hopeless.evaluations < every
    # There is more than that, reached within three generations, and not twice as much.
    weak = search(peak(), Evolution(population=24, generations=40, hope=-0.6, patience=3))
    assert hopeless.evaluations < weak.evaluations < every
    assert weak.best[0].loss < -0.6


def test_the_grid_is_screened_in_all_combinations_or_group_by_group() -> None:
    groups = [range(5), range(5)]

    def loss(choice: tuple[int, ...]) -> float:
        return (choice[0] - choice[1] - 2) ** 2 + 0.1 * (choice[0] - 4) ** 2

    assert screened(groups, loss, most=25) == (4, 2)
    assert screened(groups, loss, most=24) == (2, 0)
