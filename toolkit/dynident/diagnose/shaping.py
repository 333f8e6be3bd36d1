"""Shape parameters and points of secants at which a candidate explains most."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import fminbound, least_squares, minimize, minimize_scalar

from dynident.diagnose.evidence import ColumnStore
from dynident.diagnose.moments import Moments
from dynident.diagnose.present import Present
from dynident.diagnose.runs import Signals
from dynident.diagnose.scoring import (
    Columns,
    Score,
    candidate_moments,
    carried,
    impossible,
    score,
)
from dynident.effects import Block, Effect, Parameter
from dynident.model import Model

_SECANTS = 3  # times that columns are taken at the values just found
_SETTLED = 0.02  # relative change of values at which secants count as settled
_EVALUATIONS = 25  # of a gradient search, at most
_FURTHEST = 1.7  # factor by which a gradient search changes a shape, at most
_VALUES_TRIED = 10  # of a column that is taken at a value
_VALUE_RANGE = 0.5  # of the logarithm of that value, to each side
_PRECISION = 1e-3  # of the logarithm of a shape parameter
_LEAST_FALL = 1e-4  # relative, of what is left, for which a gradient search goes on
_ROUNDING = 1e-12  # of the largest curvature, to which others are rounding errors


@dataclass(frozen=True)
class Tangent(Effect):
    """An effect's columns, then their derivatives by the logarithm of each shape parameter.

    Last comes the derivative by the value at which a column is taken, where there is one.
    """

    of: Effect | None = None
    name: ClassVar[str] = "tangent"

    @classmethod
    def to(cls, effect: Effect) -> Tangent:
        """Return the columns and derivatives of an effect."""
        return cls(effect.joint, effect.source, effect.shape, effect.point, effect)

    @property
    def needs(self) -> frozenset[str]:  # type: ignore[override]
        """As the effect."""
        assert self.of is not None
        return self.of.needs

    def parameters(self, robot) -> tuple[Parameter, ...]:
        """As the effect."""
        assert self.of is not None
        return self.of.parameters(robot)

    def columns(self, block: Block) -> np.ndarray:
        """Columns (T, n, k), then derivatives one after the other, (T, n, k + s k)."""
        assert self.of is not None
        plain, slopes = self.of.columns(block), self.of.sensitivities(block)
        assert slopes is not None
        turned = np.moveaxis(slopes, 3, 2).reshape(*slopes.shape[:2], -1)
        at_point = self.of.point_slope(block) if self.of.point else None
        parts = (plain, turned) if at_point is None else (plain, turned, at_point)
        return np.concatenate(parts, axis=2)


@dataclass(frozen=True)
class Beside:
    """Columns of an effect, for a model that has it, to be judged beside the model without it.

    What depends on the bodies or on the predicted torque is that of the model with the effect: the
    parameters that were fitted without it have taken on a part of it.
    """

    store: ColumnStore
    whole: Present

    def columns(self, effect: Effect, run: int, model: Model, values: np.ndarray) -> Signals:
        """As `ColumnStore.of`."""
        return self.store.of(effect, run, self.whole.model, self.whole.values)


def score_at(
    store: ColumnStore,
    present: Present,
    effect: Effect,
    like: Score,
    grid: int,
    columns_of: Columns | None = None,
) -> Score:
    """Score an effect with other columns; carriers of a payload as in `like`."""
    (parts,) = candidate_moments(store, present, [effect], columns_of)
    if like.carriers is not None:
        parts = tuple(carried(part, store, like.carriers) for part in parts)
    return score(present, effect, *parts, grid=grid, carriers=like.carriers)


def refined(
    store: ColumnStore, present: Present, one: Score, columns_of: Columns | None = None
) -> Score:
    """Return a score at the shape parameters and secants that fit best."""
    if not one.drop > 0:
        return one
    if not one.effect.shape_parameters(present.model.robot):
        return _at_its_values(store, present, one, columns_of) if one.effect.secant else one
    has_slopes = type(one.effect).sensitivities is not Effect.sensitivities
    search = _by_gradient if has_slopes else _by_trial
    if one.effect.point:
        one = _at_best_value(store, present, one, columns_of)
    return _better(one, search(store, present, one, columns_of))


def _better(one: Score, other: Score) -> Score:
    return other if other.settled_drop > one.settled_drop else one


def _at_its_values(
    store: ColumnStore, present: Present, one: Score, columns_of: Columns | None
) -> Score:
    """Take secants through the values found, until they settle."""
    for _ in range(_SECANTS):
        if not one.values or not np.any(one.values):
            return one
        effect = one.effect.at(_within_bounds(one, present))
        old = one.effect.point or (0.0,) * len(effect.point)
        change = np.linalg.norm(np.subtract(effect.point, old))
        if change <= _SETTLED * np.linalg.norm(effect.point):
            break
        better = score_at(store, present, effect, one, _grid(effect, present), columns_of)
        store.forget(effect)
        if not better.drop > 0.5 * one.drop:
            break  # the secant has left the range in which the law is what it is
        one = better
    return one


def _at_best_value(
    store: ColumnStore, present: Present, one: Score, columns_of: Columns | None
) -> Score:
    """Seek the value at which the column that is taken there fits best.

    Columns that change with the value as those of bursts do cannot be iterated on.
    """
    best = one

    def loss(logarithm: float) -> float:
        nonlocal best
        effect = one.effect.at([float(np.exp(logarithm))])
        found = score_at(store, present, effect, one, _grid(effect, present), columns_of)
        store.forget(effect)
        if found.settled_drop > best.settled_drop and not impossible(found, present.model):
            best = found
        return -found.settled_drop

    (start,) = np.log(one.effect.point)
    span = (start - _VALUE_RANGE, start + _VALUE_RANGE)
    minimize_scalar(loss, bounds=span, method="bounded", options={"maxiter": _VALUES_TRIED})
    return best


def _within_bounds(one: Score, present: Present) -> list[float]:
    limits = one.effect.parameters(present.model.robot)
    return np.clip(one.values, [p.lower for p in limits], [p.upper for p in limits]).tolist()


def _grid(effect: Effect, present: Present) -> int:
    return sum(1 for _ in effect.variants(present.model.robot))


def _by_gradient(
    store: ColumnStore, present: Present, one: Score, columns_of: Columns | None
) -> Score:
    """Minimise the residual over the shapes with exact derivatives, linear parameters solved for.

    A value at which a column is taken is sought together with the shapes. Each trial is reduced to
    its moments, of which a square root is a least-squares problem with few rows.
    """
    effect, k = one.effect, len(one.values)
    shapes = effect.shape_parameters(present.model.robot)
    pointed = effect.parameters(present.model.robot) if effect.point else ()
    limits = np.array([(s.lower, s.upper) for s in (*shapes, *pointed)]).T
    grid = _grid(effect, present)
    best = one

    @lru_cache(maxsize=1)
    def at(logarithms: tuple[float, ...]) -> _Trial:
        nonlocal best
        x = np.clip(np.exp(logarithms), *limits)
        trial = effect.shaped(*x[: len(shapes)]).at(x[len(shapes) :].tolist())
        tangent = Tangent.to(trial)
        ((with_model, with_self),) = candidate_moments(store, present, [tangent], columns_of)
        store.forget(tangent)
        plain = slice(0, k)
        found = score(
            present,
            trial,
            Moments(with_model.signal[:, :, plain], with_model.total[:, :, plain]),
            Moments(with_self.signal[:, plain, plain], with_self.total[:, plain, plain]),
            grid=grid,
        )
        if found.settled_drop > best.settled_drop and not impossible(found, present.model):
            best = found
        return _Trial.of(present, found, with_model.sums()[0], with_self.sums()[0])

    # Not further than to the next shapes of the grid: beyond, other peaks lead astray.
    start = np.array([*effect.shape, *effect.point])
    low, high = np.log(np.clip(np.outer((1.0 / _FURTHEST, _FURTHEST), start), *limits))
    least_squares(
        lambda x: at(tuple(x)).residual,
        np.log(start),
        lambda x: at(tuple(x)).jacobian,  # type: ignore[arg-type]
        bounds=(low - 1e-9, high + 1e-9),
        max_nfev=_EVALUATIONS,
        xtol=_PRECISION,
        ftol=_LEAST_FALL,
    )
    return best


@dataclass(frozen=True, eq=False)
class _Trial:
    """What is left at one shape, as a least-squares problem with as many rows as unknowns and one.

    Attributes
    ----------
    residual, jacobian : (s + 1,) and (s + 1, s), by the logarithms; their products are those of the
        whitened residual, whose noise is taken out, and its derivatives.
    """

    residual: np.ndarray
    jacobian: np.ndarray

    @classmethod
    def of(
        cls, present: Present, found: Score, with_model: np.ndarray, with_self: np.ndarray
    ) -> _Trial:
        """Return the problem from signal moments.

        Parameters
        ----------
        found : the score at this shape.
        with_model : (p + 1, k + s k) of the model's columns and the torque with the tangent's.
        with_self : (k + s k, k + s k) of the tangent's columns with themselves.
        """
        p, k = len(present.values), len(found.effect.parameters(present.model.robot))
        values = np.array(found.effect.point or found.values or (0.0,) * k)
        count = with_self.shape[0] // k - 1
        # What the torque changes by, along the logarithm of each shape.
        along = block_diag(np.eye(k), *[values[:, None]] * count)
        with_model, with_self = with_model @ along, along.T @ with_self @ along
        back = present.solution.project(with_model[:p])
        left = with_self - with_model[:p].T @ back
        right = with_model[p] - back.T @ present.moments.sums()[0][:p, p]
        curvature, slope = left[k:, k:], right[k:] - left[k:, :k] @ values
        if not found.effect.point:
            # Linear parameters follow (Kaufman): what they can do is not the shapes' merit.
            curvature = curvature - left[k:, :k] @ np.linalg.pinv(left[:k, :k]) @ left[:k, k:]
        size, turn = np.linalg.eigh(curvature)
        root = np.sqrt(np.clip(size, _ROUNDING * max(size[-1], 0.0), None))
        down = np.divide(turn.T @ slope, root, out=np.zeros_like(root), where=root > 0)
        rest = present.error_signal - found.settled_drop - down @ down
        return cls(
            np.append(-down, np.sqrt(max(rest, 0.0))),
            np.vstack([root[:, None] * turn.T, np.zeros(count)]),
        )


def _by_trial(
    store: ColumnStore, present: Present, one: Score, columns_of: Columns | None
) -> Score:
    shapes = one.effect.shape_parameters(present.model.robot)
    grid = _grid(one.effect, present)

    def at(shape: np.ndarray) -> Score:
        effect = one.effect.shaped(*np.exp(np.atleast_1d(shape)))
        result = score_at(store, present, effect, one, grid, columns_of)
        store.forget(effect)
        return result

    def loss(shape: np.ndarray) -> float:
        return -at(shape).drop

    return at(_minimum(loss, shapes, one.effect.shape))


def _minimum(loss: Callable[[np.ndarray], float], shapes, start) -> np.ndarray:
    if len(shapes) == 1:
        low, high = _neighbours(shapes[0], start[0])
        span = (float(np.log(low)), float(np.log(high)))
        return np.atleast_1d(np.asarray(fminbound(loss, *span, xtol=2 * _PRECISION)))
    bounds = [(np.log(s.lower), np.log(s.upper)) for s in shapes]
    return minimize(loss, np.log(start), bounds=bounds, method="Nelder-Mead").x


def reshaped(store: ColumnStore, others: Present, whole: Present, effect: Effect) -> Score:
    """Return an effect's score at the shape that fits best near its own.

    Parameters
    ----------
    others, whole : the model without the effect, and with it.
    effect : as it is in the model.
    """
    beside = Beside(store, whole).columns
    blank = Score(effect, None, absorbed=False)
    now = score_at(store, others, effect, blank, _grid(effect, others), beside)
    return refined(store, others, now, beside)


def best_shape(store: ColumnStore, present: Present, effect: Effect) -> Effect:
    """Return an effect at the shape at which it explains most; as it is where it explains nothing.

    `present` is the model without it.
    """
    tried = [effect, *effect.variants(present.model.robot)]
    found = candidate_moments(store, present, tried)
    scores = (score(present, one, *parts, 1) for one, parts in zip(tried, found, strict=True))
    best = max(scores, key=lambda one: one.drop)
    return refined(store, present, best).effect if best.drop > 0 else effect


def _neighbours(shape, value: float) -> tuple[float, float]:
    grid = np.array(shape.grid)
    if len(grid) < 2:
        return shape.lower, shape.upper
    i = int(np.argmin(np.abs(grid - value)))
    low = grid[i - 1] if i > 0 else max(shape.lower, grid[0] ** 2 / grid[1])
    high = grid[i + 1] if i + 1 < len(grid) else min(shape.upper, grid[-1] ** 2 / grid[-2])
    return float(low), float(high)
