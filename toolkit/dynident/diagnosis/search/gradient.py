"""The shapes at which a candidate explains most, by least squares with exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import least_squares

from dynident.diagnosis.search.scoring import Columns, Score, candidate_moments, impossible, score
from dynident.effects import Block, Effect, Needs, Parameter
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.moments.replicated import Moments

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
    def needs(self) -> Needs:  # type: ignore[override]
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


def grid_of(effect: Effect, fitted: EvidenceFit) -> int:
    """Number of shapes that are tried of an effect."""
    return sum(1 for _ in effect.variants(fitted.model.robot))


def by_gradient(
    evidence: Evidence, fitted: EvidenceFit, one: Score, columns_of: Columns | None
) -> Score:
    """Minimise the residual over the shapes with exact derivatives, linear parameters solved for.

    A value at which a column is taken is sought together with the shapes. Each trial is reduced to
    its moments, of which a square root is a least-squares problem with few rows.
    """
    effect, k = one.effect, len(one.values)
    shapes = effect.shape_parameters(fitted.model.robot)
    pointed = effect.parameters(fitted.model.robot) if effect.point else ()
    limits = np.array([(s.lower, s.upper) for s in (*shapes, *pointed)]).T
    grid = grid_of(effect, fitted)
    best = one

    @lru_cache(maxsize=1)
    def at(logarithms: tuple[float, ...]) -> _Trial:
        nonlocal best
        x = np.clip(np.exp(logarithms), *limits)
        trial = effect.shaped(*x[: len(shapes)]).at(x[len(shapes) :].tolist())
        tangent = Tangent.to(trial)
        ((with_model, with_self),) = candidate_moments(evidence, fitted, [tangent], columns_of)
        plain = slice(0, k)
        found = score(
            fitted,
            trial,
            Moments(with_model.signal[:, :, plain], with_model.total[:, :, plain]),
            Moments(with_self.signal[:, plain, plain], with_self.total[:, plain, plain]),
            grid=grid,
        )
        if found.drop_at_point > best.drop_at_point and not impossible(found, fitted):
            best = found
        return _Trial.of(fitted, found, with_model.sums()[0], with_self.sums()[0])

    # Not further than to the next shapes of the grid: beyond, other peaks lead astray.
    start, criteria = np.array([*effect.shape, *effect.point]), fitted.criteria.shapes
    reach = (1.0 / criteria.furthest, criteria.furthest)
    low, high = np.log(np.clip(np.outer(reach, start), *limits))
    least_squares(
        lambda x: at(tuple(x)).residual,
        np.log(start),
        lambda x: at(tuple(x)).jacobian,  # type: ignore[arg-type]
        bounds=(low - 1e-9, high + 1e-9),
        max_nfev=criteria.evaluations,
        xtol=criteria.gradient_precision,
        # A flat metric hides what matters in a sharp one.
        ftol=criteria.gradient_fall,
    )
    return best


@dataclass(frozen=True, eq=False)
class _Trial:
    """What is left at one shape, as a least-squares problem with one row more than unknowns.

    Attributes
    ----------
    residual, jacobian : (s + 1,) and (s + 1, s), by the logarithms; their products are those of the
        whitened residual and its derivatives, whose noise is taken out of all but the sum.
    """

    residual: np.ndarray
    jacobian: np.ndarray

    @classmethod
    def of(
        cls, fitted: EvidenceFit, found: Score, with_model: np.ndarray, with_self: np.ndarray
    ) -> _Trial:
        """Return the problem from signal moments.

        Parameters
        ----------
        found : the score at this shape.
        with_model : (p + 1, k + s k) of the model's columns and the torque with the tangent's.
        with_self : (k + s k, k + s k) of the tangent's columns with themselves.
        """
        p, k = len(fitted.values), len(found.effect.parameters(fitted.model.robot))
        values = np.array(found.effect.point or found.values or (0.0,) * k)
        count = with_self.shape[0] // k - 1
        # What the torque changes by, along the logarithm of each shape.
        along = block_diag(np.eye(k), *[values[:, None]] * count)
        with_model, with_self = with_model @ along, along.T @ with_self @ along
        back = fitted.solution.project(with_model[:p])
        left = with_self - with_model[:p].T @ back
        right = with_model[p] - back.T @ fitted.moments.sums()[0][:p, p]
        curvature, slope = left[k:, k:], right[k:] - left[k:, :k] @ values
        if not found.effect.point:
            # Linear parameters follow (Kaufman): what they can do is not the shapes' merit.
            curvature = curvature - left[k:, :k] @ np.linalg.pinv(left[:k, :k]) @ left[:k, k:]
        size, turn = np.linalg.eigh(curvature)
        root = np.sqrt(np.clip(size, _ROUNDING * max(size[-1], 0.0), None))
        down = np.divide(turn.T @ slope, root, out=np.zeros_like(root), where=root > 0)
        # Noise and all, so that near the optimum the sum stays what it is a sum of.
        rest = fitted.error_total - found.drop_at_point - down @ down
        return cls(
            np.append(-down, np.sqrt(max(rest, 0.0))),
            np.vstack([root[:, None] * turn.T, np.zeros(count)]),
        )
