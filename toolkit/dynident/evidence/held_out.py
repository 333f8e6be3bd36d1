"""Errors where the model was not fitted: on test recordings, or on held-out blocks of time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy import special

from dynident.criteria import NoiseCriteria
from dynident.evidence.columns.joint_columns import JointColumns
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.model_columns import joint_columns
from dynident.evidence.noise_model import differences, inflation, systematic_square
from dynident.fitting.estimate import Estimate
from dynident.moments.replicates import Kind


@dataclass(frozen=True, kw_only=True)
class HeldOutRun:
    """One recording with its prediction, (T, n) each, SI units.

    Attributes
    ----------
    certain : (T, n) mask of the rows by which a joint is judged: its dry friction is known.
    block : (T,) number of the block of time that each row is in; None where they are not cut into
        any.
    """

    name: str
    certain: np.ndarray
    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    block: np.ndarray | None = None

    @property
    def residual(self) -> np.ndarray:
        """Measured minus predicted torque."""
        return self.measured - self.predicted


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """What a model misses on held-out data.

    Attributes
    ----------
    runs : with predictions.
    noise_std : (n,) N m or N; None where the noise is unknown.
    ratio : (n,) systematic residual over noise (root mean squares); None likewise.
    least_ratio : (n,) what that ratio is at least, with the confidence of the criteria, the
        uncertainty of the parameters accounted for; None likewise.
    inflation : (n,) variance of a mean of consecutive noise over that of white noise.
    rounding : (n,) mean square of the residual that encoders' steps leave; None where that was not
        looked at.
    what : recordings that no fit has seen, or blocks of time of those that were fitted, each
        predicted by a fit to all others.
    """

    runs: tuple[HeldOutRun, ...]
    noise_std: np.ndarray | None
    ratio: np.ndarray | None
    least_ratio: np.ndarray | None
    inflation: np.ndarray
    rounding: np.ndarray | None = None
    what: Literal["recordings", "blocks of time"] = "recordings"

    @property
    def torque_rms(self) -> np.ndarray:
        """Root mean square of the measured torque, (n,)."""
        return self._rms([run.measured for run in self.runs])

    @property
    def residual_rms(self) -> np.ndarray:
        """Root mean square of the residual, (n,)."""
        return self._rms([run.residual for run in self.runs])

    def of(self, run: HeldOutRun) -> HeldOut:
        """The same of one recording alone, without its noise."""
        return replace(self, runs=(run,), noise_std=None, ratio=None, least_ratio=None)

    def _rms(self, values: list[np.ndarray]) -> np.ndarray:
        """Root mean square of what each run has, (T, n), over the rows that are judged."""
        certain = np.concatenate([run.certain for run in self.runs])
        squares = np.sum(np.concatenate(values) ** 2, axis=0, where=certain)
        return np.sqrt(squares / np.maximum(certain.sum(axis=0), 1))

    @property
    def joint_errors(self) -> np.ndarray:
        """Norm of the residual over norm of the torque, (n,)."""
        return self.residual_rms / np.where(self.torque_rms > 0, self.torque_rms, np.nan)

    @property
    def error(self) -> float:
        """The same over all joints."""
        return float(np.linalg.norm(self.residual_rms) / np.linalg.norm(self.torque_rms))

    @property
    def floor(self) -> float | None:
        """Error of a model from which nothing is missing."""
        if self.noise_std is None:
            return None
        return float(np.linalg.norm(self.noise_std) / np.linalg.norm(self.torque_rms))


def on_recordings(evidence: Evidence, fitted: EvidenceFit | Estimate) -> HeldOut:
    """Judge a fitted model on the recordings of the evidence, which it has not seen."""
    combination = np.append(-fitted.values, 1.0)
    n = fitted.model.robot.n
    runs, folded, doubt = [], [], []
    for r, run in enumerate(evidence.runs):
        first = run.replicates[0]
        joints = [joint_columns(evidence, fitted.model, r, j, fitted.values) for j in range(n)]
        left = [[one.times(combination) for one in each] for each in joints]
        residual = np.stack([one[0] for one in left], axis=-1)
        kept, predicted = run.kept, first.tau - residual
        runs.append(
            HeldOutRun(
                name=run.recording.name,
                certain=run.certain_rows[kept],
                t=first.t[kept],
                q=first.q[kept],
                v=first.v[kept],
                a=first.a[kept],
                measured=first.tau[kept],
                predicted=predicted[kept],
                block=run.block_of_rows[kept],
            )
        )
        folded.append(np.stack([run.fold(one) for one in left], axis=-1))
        doubt.append(np.array([prediction_variance(c[0], fitted) for c in joints]))
    return _judged(evidence, tuple(runs), folded, doubt)


def on_blocks(evidence: Evidence, fitted: EvidenceFit) -> HeldOut:
    """Judge a model on blocks of time, each predicted by the fit to all others."""
    n = fitted.model.robot.n
    runs, folded, doubt, block = [], [], [], 0
    for r, run in enumerate(evidence.runs):
        joints = [joint_columns(evidence, fitted.model, r, j, fitted.values) for j in range(n)]
        columns = [run.fold([one.used for one in each]) for each in joints]
        residual = np.empty((*columns[0].shape[:2], n))
        for start, stop in zip(run.edges[:-1], run.edges[1:], strict=True):
            combination = np.append(-fitted.without_each_block[block], 1.0)
            for j, used in enumerate(columns):
                residual[:, start:stop, j] = used[:, start:stop] @ combination[joints[j][0].places]
            block += 1
        measured = 1 if run.kind == "noise_augmented" else len(residual)
        rows = run.index[:measured].ravel()
        order = np.argsort(rows)
        rows, misfit = rows[order], residual[:measured].reshape(-1, n)[order]
        first = run.replicates[0]
        tau = first.tau[rows]
        runs.append(
            HeldOutRun(
                name=run.recording.name,
                certain=run.certain_rows[rows],
                t=first.t[rows],
                q=first.q[rows],
                v=first.v[rows],
                a=first.a[rows],
                measured=tau,
                predicted=tau - misfit,
                block=run.block_of_rows[rows],
            )
        )
        folded.append(residual)
        doubt.append(np.array([prediction_variance(c[0], fitted) for c in joints]))
    judged = _judged(evidence, tuple(runs), folded, doubt)
    return replace(judged, what="blocks of time")


def on_held_out(evidence: Evidence, held: Evidence | None, fitted: EvidenceFit) -> HeldOut:
    """Judge a model on test recordings; on blocks of the training recordings without any.

    Parameters
    ----------
    evidence, held : of the training and of the test recordings.
    fitted : the model.

    Returns
    -------
    With the noise that these recordings tell themselves.
    """
    return on_blocks(evidence, fitted) if held is None else on_recordings(held, fitted)


def with_noise_of(judged: HeldOut, noise: HeldOut, criteria: NoiseCriteria) -> HeldOut:
    """Judge recordings that do not tell their own noise by the noise measured on others.

    What exceeds that noise is systematic. The mean square of noise alone varies by 2 s^4 over the
    number of rows, times what its colour costs.

    Parameters
    ----------
    judged : recordings of which no motion repeats.
    noise : others of the same robot, whose noise is known.
    criteria : which confidence a lower limit has.

    Returns
    -------
    `judged` with noise, ratio and its lower limit; as it is where it has them, or `noise` has none.
    """
    if judged.noise_std is not None or noise.noise_std is None:
        return judged
    power = noise.noise_std**2
    safe = np.where(power > 0, power, 1.0)
    rows = np.maximum(np.sum([run.certain.sum(axis=0) for run in judged.runs], axis=0), 1)
    excess = judged.residual_rms**2 - power
    error = power * np.sqrt(2.0 * noise.inflation / rows)
    quantile = float(special.ndtri(criteria.confidence))
    ratio, least = (
        np.sqrt(np.clip(x, 0.0, None) / safe) for x in (excess, excess - quantile * error)
    )
    return replace(
        judged,
        noise_std=noise.noise_std,
        ratio=ratio,
        least_ratio=least,
        inflation=noise.inflation,
    )


def prediction_variance(columns: JointColumns, fitted: EvidenceFit | Estimate) -> float:
    """Mean square of a joint's torque that the covariance of the parameters makes uncertain.

    Parameters
    ----------
    columns : of the model along a recording, and the torque.
    fitted : the model.

    Returns
    -------
    (N m)^2 or N^2
    """
    rows, places = columns.used[:, :-1].T, columns.places[:-1]
    doubt = fitted.covariance[np.ix_(places, places)]
    return float(np.vdot(rows, doubt @ rows)) / rows.shape[1]


def _variance(residual: np.ndarray, kind: Kind, criteria: NoiseCriteria) -> float:
    """Variance of `systematic_square` (P, S), by the noise alone: what is missing is no chance.

    With noise of variance s^2, which may change in time, and what the replicates have in common
    being m: mean (2 s^4 / (P (P - 1)) + 4 m^2 s^2 / P) / S, times what the colour of the noise
    costs.
    """
    noise = differences(residual, kind)
    count = len(residual) if kind == "repeated" else 1
    common = residual.mean(axis=0) if kind == "repeated" else residual[0]
    freedom = len(residual) - 1
    local = np.mean(noise**2, axis=0)
    fourth = float(np.mean(local**2)) / (1.0 + 2.0 / freedom)
    mixed = max(float(np.mean(common**2 * local)) - fourth / count, 0.0)
    per_instant = 2.0 * fourth / max(count * (count - 1), 1) + 4.0 * mixed / count
    rows = list(noise)
    grown = max(inflation(rows, criteria), inflation(rows, criteria, power=2))
    return per_instant * grown / residual.shape[1]


def _judged(
    evidence: Evidence,
    runs: tuple[HeldOutRun, ...],
    folded: list[np.ndarray],
    doubt: list[np.ndarray],
) -> HeldOut:
    """Split the residual into what repeats and what does not.

    Parameters
    ----------
    folded : residual of each run, (P, S, n).
    doubt : mean square of the prediction's error that the parameters' covariance stands for, of
        each run, (n,).
    """
    n, criteria = runs[0].measured.shape[1], evidence.criteria.noise
    pairs = [(run, e) for run, e in zip(evidence.runs, folded, strict=True) if run.kind != "single"]
    if not pairs:
        return HeldOut(
            runs=runs, noise_std=None, ratio=None, least_ratio=None, inflation=np.ones(n)
        )
    instants = np.array([e.shape[1] for e in folded])
    found = [
        _JointNoise.of(
            [(run.kind, e[:, run.certain(j), j]) for run, e in pairs],
            float(np.average([d[j] for d in doubt], weights=instants)),
            criteria,
        )
        for j in range(n)
    ]
    power, excess, least = (
        np.array([getattr(one, name) for one in found]) for name in ("power", "excess", "least")
    )
    safe = np.where(power > 0, power, 1.0)
    ratio, at_least = (np.sqrt(np.clip(x, 0.0, None) / safe) for x in (excess, least))
    return HeldOut(
        runs=runs,
        noise_std=np.sqrt(power),
        ratio=ratio,
        least_ratio=at_least,
        inflation=np.array([one.inflation for one in found]),
    )


@dataclass(frozen=True, kw_only=True)
class _JointNoise:
    """What repeats in the residual of one joint, and what does not; mean squares.

    Attributes
    ----------
    power : of the noise.
    excess, least : of what is systematic, and what that is at least.
    inflation : variance of a mean of consecutive noise over that of white noise.
    """

    power: float
    excess: float
    least: float
    inflation: float

    @classmethod
    def of(
        cls, residuals: list[tuple[Kind, np.ndarray]], doubt: float, criteria: NoiseCriteria
    ) -> _JointNoise:
        """Split the residuals of a joint, (P, S) of each run.

        Parameters
        ----------
        residuals : with what their replicates are.
        doubt : mean square of what the parameters' covariance makes uncertain.
        criteria : for the noise, and the confidence of a lower limit.

        Returns
        -------
        All zero, of no colour, where no instant of the joint counts: nothing is seen of it.
        """
        residuals = [(kind, e) for kind, e in residuals if e.shape[1]]
        if not residuals:
            return cls(power=0.0, excess=0.0, least=0.0, inflation=1.0)
        noise = [differences(e, kind) for kind, e in residuals]
        sizes = np.array([e.shape[1] for _, e in residuals])
        excess = np.average([systematic_square(e, kind) for kind, e in residuals], weights=sizes)
        spread = np.array([_variance(e, kind, criteria) for kind, e in residuals])
        error = np.sqrt((sizes**2 @ spread) / sizes.sum() ** 2)
        # Of a square over its mean, in the worst of cases.
        largest = float(special.chdtri(1, 1.0 - criteria.confidence))
        certainly = float(special.ndtri(criteria.confidence)) * error + largest * doubt
        return cls(
            power=float(np.mean(np.concatenate([d.ravel() for d in noise]) ** 2)),
            excess=float(excess),
            least=float(excess - certainly),
            inflation=inflation([row for d in noise for row in d], criteria),
        )
