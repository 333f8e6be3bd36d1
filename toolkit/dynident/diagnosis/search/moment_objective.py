"""What the shapes of a candidate leave of the moments, for the search for shape parameters.

Each trial is reduced to its moments, of which a square root is a least-squares problem with few
rows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.linalg import block_diag

from dynident.diagnosis.search.scores.candidate_moments import (
    Columns,
    candidate_moments,
    moments_with_payload,
)
from dynident.diagnosis.search.scores.score import Score, admissible
from dynident.diagnosis.search.scores.scoring import score
from dynident.diagnosis.search.shapes.residual_lines import shapes_tried
from dynident.effects import Block, Effect, Needs, Parameter, ShapeParameter
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.fitting.shape_search import ShapeProblem
from dynident.robot import Robot

_LEAST_VALUE = 1e-300
_ROUNDING = 1e-12  # of the largest curvature, to which others are rounding errors


@dataclass(frozen=True)
class Tangent(Effect):
    """An effect's columns, then their derivatives by the coordinate of each shape parameter.

    Last comes the derivative by the value at which a column is taken, where there is one.

    Attributes
    ----------
    of : the effect.
    joints : columns of those at which it acts: whitening zeros at the others would cost as much.
    """

    of: Effect | None = None
    joints: tuple[int, ...] = ()
    name: ClassVar[str] = "tangent"
    in_catalogue: ClassVar[bool] = False

    @classmethod
    def to(cls, effect: Effect, robot: Robot) -> Tangent:
        """Return the columns and derivatives of an effect."""
        joints = effect.acting_at(robot)
        return cls(effect.joint, effect.source, effect.shape, effect.point, effect, joints)

    @property
    def needs(self) -> Needs:  # type: ignore[override]
        """As the effect."""
        assert self.of is not None
        return self.of.needs

    def parameters(self, robot) -> tuple[Parameter, ...]:
        """As the effect."""
        assert self.of is not None
        return self.of.parameters(robot)

    def acting_at(self, robot: Robot) -> tuple[int, ...]:
        """As the effect."""
        return self.joints

    def acting_columns(self, block: Block) -> np.ndarray:
        """Columns (T, J, k), derivatives one after the other, and those by a point if there is one.

        (T, J, k + s k), or k more.
        """
        assert self.of is not None
        here, samples = list(self.joints), len(block.t)
        plain, slopes = self.of.acting_columns(block), self.of.sensitivities(block)
        assert slopes is not None
        # Samples last, as they lie in memory: what is side by side is copied and filtered so.
        turned = slopes.transpose(1, 3, 2, 0)[here].reshape(len(here), -1, samples)
        parts = [plain.transpose(1, 2, 0), turned]
        at_point = self.of.point_slope(block) if self.of.point else None
        if at_point is not None:
            parts.append(at_point.transpose(1, 2, 0)[here])
        return np.concatenate(parts, axis=1).transpose(2, 0, 1)

    def columns(self, block: Block) -> np.ndarray:
        """The same at all joints, (T, n, k + s k)."""
        here = self.acting_columns(block)
        full = np.zeros((len(here), len(block.names), here.shape[2]))
        full[:, list(self.joints)] = here
        return full


@dataclass(frozen=True, eq=False, kw_only=True)
class ScoreTrial:
    """What an effect brings with some shapes.

    Attributes
    ----------
    found : its score.
    loss : what it leaves, less a constant: the drop, negative.
    admissible : whether its values are possible.
    residual, jacobian : (s + 1,) and (s + 1, s), by the coordinates; None where no derivatives are
        known. Their products are those of the whitened residual and its derivatives, whose noise is
        taken out of all but the sum.
    """

    found: Score
    loss: float
    admissible: bool = True
    residual: np.ndarray | None = None
    jacobian: np.ndarray | None = None


@dataclass(frozen=True)
class MomentObjective:
    """The search for the shapes of a candidate beside a model.

    Attributes
    ----------
    evidence, fitted : the evidence, and the model without the effect as it fits it.
    one : the score of the effect from which the search begins; payloads are carried as in it.
    columns_of : where columns come from; `Evidence.columns` by default.
    """

    evidence: Evidence
    fitted: EvidenceFit
    one: Score
    columns_of: Columns | None = None

    @cached_property
    def grid(self) -> int:
        """Number of shapes that are tried of the effect."""
        return shapes_tried(self.evidence, self.one.effect)

    def score_at(self, effect: Effect) -> Score:
        """Score the effect with another shape, or taken at another value."""
        (parts,) = candidate_moments(self.evidence, self.fitted, [effect], self.columns_of)
        carried = self.one.payload_recordings
        if carried is not None:
            parts = tuple(moments_with_payload(part, self.evidence, carried) for part in parts)
        return score(self.fitted, effect, *parts, grid=self.grid, payload_recordings=carried)

    def by_derivatives(self) -> ShapeProblem[ScoreTrial]:
        """Return the search for shapes, and the value at which a column is taken, together."""
        effect, sought = self.one.effect, self._sought()
        start = _coordinates(sought, effect)
        # Not further than to the next shapes of the grid: beyond, other peaks lead astray.
        furthest = self.fitted.criteria.shapes.furthest
        reach = np.array([s.reach(furthest) for s in sought])
        lower, upper = _limits(sought)

        def trial(coordinates: np.ndarray) -> ScoreTrial:
            x = [s.at(c) for s, c in zip(sought, coordinates, strict=True)]
            shapes = len(effect.shape)
            return self._differentiated(effect.shaped(*x[:shapes]).at(x[shapes:]))

        return ShapeProblem(
            lower=np.clip(start - reach, lower, upper),
            upper=np.clip(start + reach, lower, upper),
            start=start,
            evaluate=_each(trial),
            differentiable=True,
        )

    def went_as_far_as_it_may(self, found: Score) -> bool:
        """Whether the best of `by_derivatives` lies where that ends, and its shapes go on."""
        sought, precision = self._sought(), self.fitted.criteria.shapes.precision
        at, (lower, upper) = _coordinates(sought, found.effect), _limits(sought)
        reach = np.array([s.reach(self.fitted.criteria.shapes.furthest) for s in sought])
        far = np.abs(at - _coordinates(sought, self.one.effect)) > reach - precision
        return bool(np.any(far & (at > lower + precision) & (at < upper - precision)))

    def _sought(self) -> list[ShapeParameter]:
        """The shapes of the effect, and the value at which its column is taken, as one."""
        effect, robot = self.one.effect, self.fitted.model.robot
        points = effect.parameters(robot) if effect.point else ()
        # Such a value is positive, and sought as shapes are.
        return [*effect.shape_parameters(robot), *(_as_shape(p) for p in points)]

    def by_trial(self, lower: np.ndarray, upper: np.ndarray) -> ShapeProblem[ScoreTrial]:
        """Return the search for shapes between bounds (s,) whose derivatives are not known."""
        effect = self.one.effect
        sought = effect.shape_parameters(self.fitted.model.robot)

        def trial(coordinates: np.ndarray) -> ScoreTrial:
            shape = (s.at(x) for s, x in zip(sought, coordinates, strict=True))
            found = self.score_at(effect.shaped(*shape))
            return ScoreTrial(found=found, loss=-found.drop)

        pairs = zip(sought, effect.shape, strict=True)
        start = np.array([s.coordinate(x) for s, x in pairs])
        return ShapeProblem(lower=lower, upper=upper, start=start, evaluate=_each(trial))

    def by_value(self, span: float) -> ShapeProblem[ScoreTrial]:
        """Return the search for the value at which the column is taken; `span` to each side."""
        start = np.log(self.one.effect.point)

        def trial(logarithms: np.ndarray) -> ScoreTrial:
            found = self.score_at(self.one.effect.at([float(np.exp(logarithms[0]))]))
            return self._judged(found)

        return ShapeProblem(
            lower=start - span, upper=start + span, start=start, evaluate=_each(trial)
        )

    def _judged(self, found: Score) -> ScoreTrial:
        possible = admissible(found, self.evidence, self.fitted)
        return ScoreTrial(found=found, loss=-found.drop_at_point, admissible=possible)

    def _differentiated(self, effect: Effect) -> ScoreTrial:
        """The trial of an effect with its square root and derivatives."""
        tangent = Tangent.to(effect, self.fitted.model.robot)
        ((with_model, with_self),) = candidate_moments(
            self.evidence, self.fitted, [tangent], self.columns_of
        )
        plain = slice(0, len(self.one.values))
        found = score(
            self.fitted,
            effect,
            with_model.columns(plain),
            with_self.among(plain),
            grid=self.grid,
        )
        residual, jacobian = _square_root(
            self.fitted, found, with_model.pooled().signal, with_self.pooled().signal
        )
        return replace(self._judged(found), residual=residual, jacobian=jacobian)


def _coordinates(sought: Sequence[ShapeParameter], effect: Effect) -> np.ndarray:
    every = zip(sought, (*effect.shape, *effect.point), strict=True)
    return np.array([shape.coordinate(x) for shape, x in every])


def _limits(sought: Sequence[ShapeParameter]) -> tuple[np.ndarray, np.ndarray]:
    every = np.array([(s.coordinate(s.lower), s.coordinate(s.upper)) for s in sought])
    return every[:, 0], every[:, 1]


def _as_shape(value: Parameter) -> ShapeParameter:
    """A value at which a column is taken, sought by its logarithm."""
    return ShapeParameter(value.name, value.unit, (), lower=_LEAST_VALUE, upper=value.upper)


def _each(
    trial: Callable[[np.ndarray], ScoreTrial],
) -> Callable[[Sequence[np.ndarray]], list[ScoreTrial]]:
    return lambda points: [trial(x) for x in points]


def _square_root(
    fitted: EvidenceFit, found: Score, with_model: np.ndarray, with_self: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return residual and derivatives of a least-squares problem with the given signal moments.

    Parameters
    ----------
    found : the score at these shapes.
    with_model : (p + 1, k + s k) of the model's columns and the torque with the tangent's.
    with_self : (k + s k, k + s k) of the tangent's columns with themselves.

    Returns
    -------
    (s + 1,) and (s + 1, s)
    """
    p, k = len(fitted.values), len(found.effect.parameters(fitted.model.robot))
    values = np.array(found.effect.point or found.values or (0.0,) * k)
    count = with_self.shape[0] // k - 1
    # What the torque changes by, along the coordinate of each shape.
    along = block_diag(np.eye(k), *[values[:, None]] * count)
    with_model, with_self = with_model @ along, along.T @ with_self @ along
    back = fitted.solution.project(with_model[:p])
    left = with_self - with_model[:p].T @ back
    right = with_model[p] - back.T @ fitted.pooled.signal[:p, p]
    curvature, slope = left[k:, k:], right[k:] - left[k:, :k] @ values
    if not found.effect.point:
        # Linear parameters follow (Kaufman): what they can do is not the shapes' merit.
        curvature = curvature - left[k:, :k] @ np.linalg.pinv(left[:k, :k]) @ left[:k, k:]
    size, turn = np.linalg.eigh(curvature)
    root = np.sqrt(np.clip(size, _ROUNDING * max(size[-1], 0.0), None))
    down = np.divide(turn.T @ slope, root, out=np.zeros_like(root), where=root > 0)
    # Noise and all, so that near the optimum the sum stays what it is a sum of.
    rest = fitted.error_total - found.drop_at_point - down @ down
    residual = np.append(-down, np.sqrt(max(rest, 0.0)))
    return residual, np.vstack([root[:, None] * turn.T, np.zeros(count)])
