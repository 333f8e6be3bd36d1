"""Shape parameters by variable projection: the linear ones are solved for at every trial.

The decimated columns of all that does not change are kept meanwhile; only the columns of the
effects with a shape are evaluated again.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import minimize

from dynident.effects import Block, Effect
from dynident.fit.factors import factorise
from dynident.fit.least_squares import Solution, solve_factors
from dynident.fit.sampling import Sampled, sample
from dynident.model import Model
from dynident.recording import Dataset

_SCREEN_MOST = 400  # combinations of the grids that are screened at most
_PRECISION = 1e-4  # of the logarithm of a shape parameter


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

    Grids are screened where there are few combinations; then a simplex search, within the bounds,
    of the logarithms.
    """
    shaped = shaped_effects(model)
    samples = [sample(recording, dataset.filter) for recording in dataset.recordings]
    fixed = [s.decimate(model, lambda block: [model.columns(block)])[0] for s in samples]
    parameters = [shape for effect in shaped for shape in effect.shape_parameters(model.robot)]

    def at(shape: np.ndarray) -> Model:
        remaining = [float(s) for s in shape]
        effects = []
        for effect in shaped:
            own = len(effect.shape)
            effects.append(effect.shaped(*remaining[:own]))
            remaining = remaining[own:]
        return model.with_shapes(tuple(effects))

    weights: np.ndarray | None = None

    def loss(logarithm: np.ndarray) -> float:
        trial = at(np.exp(logarithm))
        pairs = (
            (_replaced(trial, columns, s), s.tau) for columns, s in zip(fixed, samples, strict=True)
        )
        factors = factorise(pairs)
        solution: Solution = solve_factors(trial, factors)
        scale = solution.torque_std if weights is None else weights
        return float(np.sum((factors.residual_norms(solution.values) / scale) ** 2))

    start = np.log([s for effect in shaped for s in effect.shape])
    # One weighting throughout, or the weights would be minimised instead of the residual.
    first = solve_factors(model, factorise(zip(fixed, (s.tau for s in samples), strict=True)))
    weights = first.torque_std
    grids = [shape.grid for shape in parameters]
    if np.prod([len(g) for g in grids]) <= _SCREEN_MOST:
        trials = [start, *(np.log(point) for point in product(*grids))]
        start = min(trials, key=loss)
    bounds = [(np.log(s.lower), np.log(s.upper)) for s in parameters]
    found = minimize(
        loss,
        start,
        method="Nelder-Mead",
        bounds=bounds,
        options={"xatol": _PRECISION, "fatol": 1e-9 * loss(start), "maxfev": 200 * len(parameters)},
    )
    at_bound = [
        s.name
        for s, x, (low, high) in zip(parameters, found.x, bounds, strict=True)
        if min(x - low, high - x) < 10 * _PRECISION
    ]
    status = "shape parameters converged" if found.success else f"shapes: {found.message}"
    if at_bound:
        status += f"; at a bound: {', '.join(at_bound)}"
    return Shaped(at(np.exp(found.x)), status)


def _replaced(model: Model, columns: np.ndarray, sampled: Sampled) -> np.ndarray:
    """Columns with those of the shaped effects evaluated anew."""
    shaped = shaped_effects(model)
    rigid = any("rigid" in effect.needs for effect in shaped)

    def evaluate(block: Block) -> list[np.ndarray]:
        return [effect.columns(block) for effect in shaped]

    fresh = sampled.decimate(model, evaluate, rigid=rigid)
    result = columns.copy()
    for effect, new in zip(shaped, fresh, strict=True):
        result[:, :, model.slices[effect.label]] = new
    return result
