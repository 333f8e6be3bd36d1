"""Shape parameters of a fit: what they leave of the rows, and where that is least.

The decimated columns of all that does not change are factorised once; only the columns of the
effects with a shape are evaluated again, and what the rest can explain of them is taken off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dynident.effects import Block, Effect
from dynident.effects.position_lines import PositionLines
from dynident.errors import FitError
from dynident.fitting.least_squares import LeastSquares
from dynident.fitting.linear_solution import solve_factors
from dynident.fitting.sampling import Sampled, sample
from dynident.fitting.shape_search import (
    ShapeProblem,
    ShapeSolution,
    Simplex,
    TrustRegion,
    screened,
    search,
)
from dynident.model import Model
from dynident.moments.factors import RANK_TOLERANCE, factorise
from dynident.moments.solution import orthonormal
from dynident.recording import Dataset

_SCREEN_MOST = 400  # combinations of all effects' variants that are screened at most
_PRECISION = 1e-4  # of the coordinate of a shape parameter
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

    The effects' variants are screened first. Then the coordinates of the shapes are sought, within
    their bounds: by least squares where every effect knows its derivatives, else by a simplex
    search. Where columns depend on the fit, shapes and values are sought in turn.

    Parameters
    ----------
    model : with at least one shaped effect.
    dataset : recordings with their filter.

    Raises
    ------
    FitError
        If the data cannot carry the model, or it has an event of one recording, whose time and
        place are not sought here.
    """
    for effect in shaped_effects(model):
        if effect.found_by == "repetition":
            what = "happened once, and a fit does not look for when"
            remedy = (
                "leave it out of the effects, and its moment out of the recording: its window in "
                "the study is what is used of it (`dynident explain` leaves it out by itself)"
            )
            raise FitError(what, effect.label, remedy)
    samples = [sample(recording, dataset.filter) for recording in dataset.recordings]
    if not model.needs_values:
        rows = _RowObjective(model, samples, None)
        return _best(rows, rows.screened())
    rows = _RowObjective(model, samples, _without_nonlinear(model, dataset))
    shaped = _best(rows, rows.screened())
    for _ in range(_PASSES):
        before = shaped.model
        relaxed = LeastSquares(errors="independent").fit(before, dataset)
        rows = _RowObjective(relaxed.model, samples, relaxed.values)
        shaped = _best(rows, rows.effects)
        if np.allclose(_coordinates(before), _coordinates(shaped.model), atol=10 * _PRECISION):
            break
    return shaped


def _best(rows: _RowObjective, effects: tuple[Effect, ...]) -> Shaped:
    """The model at the shapes that fit best; the search begins at those of some effects."""
    problem = rows.problem(effects)
    if problem.differentiable:
        solver = TrustRegion(precision=_PRECISION, fall=1e-12, slope=1e-14, evaluations=50)
    else:
        fall, most = 1e-9 * rows.loss(effects), 200 * len(problem.start)
        solver = Simplex(_PRECISION, fall=fall, evaluations=most)
    found = search(problem, solver)
    return Shaped(rows.model.with_shapes(rows.at(effects, found.coordinates)), rows.status(found))


def _without_nonlinear(model: Model, dataset: Dataset) -> np.ndarray:
    """Values fitted without the shaped effects whose variants take their columns elsewhere."""
    rest = model
    for effect in shaped_effects(model):
        rest = rest - effect if effect.nonlinear else rest
    found = LeastSquares(errors="independent").fit(rest, dataset).values
    values = model.linearisation_point()
    values[: model.base.rank] = found[: model.base.rank]
    for effect in rest.effects:
        values[model.slices[effect.label]] = found[rest.slices[effect.label]]
    return values


def _coordinates(model: Model) -> np.ndarray:
    return np.array(
        [
            parameter.coordinate(value)
            for effect in shaped_effects(model)
            for parameter, value in zip(
                effect.shape_parameters(model.robot), effect.shape, strict=True
            )
        ]
    )


class _RowObjective:
    """Shapes at given values, on rows from which the other columns are projected away.

    Parameters
    ----------
    model : with its shapes to begin with.
    samples : the recordings.
    values : (p,) at which columns that depend on the fit are taken; or None.
    """

    def __init__(self, model: Model, samples: list[Sampled], values: np.ndarray | None) -> None:
        self.model, self._samples, self._values = model, samples, values
        self.effects = shaped_effects(model)
        self._parameters = [s for e in self.effects for s in e.shape_parameters(model.robot)]
        columns = [np.concatenate(list(s.columns(model, values))) for s in samples]
        torque = [s.counted(s.tau) for s in samples]
        pairs = zip(columns, torque, strict=True)
        # One weighting throughout, or the weights would be minimised instead of the residual.
        self._weights = 1.0 / solve_factors(model, factorise(pairs)).torque_std
        own = np.concatenate([np.r_[model.slices[e.label]] for e in self.effects])
        rest = np.setdiff1d(np.arange(model.size), own)
        self._basis = orthonormal(self._rows([c[:, :, rest] for c in columns]))
        self.torque = self._left([one[:, :, None] for one in torque])[:, 0]
        self._blocks = [self._ready(s) for s in samples]

    def problem(self, effects: tuple[Effect, ...]) -> ShapeProblem[_RowTrial]:
        """Return the search for shapes that begins at those of some effects."""
        lower, upper = self._limits
        shape = (value for effect in effects for value in effect.shape)
        pairs = zip(self._parameters, shape, strict=True)
        start = np.array([parameter.coordinate(value) for parameter, value in pairs])
        return ShapeProblem(
            lower=lower,
            upper=upper,
            start=np.clip(start, lower, upper),
            evaluate=lambda points: [_RowTrial(self, self.at(effects, x)) for x in points],
            differentiable=self._differentiable(effects),
        )

    @property
    def _limits(self) -> np.ndarray:
        """Lower and upper bounds of the coordinates, (2, s)."""
        pairs = [(s.coordinate(s.lower), s.coordinate(s.upper)) for s in self._parameters]
        return np.array(pairs).T

    def screened(self) -> tuple[Effect, ...]:
        """Return the best of the variants: of all combinations, or of each effect in turn."""
        robot = self.model.robot
        tried = [(e, *e.variants(robot), *self._lines(e)) for e in self.effects]
        return screened(tried, self.loss, _SCREEN_MOST)

    def _lines(self, effect: Effect) -> tuple[Effect, ...]:
        """An effect with shapes that a spectrum over position finds in what the rest leaves."""
        robot, samples = self.model.robot, self._samples
        if effect.lines_over_position(robot) is None:
            return ()
        j = robot.names.index(str(effect.joint))
        q, v = (
            np.concatenate(x) for x in ([s.q[:, j] for s in samples], [s.v[:, j] for s in samples])
        )
        rate = max(one.rate_hz for one in samples)
        found = PositionLines.of(effect, robot, (q, v), rate)
        return () if found is None else found.highest(q, self.torque[j :: robot.n])

    def loss(self, effects: tuple[Effect, ...]) -> float:
        """Squares that effects leave, in units of each joint's residual."""
        return _RowTrial(self, effects).loss

    def status(self, found: ShapeSolution[_RowTrial]) -> str:
        """How a search ended, in words."""
        at_bound = [
            s.name
            for s, x, low, high in zip(
                self._parameters, found.coordinates, *self._limits, strict=True
            )
            if min(x - low, high - x) < 10 * _PRECISION
        ]
        status = "shape parameters converged" if found.converged else f"shapes: {found.message}"
        if at_bound:
            status += f"; at a bound: {', '.join(at_bound)}"
        return status

    def at(self, effects: tuple[Effect, ...], coordinates: np.ndarray) -> tuple[Effect, ...]:
        """Return effects at other shapes."""
        shape = [s.at(x) for s, x in zip(self._parameters, coordinates, strict=True)]
        found = []
        for effect in effects:
            own = len(effect.shape)
            found.append(effect.shaped(*shape[:own]))
            shape = shape[own:]
        return tuple(found)

    # --- columns --------------------------------------------------------------------------------

    def _ready(self, sampled: Sampled) -> dict[str, Block]:
        """Whole blocks with what the shaped effects need of the fit, by label."""
        model, found = self.model, {}
        for effect in self.effects:
            if not effect.is_instantaneous:
                whole = sampled.block(model)
                found[effect.label] = model.ready(effect, whole, self._values)
        return found

    def _differentiable(self, effects: tuple[Effect, ...]) -> bool:
        sampled, blocks = self._samples[0], self._blocks[0]
        few = self.model.with_regressor(sampled.block(self.model, slice(0, 50)))
        return all(e.sensitivities(blocks.get(e.label, few)) is not None for e in effects)

    def columns(self, effects: tuple[Effect, ...]) -> np.ndarray:
        """Weighted rows of the shaped effects' columns, without what the rest explains, (N, k)."""
        return np.hstack([self._left(self._evaluated(e, e.columns)) for e in effects])

    def change(self, effects: tuple[Effect, ...], values: np.ndarray) -> np.ndarray:
        """Weighted rows of the effects' torque, derived by the coordinate of each shape, (N, s)."""
        start, found = 0, []
        for e in effects:
            own = values[start : start + len(e.parameters(self.model.robot))]
            start += len(own)
            found.append(self._left(self._evaluated(e, lambda b, e=e, own=own: _rise(e, b, own))))
        return np.hstack(found)

    def _evaluated(self, effect: Effect, evaluate: Callable[[Block], np.ndarray]) -> Signals:
        """Decimated rows of something of an effect, for each recording."""
        found = []
        for sampled, blocks in zip(self._samples, self._blocks, strict=True):
            if effect.label in blocks:
                rows = sampled.filtered(evaluate(blocks[effect.label]))
            else:
                (rows,) = sampled.decimate(
                    self.model, lambda b: [evaluate(self.model.ready(effect, b, None))]
                )
            found.append(sampled.counted(rows))
        return found

    def _rows(self, parts: Signals) -> np.ndarray:
        """Weighted rows of all recordings and joints, (N, k)."""
        weights = self._weights[:, None]
        return np.concatenate([(part * weights).reshape(-1, part.shape[2]) for part in parts])

    def _left(self, parts: Signals) -> np.ndarray:
        """The same without what the other columns explain."""
        rows = self._rows(parts)
        return rows - self._basis @ (self._basis.T @ rows)


@dataclass(frozen=True, eq=False)
class _RowTrial:
    """What some shapes leave of the rows.

    Attributes
    ----------
    rows : the objective.
    effects : with their shapes.
    """

    rows: _RowObjective
    effects: tuple[Effect, ...]
    admissible: bool = True

    @cached_property
    def _columns(self) -> np.ndarray:
        return self.rows.columns(self.effects)

    @cached_property
    def _finite(self) -> bool:
        """Whether its columns are numbers: some laws are none at some shapes."""
        return bool(np.all(np.isfinite(self._columns)))

    @cached_property
    def _values(self) -> np.ndarray:
        return _solved(self._columns, self.rows.torque)

    @cached_property
    def residual(self) -> np.ndarray:
        """Weighted rows of the torque that no column explains, (N,)."""
        if not self._finite:
            return np.full(len(self.rows.torque), np.inf)
        return self.rows.torque - self._columns @ self._values

    @property
    def loss(self) -> float:
        """Sum of their squares."""
        return float(np.sum(self.residual**2))

    @property
    def jacobian(self) -> np.ndarray:
        """Derivative of the residual by the coordinates, as if the linear values stayed, (N, s).

        Source: L. Kaufman, "A variable projection method for solving separable nonlinear least
        squares problems", BIT 15 (1975).
        """
        change = self.rows.change(self.effects, self._values)
        return self._columns @ _solved(self._columns, change) - change


def _rise(effect: Effect, block: Block, values: np.ndarray) -> np.ndarray:
    """Derivative of an effect's torque by its shapes, (T, n, s)."""
    sensitivities = effect.sensitivities(block)
    assert sensitivities is not None
    return np.einsum("tnks,k->tns", sensitivities, values)


def _solved(columns: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    norms = np.linalg.norm(columns, axis=0)
    scale = np.where(norms > 0, norms, 1.0)
    found = np.linalg.lstsq(columns / scale, wanted, rcond=RANK_TOLERANCE)[0]
    return (found.T / scale).T
