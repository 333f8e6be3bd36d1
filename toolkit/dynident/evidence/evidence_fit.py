"""A model fitted to the evidence: instrumental variables on whitened rows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import add

import numpy as np

from dynident.criteria import Criteria
from dynident.evidence.columns import Evidence
from dynident.evidence.joint_residual import JointResidual
from dynident.evidence.noise_model import NoiseModel, flat_noise
from dynident.evidence.runs import Signals
from dynident.evidence.time_varying import time_varying_columns, time_varying_mask
from dynident.fitting.fixed_point import FixedPoint
from dynident.model import Model
from dynident.moments.replicates import time_varying_products
from dynident.moments.second_moments import SecondMoments
from dynident.moments.solution import MomentSolution, regress


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
    white : per run and joint, whitened columns and torque, (P, S, p + 1).
    moments : (B, p + 1, p + 1) of columns and torque, over all joints.
    error_signal : squared systematic residual, whitened: what no noise explains, in this metric.
    squares : (n,) mean systematic square of the residual, (N m)^2 or N^2.
    variances : (n,) of the noise; of the torque, where the noise is unknown or zero.
    """

    criteria: Criteria
    model: Model
    values: np.ndarray
    covariance: np.ndarray
    solution: MomentSolution
    noise: tuple[NoiseModel, ...]
    noise_known: bool
    white: tuple[tuple[np.ndarray, ...], ...]
    moments: SecondMoments
    error_signal: float
    squares: np.ndarray
    variances: np.ndarray

    def misfit(self, over: EvidenceFit) -> float:
        """Systematic square over the variances of another fit, summed over joints.

        By it fits are compared: `error_signal` depends on the metric, which is another one when
        less is missing, and noise in a fit's own columns would speak for it.
        """
        return float(np.sum(self.squares / over.variances))

    @property
    def rows(self) -> int:
        """Whitened rows, over all repetitions and joints; noisy copies do not count."""
        return self.moments.count

    @cached_property
    def pooled(self) -> SecondMoments:
        """The moments of all blocks together; every candidate asks for them."""
        return self.moments.pooled()

    @cached_property
    def without_each_block(self) -> np.ndarray:
        """Values of the fit to all blocks but one, for each, (B, p)."""
        least = self.criteria.noise.reliable
        blocks = range(len(self.moments.total))
        return np.array([regress(self.moments.without(b), least).values for b in blocks])

    @cached_property
    def error_total(self) -> float:
        """Squared residual, whitened, with its noise."""
        combination = np.append(-self.values, 1.0)
        return float(combination @ self.pooled.total @ combination)


def fit_evidence(evidence: Evidence, model: Model, near: EvidenceFit | None = None) -> EvidenceFit:
    """Fit a model to the runs of the evidence, and measure their noise.

    The instrumental variables are the other replicates of a run, see `dynident.moments`. Where
    columns depend on the fit, fit and columns are repeated until they agree.

    Parameters
    ----------
    evidence : recordings and their columns.
    model : with its effects and their shapes.
    near : the fit of a like model, from which columns that depend on the values start.

    Returns
    -------
    The fit, its model linearised at the values found.

    Raises
    ------
    FitError
        If the columns are not finite.
    """
    n, criteria = model.robot.n, evidence.criteria.fit
    at = _held(model, _beginning(model, near))
    torque_std = [
        float(
            np.sqrt(
                np.mean(np.concatenate([r.replicates[0].tau[:, j] for r in evidence.runs]) ** 2)
            )
        )
        for j in range(n)
    ]
    noise = tuple(flat_noise(std or 1.0) for std in torque_std) if near is None else near.noise
    known = any(run.kind != "single" for run in evidence.runs)
    reliable = evidence.criteria.noise.reliable
    columns, values, fixed_point = [], at, FixedPoint()
    for round in range(criteria.value_rounds if model.needs_values else criteria.noise_rounds):
        if not columns or model.needs_values:
            model = model.at(at)
            columns = [
                [model_columns(evidence, model, r, j, at) for j in range(n)]
                for r in range(len(evidence.runs))
            ]
        white = _whiten(evidence, columns, noise, values)
        values = regress(_moments(evidence, model, noise, white).pooled(), reliable).values
        if round == 0 and near is None:
            # Along a robot without bodies their columns are rounding errors, and any value fits.
            values = _keeping_dependent(model, at, values)
        noise = tuple(JointResidual.of(evidence, columns, values, j).noise for j in range(n))
        change = float(np.linalg.norm(_held(model, values) - at))
        small = change <= criteria.value_tolerance * np.linalg.norm(values)
        if round >= criteria.noise_rounds - (near is not None) and small:
            break
        at = _held(model, fixed_point.following(model, at, values))
    white = _whiten(evidence, columns, noise, values)
    summed = _moments(evidence, model, noise, white)
    solution = regress(summed.pooled(), reliable)
    values = solution.values
    left = [JointResidual.of(evidence, columns, values, j) for j in range(n)]
    return EvidenceFit(
        criteria=evidence.criteria,
        model=model.at(_held(model, values)),
        values=values,
        covariance=solution.covariance,
        solution=solution,
        noise=noise,
        noise_known=known,
        white=white,
        moments=summed,
        error_signal=_signal(evidence, white, values),
        squares=np.array([one.square for one in left]),
        variances=np.array(
            [one.variance or s**2 or 1.0 for one, s in zip(left, torque_std, strict=True)]
        ),
    )


def in_metric_of(evidence: Evidence, fitted: EvidenceFit, wider: EvidenceFit) -> EvidenceFit:
    """Return a fit whose rows are whitened by the noise that a wider model leaves.

    Where much is missing its own noise holds a part of that, and rivals look alike.

    Parameters
    ----------
    evidence : of both.
    fitted : the model as it fits.
    wider : the model with what may be missing.
    """
    model, reliable = fitted.model, evidence.criteria.noise.reliable
    columns = [
        [model_columns(evidence, model, r, j, fitted.values) for j in range(model.robot.n)]
        for r in range(len(evidence.runs))
    ]
    white = _whiten(evidence, columns, wider.noise, fitted.values)
    summed = _moments(evidence, model, wider.noise, white)
    solution = regress(summed.pooled(), reliable)
    return replace(
        fitted,
        values=solution.values,
        covariance=solution.covariance,
        solution=solution,
        noise=wider.noise,
        white=white,
        moments=summed,
        error_signal=_signal(evidence, white, solution.values),
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


def _keeping_dependent(model: Model, at: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Values found, but those of effects whose columns depend on the fit as they were."""
    values = np.array(found)
    for effect in model.effects:
        if effect.depends_on_fit:
            values[model.slices[effect.label]] = at[model.slices[effect.label]]
    return values


def model_columns(
    evidence: Evidence, model: Model, run: int, joint: int, values: np.ndarray | None
) -> Signals:
    """Columns of a model and the torque at one joint.

    Parameters
    ----------
    evidence, run : recordings, and which one of them.
    model : with its effects and their shapes.
    joint : column of the joint.
    values : (p,) at which columns that depend on the fit are taken; None for zeros.

    Returns
    -------
    (T, p + 1) for each replicate of the run.
    """
    replicates, size = evidence.runs[run].replicates, model.size
    payload = float(bool(evidence.runs[run].recording.payload))
    found = [np.zeros((len(one.tau), size + 1)) for one in replicates]
    for one, rigid, replicate in zip(found, evidence.rigid(run), replicates, strict=True):
        one[:, : rigid.shape[2]] = rigid[:, joint]
        one[:, size] = replicate.tau[:, joint]
    for effect in model.effects:
        joints = effect.acting_at(model.robot)
        if joint not in joints:
            continue
        own, at = model.slices[effect.label], joints.index(joint)
        for one, columns in zip(found, evidence.of(effect, run, model, values), strict=True):
            one[:, own] = columns[:, at] * payload if effect.is_payload else columns[:, at]
    return found


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
            run.fold([c @ combination for c in model_columns(evidence, model, r, j, values)])
            for j in range(model.robot.n)
        ]
        found.append(np.stack(joints, axis=-1))
    return found


def _whiten(evidence: Evidence, columns, noise, values) -> tuple[tuple[np.ndarray, ...], ...]:
    return tuple(
        tuple(run.whitened(run.moved(c, values), j, noise[j]) for j, c in enumerate(joints))
        for run, joints in zip(evidence.runs, columns, strict=True)
    )


def _moments(evidence: Evidence, model: Model, noise, white) -> SecondMoments:
    found, time_varying = [], time_varying_mask(model)
    for r, (run, joints) in enumerate(zip(evidence.runs, white, strict=True)):
        here = reduce(add, (run.moments(w, w) for w in joints))
        if run.kind == "repeated" and time_varying.any():
            own = [
                time_varying_columns(evidence, model, r, j, noise[j], w)
                for j, w in enumerate(joints)
            ]
            other = np.sum([time_varying_products(one, one, run.edges) for one in own], axis=0)
            here = here.where(time_varying[:, None] | time_varying[None, :], other)
        found.append(here)
    return SecondMoments.stacked(found)


def _signal(evidence: Evidence, white, values: np.ndarray) -> float:
    """Squared whitened residual, of what the replicates have in common."""
    combination = np.append(-values, 1.0)[:, None]
    return sum(
        float(run.moments(w @ combination, w @ combination).signal.sum())
        for run, joints in zip(evidence.runs, white, strict=True)
        for w in joints
    )
