"""A model fitted to the evidence: instrumental variables on whitened rows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import null_space

from dynident.criteria import Criteria
from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.joint_residual import JointResidual
from dynident.evidence.model_columns import joint_columns
from dynident.evidence.noise_model import NoiseModel, flat_noise
from dynident.evidence.time_varying import steady
from dynident.evidence.white_moments import (
    ColumnsOfRuns,
    White,
    moments_of,
    pooled_moments_of,
    systematic_squares,
    whiten,
    with_next,
)
from dynident.fitting.fixed_point import FixedPoint
from dynident.model import Model
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import (
    MomentSolution,
    orthonormal,
    orthonormal_directions,
    regress,
    regression_values,
)

_LEAST = 1e-13
"""Noise over the largest joint's torque: one without torque would be fitted ever more closely."""

_FIRM = 1e3  # how much firmer a body's description is than that an effect is zero
_ALONE = 1e-6
"""Square of a parameter's direction, of length 1, that what the data tell may leave out."""


@dataclass(frozen=True, kw_only=True)
class EvidenceFit:
    """A model as it fits the training data.

    Attributes
    ----------
    criteria : by which it was fitted.
    model : with its effects and their shapes.
    values : (p,) in the order of `model.names`.
    covariance : (p, p).
    solution : of the regression behind the values.
    noise : per joint.
    noise_known : whether `noise` was measured or given; otherwise it is the residual.
    white : per stack of runs and joint, whitened columns and torque.
    moments : (B, p + 1, p + 1) of columns and torque, over all joints.
    error_signal : squared systematic residual, whitened: what no noise explains, in this metric.
    squares : (n,) mean systematic square of the residual, (N m)^2 or N^2.
    variances : (n,) of the noise; of the torque, where the noise is unknown or zero.
    torque_peaks : (n,) largest torque that friction can have balanced, N m or N: what was measured
        and what the bodies make.
    settled : whether columns that depend on the values agree with them.
    """

    criteria: Criteria
    model: Model
    values: np.ndarray
    covariance: np.ndarray
    solution: MomentSolution
    noise: tuple[NoiseModel, ...]
    noise_known: bool
    white: White
    moments: SecondMoments
    error_signal: float
    squares: np.ndarray
    variances: np.ndarray
    torque_peaks: np.ndarray
    settled: bool = True

    def misfit(self, over: EvidenceFit) -> float:
        """Systematic square over the variances of another fit, summed over joints.

        By it fits are compared: `error_signal` depends on the metric, which is another one when
        less is missing, and noise in a fit's own columns would speak for it.
        """
        return float(np.sum(self.squares / over.variances))

    @cached_property
    def rows(self) -> int:
        """Whitened rows, over all repetitions and joints; noisy copies do not count."""
        return self.moments.count

    @cached_property
    def pooled(self) -> SecondMoments:
        """The moments of all blocks together; every candidate asks for them."""
        return self.moments.pooled()

    @cached_property
    def alone(self) -> np.ndarray:
        """Parameters that the data tell on their own, not only together with others, (p,) bool."""
        told, _ = _told_directions(self.pooled)
        return np.sum(told**2, axis=1) > 1.0 - _ALONE

    @cached_property
    def without_each_block(self) -> np.ndarray:
        """Values of the fit to all blocks but one, for each, (B, p)."""
        least = self.criteria.noise.reliable
        each = self.moments.without_each()
        return np.array([regression_values(others, least) for others in each])

    def beside(self, effect: Effect) -> EvidenceFit:
        """Return the fit with the moments that the columns of an effect are to be compared with.

        Parameters
        ----------
        effect : that the model may lack.

        Returns
        -------
        As it is, but for an effect that depends on the time, where a motion repeats.
        """
        return self._in_session if effect.time_varying else self

    @cached_property
    def _in_session(self) -> EvidenceFit:
        """The fit with the next repetition as the instrument of each."""
        repeats = any(joints[0].stack.kind == "repeated" for joints in self.white)
        if self.model.is_time_varying or not repeats:
            return self
        parts = [
            [steady(one.dense()) for one in joints] if joints[0].stack.kind == "repeated" else []
            for joints in self.white
        ]
        summed = with_next(self.white, parts)
        pooled = summed.pooled()
        solution = regress(pooled, self.criteria.noise.reliable)
        values = _near_description(self.model, solution.values, pooled)
        combination = np.append(-values, 1.0)
        return replace(
            self,
            values=values,
            covariance=solution.covariance,
            solution=solution,
            moments=summed,
            error_signal=float(combination @ pooled.signal @ combination),
        )

    @cached_property
    def error_total(self) -> float:
        """Squared residual, whitened, with its noise."""
        combination = np.append(-self.values, 1.0)
        return float(combination @ self.pooled.total @ combination)


def fit_evidence(
    evidence: Evidence,
    model: Model,
    near: EvidenceFit | None = None,
    *,
    noise_rounds: int | None = None,
) -> EvidenceFit:
    """Fit a model to the runs of the evidence, and measure their noise.

    The instrumental variables are the other replicates of a run, see `dynident.moments`. Where
    columns depend on the fit, fit and columns are repeated until they agree.

    Parameters
    ----------
    evidence : recordings and their columns.
    model : with its effects and their shapes.
    near : the fit of a like model, from which columns that depend on the values start.
    noise_rounds : fits at least, with the noise measured after each; as `FitCriteria` if None.

    Returns
    -------
    The fit, its model linearised at the values found.

    Raises
    ------
    FitError
        If the columns are not finite.
    """
    criteria, reliable = evidence.criteria.fit, evidence.criteria.noise.reliable
    at = _held(model, _beginning(model, near))
    torque_std = _torque_rms(evidence)
    noise = tuple(flat_noise(std or 1.0) for std in torque_std) if near is None else near.noise
    noise_rounds = criteria.noise_rounds if noise_rounds is None else noise_rounds
    columns, values, settled, fixed_point = [], at, True, FixedPoint()
    white = None if near is None else near.white
    for round in range(criteria.value_rounds if model.needs_values else noise_rounds):
        if not columns or model.needs_values:
            model = model.at(at)
            columns = _columns(evidence, model, at)
        white = whiten(evidence, columns, noise, values, white)
        pooled = pooled_moments_of(evidence, model, noise, white)
        values = regression_values(pooled, reliable)
        if model.needs_values:
            values = _near_description(model, values, pooled)
        if round == 0 and near is None:
            # Along a robot without bodies their columns are rounding errors, and any value fits.
            values = _keeping_dependent(model, at, values)
        left = _left(evidence, columns, values)
        noise = tuple(_no_less(one.noise, _LEAST * max(torque_std)) for one in left)
        found = _held(model, values)
        small = np.linalg.norm(found - at) <= criteria.value_tolerance * np.linalg.norm(values)
        settled = bool(small) or not model.needs_values
        enough = round >= noise_rounds - (near is not None)
        if enough and (small or fixed_point.stalls):
            break
        # What is held moves nothing: its distance to the value found would seem to be a swing.
        at = fixed_point.following(model, at, found)
    white = whiten(evidence, columns, noise, values, white)
    summed = moments_of(evidence, model, noise, white)
    solution = regress(summed.pooled(), reliable)
    values = _near_description(model, solution.values, summed.pooled())
    left = _left(evidence, columns, values)
    return EvidenceFit(
        criteria=evidence.criteria,
        model=model.at(_held(model, values)),
        values=values,
        covariance=solution.covariance,
        solution=solution,
        noise=noise,
        noise_known=any(run.kind != "single" for run in evidence.runs),
        white=white,
        moments=summed,
        error_signal=float(systematic_squares(evidence, white, values).sum()),
        squares=np.array([one.square for one in left]),
        variances=np.array(
            [one.variance or s**2 or 1.0 for one, s in zip(left, torque_std, strict=True)]
        ),
        torque_peaks=friction_reach(evidence, values),
        settled=settled,
    )


def _columns(evidence: Evidence, model: Model, values: np.ndarray) -> ColumnsOfRuns:
    """Columns of a model and the torque."""
    return [
        [joint_columns(evidence, model, r, j, values) for j in range(model.robot.n)]
        for r in range(len(evidence.runs))
    ]


def _left(evidence: Evidence, columns: ColumnsOfRuns, values: np.ndarray) -> list[JointResidual]:
    """What values (p,) leave at each joint."""
    return [JointResidual.of(evidence, columns, values, j) for j in range(len(columns[0]))]


def _torque_rms(evidence: Evidence) -> list[float]:
    """Root mean square of the torque of each joint, in the first replicate of each run."""
    tau = np.concatenate([run.replicates[0].tau for run in evidence.runs])
    return [float(np.sqrt(np.mean(tau[:, j] ** 2))) for j in range(tau.shape[1])]


def _no_less(noise: NoiseModel, least: float) -> NoiseModel:
    """Noise that is at least of some size (N m or N)."""
    return replace(noise, std=least) if noise.std < least else noise


def friction_reach(evidence: Evidence, values: np.ndarray) -> np.ndarray:
    """Return the largest torque that friction can have balanced at each joint, (n,) N m or N.

    Parameters
    ----------
    evidence : the recordings: what was measured.
    values : of a fitted model, the base parameters first: what its bodies make.
    """
    found = [
        [
            np.abs(values[at] @ x).max(initial=0.0)
            for at, x in zip(one.places, one.rows, strict=True)
        ]
        for one in (evidence.rigid(r)[0] for r in range(len(evidence.runs)))
    ]
    return evidence.torque_peaks + np.max(found, axis=0)


def in_metric_of(evidence: Evidence, fitted: EvidenceFit, other: EvidenceFit) -> EvidenceFit:
    """Return a fit whose rows are whitened by the noise that another one leaves.

    Where much is missing its own noise holds a part of that, and rivals look alike.

    Parameters
    ----------
    evidence : of both.
    fitted : the model as it fits.
    other : the fit whose noise counts: of a wider model, or of a rival.
    """
    model, reliable = fitted.model, evidence.criteria.noise.reliable
    columns = _columns(evidence, model, fitted.values)
    white = whiten(evidence, columns, other.noise, fitted.values, fitted.white)
    summed = moments_of(evidence, model, other.noise, white)
    solution = regress(summed.pooled(), reliable)
    values = _near_description(model, solution.values, summed.pooled())
    return replace(
        fitted,
        values=values,
        covariance=solution.covariance,
        solution=solution,
        noise=other.noise,
        white=white,
        moments=summed,
        error_signal=float(systematic_squares(evidence, white, values).sum()),
    )


def _beginning(model: Model, near: EvidenceFit | None) -> np.ndarray:
    """Values at which columns that depend on them are taken first, (p,)."""
    if near is None:
        return model.linearisation_point()
    known = dict(zip(near.model.names, near.values, strict=True))
    return np.array(
        [
            known.get(name, x)
            for name, x in zip(model.names, model.linearisation_point(), strict=True)
        ]
    )


def _held(model: Model, values: np.ndarray) -> np.ndarray:
    """Values, but where a column is that of a whole response at a value: that value.

    Another dead zone is another motion of the link: it is sought as shapes are, not iterated on.
    """
    held = np.array(values)
    for effect in model.effects:
        if effect.point and effect.is_dynamic_response:
            held[model.slices[effect.label]] = effect.point
    return held


def _near_description(model: Model, values: np.ndarray, moments: SecondMoments) -> np.ndarray:
    """Values (p,), with what the data leave open as near to the description as it can be.

    Where a mass is told only together with a rotor, half of both would be the least values: a base
    that is tilted feels the mass alone. Bodies are described, and effects take the rest.
    """
    told, scale = _told_directions(moments)
    left_open = null_space(told.T)
    firm = np.ones(model.size)
    firm[: len(model.base.independent)] = _FIRM
    off = firm * scale * (model.given_values() - values)
    return values + left_open @ np.linalg.lstsq(firm[:, None] * left_open, off)[0] / scale


def _told_directions(moments: SecondMoments) -> tuple[np.ndarray, np.ndarray]:
    """Directions that the columns show, (p, r) orthonormal, and the columns' norms (p,).

    Of scaled parameters: each times the norm of its column.
    """
    scale = np.sqrt(np.diag(moments.gram))
    scale = np.where(scale > 0, scale, 1.0)
    directions = orthonormal_directions(moments.gram, scale)
    return orthonormal(scale[:, None] * directions), scale


def _keeping_dependent(model: Model, at: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Values found, but those of effects whose columns depend on the fit as they were."""
    values = np.array(found)
    for effect in model.effects:
        if effect.depends_on_fit:
            values[model.slices[effect.label]] = at[model.slices[effect.label]]
    return values


def residuals(evidence: Evidence, model: Model, values: np.ndarray) -> list[np.ndarray]:
    """Torque minus prediction of each run, folded.

    Parameters
    ----------
    evidence : recordings and their columns.
    model, values : (p,) that predict.

    Returns
    -------
    (P, S, n) in N m or N for each run.
    """
    combination = np.append(-values, 1.0)
    found = []
    for r, run in enumerate(evidence.runs):
        joints = [
            run.fold([c.times(combination) for c in joint_columns(evidence, model, r, j, values)])
            for j in range(model.robot.n)
        ]
        found.append(np.stack(joints, axis=-1))
    return found


def signal_by_joint(evidence: Evidence, fitted: EvidenceFit) -> np.ndarray:
    """Return the parts of `error_signal` that are left at each joint, (n,).

    Parameters
    ----------
    evidence, fitted : the recordings, and the model as it fits them.
    """
    return systematic_squares(evidence, fitted.white, fitted.values)
