"""Shape parameters by variable projection: the linear ones are solved for at every trial.

The decimated columns of all that does not change are factorised once; only the columns of the
effects with a shape are evaluated again, and what the rest can explain of them is taken off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.linalg import qr
from scipy.optimize import least_squares, minimize

from dynident.effects import Block, Effect
from dynident.fitting.least_squares import RANK_TOLERANCE, LeastSquares, solve_factors
from dynident.fitting.sampling import Sampled, sample
from dynident.model import Model
from dynident.moments.factors import factorise
from dynident.recording import Dataset

_SCREEN_MOST = 400  # combinations of all effects' variants that are screened at most
_PRECISION = 1e-4  # of the logarithm of a shape parameter
_PASSES = 5  # of shapes and values in turn, where columns depend on the values

Signals = list[np.ndarray]
"""Decimated rows of each recording, (T, n, k)."""


@dataclass(frozen=True)
class Shaped:
    """A model at its best shape parameters, and what the search has to say."""

    model: Model
    status: str


def shaped_effects(model: Model) -> tuple[Effect, ...]:
    """Effects of a model that have shape parameters."""
    return tuple(e for e in model.effects if e.shape_parameters(model.robot))


def refine_shapes(model: Model, dataset: Dataset) -> Shaped:
    """Find the shape parameters of a model at which least squares fits best.

    The effects' variants are screened first. Then the logarithms of the shapes are sought, within
    their bounds: by Gauss-Newton steps where every effect knows its derivatives, else by a simplex
    search. Where columns depend on the present model, shapes and values are sought in turn.
    """
    samples = [sample(recording, dataset.filter) for recording in dataset.recordings]
    if not model.needs_values:
        return _ShapeSearch(model, samples, None).run(screen=True)
    shaped = _ShapeSearch(model, samples, _without_nonlinear(model, dataset)).run(screen=True)
    for _ in range(_PASSES):
        before = shaped.model
        relaxed = LeastSquares().fit(before, dataset)
        shaped = _ShapeSearch(relaxed.model, samples, relaxed.values).run(screen=False)
        if np.allclose(_logarithms(before), _logarithms(shaped.model), atol=10 * _PRECISION):
            break
    return shaped


def _without_nonlinear(model: Model, dataset: Dataset) -> np.ndarray:
    """Values fitted without the shaped effects whose variants take their columns elsewhere."""
    rest = model
    for effect in shaped_effects(model):
        rest = rest - effect if effect.nonlinear else rest
    found = LeastSquares().fit(rest, dataset).values
    values = model.linearisation_point()
    values[: model.base.rank] = found[: model.base.rank]
    for effect in rest.effects:
        values[model.slices[effect.label]] = found[rest.slices[effect.label]]
    return values


def _logarithms(model: Model) -> np.ndarray:
    return np.log([s for effect in shaped_effects(model) for s in effect.shape])


class _ShapeSearch:
    """Shapes at given values, on rows from which the other columns are projected away.

    Parameters
    ----------
    model : with its shapes to begin with.
    samples : the recordings.
    values : (p,) at which columns that depend on the present model are taken; or None.
    """

    def __init__(self, model: Model, samples: list[Sampled], values: np.ndarray | None) -> None:
        self._model, self._samples, self._values = model, samples, values
        self._shaped = shaped_effects(model)
        self._parameters = [s for e in self._shaped for s in e.shape_parameters(model.robot)]
        columns = [np.concatenate(list(s.columns(model, values))) for s in samples]
        pairs = zip(columns, (s.tau for s in samples), strict=True)
        # One weighting throughout, or the weights would be minimised instead of the residual.
        self._weights = 1.0 / solve_factors(model, factorise(pairs)).torque_std
        own = np.concatenate([np.r_[model.slices[e.label]] for e in self._shaped])
        rest = np.setdiff1d(np.arange(model.size), own)
        self._basis = _orthonormal(self._rows([c[:, :, rest] for c in columns]))
        self._torque = self._left([s.tau[:, :, None] for s in samples])[:, 0]
        self._blocks = [self._ready(s) for s in samples]

    def run(self, *, screen: bool) -> Shaped:
        """Return the model at the shapes that fit best."""
        effects = self._screened() if screen else self._shaped
        start = np.log([s for effect in effects for s in effect.shape])
        bounds = np.log([(s.lower, s.upper) for s in self._parameters])
        start = np.clip(start, bounds[:, 0], bounds[:, 1])
        if self._differentiable(effects):
            found = least_squares(
                lambda x: self._residual(self._at(effects, x)),
                start,
                lambda x: self._jacobian(self._at(effects, x)),  # type: ignore[arg-type]
                bounds=(bounds[:, 0] - 1e-9, bounds[:, 1] + 1e-9),
                xtol=_PRECISION,
                ftol=1e-12,
                gtol=1e-14,
                max_nfev=50,
            )
        else:
            loss = self._loss(effects)
            found = minimize(
                lambda x: self._loss(self._at(effects, x)),
                start,
                method="Nelder-Mead",
                bounds=bounds,
                options={"xatol": _PRECISION, "fatol": 1e-9 * loss, "maxfev": 200 * len(start)},
            )
        at_bound = [
            s.name
            for s, x, (low, high) in zip(self._parameters, found.x, bounds, strict=True)
            if min(x - low, high - x) < 10 * _PRECISION
        ]
        status = "shape parameters converged" if found.success else f"shapes: {found.message}"
        if at_bound:
            status += f"; at a bound: {', '.join(at_bound)}"
        return Shaped(self._model.with_shapes(self._at(effects, found.x)), status)

    # --- trials ---------------------------------------------------------------------------------

    def _at(self, effects: tuple[Effect, ...], logarithm: np.ndarray) -> tuple[Effect, ...]:
        remaining = np.exp(logarithm)
        bounds = [(s.lower, s.upper) for s in self._parameters]
        shape = [float(np.clip(x, *limits)) for x, limits in zip(remaining, bounds, strict=True)]
        found = []
        for effect in effects:
            own = len(effect.shape)
            found.append(effect.shaped(*shape[:own]))
            shape = shape[own:]
        return tuple(found)

    def _screened(self) -> tuple[Effect, ...]:
        """The best of the variants: of all combinations, or of each effect in turn."""
        robot, best = self._model.robot, self._shaped
        variants = [(e, *e.variants(robot)) for e in best]
        if np.prod([len(v) for v in variants]) <= _SCREEN_MOST:
            return min(product(*variants), key=self._loss)
        for k, tried in enumerate(variants):
            every = [(*best[:k], one, *best[k + 1 :]) for one in tried]
            best = min(every, key=self._loss)
        return best

    def _loss(self, effects: tuple[Effect, ...]) -> float:
        return float(np.sum(self._residual(effects) ** 2))

    def _residual(self, effects: tuple[Effect, ...]) -> np.ndarray:
        columns = self._columns(effects)
        return self._torque - columns @ _solved(columns, self._torque)

    def _jacobian(self, effects: tuple[Effect, ...]) -> np.ndarray:
        """Derivative of the residual by the logarithms, as if the linear values stayed (Kaufman).

        Source: L. Kaufman, "A variable projection method for solving separable nonlinear least
        squares problems", BIT 15 (1975).
        """
        columns = self._columns(effects)
        values, start, found = _solved(columns, self._torque), 0, []
        for e in effects:
            own = values[start : start + len(e.parameters(self._model.robot))]
            start += len(own)
            found.append(self._left(self._evaluated(e, lambda b, e=e, own=own: _rise(e, b, own))))
        change = np.hstack(found)
        return columns @ _solved(columns, change) - change

    # --- columns --------------------------------------------------------------------------------

    def _ready(self, sampled: Sampled) -> dict[str, Block]:
        """Whole blocks with what the shaped effects need of the present model, by label."""
        model, found = self._model, {}
        for effect in self._shaped:
            if not effect.is_instantaneous:
                whole = sampled.block(model, rigid=False)
                found[effect.label] = model.ready(effect, whole, self._values)
        return found

    def _differentiable(self, effects: tuple[Effect, ...]) -> bool:
        sampled, blocks = self._samples[0], self._blocks[0]
        few = sampled.block(self._model, slice(0, 50))
        return all(e.sensitivities(blocks.get(e.label, few)) is not None for e in effects)

    def _columns(self, effects: tuple[Effect, ...]) -> np.ndarray:
        """Weighted rows of the shaped effects' columns, without what the rest explains, (N, k)."""
        return np.hstack([self._left(self._evaluated(e, e.columns)) for e in effects])

    def _evaluated(self, effect: Effect, evaluate: Callable[[Block], np.ndarray]) -> Signals:
        """Decimated rows of something of an effect, for each recording."""
        found = []
        for sampled, blocks in zip(self._samples, self._blocks, strict=True):
            if effect.label in blocks:
                found.append(sampled.filtered(evaluate(blocks[effect.label])))
                continue
            rigid = effect.needs_regressor
            found += sampled.decimate(self._model, lambda b: [evaluate(b)], rigid=rigid)
        return found

    def _rows(self, parts: Signals) -> np.ndarray:
        """Weighted rows of all recordings and joints, (N, k)."""
        weights = self._weights[:, None]
        return np.concatenate([(part * weights).reshape(-1, part.shape[2]) for part in parts])

    def _left(self, parts: Signals) -> np.ndarray:
        """The same without what the other columns explain."""
        rows = self._rows(parts)
        return rows - self._basis @ (self._basis.T @ rows)


def _rise(effect: Effect, block: Block, values: np.ndarray) -> np.ndarray:
    """Derivative of an effect's torque by its shapes, (T, n, s)."""
    sensitivities = effect.sensitivities(block)
    assert sensitivities is not None
    return np.einsum("tnks,k->tns", sensitivities, values)


def _orthonormal(columns: np.ndarray) -> np.ndarray:
    """An orthonormal basis of what the columns span, (N, r)."""
    norms = np.linalg.norm(columns, axis=0)
    found: Any = qr(columns / np.where(norms > 0, norms, 1.0), mode="economic", pivoting=True)
    size = np.abs(np.diag(found[1]))
    return found[0][:, size > RANK_TOLERANCE * size[0]]


def _solved(columns: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    norms = np.linalg.norm(columns, axis=0)
    scale = np.where(norms > 0, norms, 1.0)
    found = np.linalg.lstsq(columns / scale, wanted, rcond=RANK_TOLERANCE)[0]
    return (found.T / scale).T
