"""Torques against those of the robot as described: what no regression can tell, their unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.criteria import WiringCriteria
from dynident.model import Model
from dynident.wiring.assignment import Assignment, Hypothesis
from dynident.wiring.regressions.wiring_regression import WiringRegression
from dynident.wiring.regressions.wiring_rows import WiringRows

_ABOUT = 2.5
"""Factor within which an inertia is about the described one: a rotor may weigh as much again, and
a radian of the motor behind a usual screw is 3 mm or more."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DescribedScale:
    """How large the torques are beside those of the described bodies.

    Attributes
    ----------
    factor : (n,) measured over described torque, friction, rotors, springs and offsets apart.
    known : (n,) whether the described torque shows in the measured one at all.
    share : (n,) the described torque's part in the measured one, of their rms.
    over_effort : (n,) rms of the torque over the limit in the description; 0 where none is stated.
    """

    factor: np.ndarray
    known: np.ndarray
    share: np.ndarray
    over_effort: np.ndarray

    @classmethod
    def of(
        cls, model: Model, rows: WiringRows, now: Assignment, criteria: WiringCriteria
    ) -> DescribedScale:
        """Compare torques with those of the description.

        Parameters
        ----------
        model : whose bodies are the described ones.
        rows, now : the rows, and what belongs to which joint.
        criteria : when a torque is said to show.

        Returns
        -------
        Factor and limit of each joint.
        """
        robot = model.robot
        motion = rows.moved(now.change)
        tau = rows.tau[:, now.torque_of] * now.torque_scale
        described = robot.inverse_dynamics(motion.q, motion.v, motion.a)
        factor, share = np.zeros((2, robot.n))
        known = np.zeros(robot.n, dtype=bool)
        for j in range(robot.n):
            q, v, a = motion.q[:, j], motion.v[:, j], motion.a[:, j]
            own = [v, np.tanh(v / model.friction_widths[j]), a, q, np.ones(len(q))]
            X = np.column_stack([described[:, j], *own])
            if not np.all(np.isfinite(X)):
                continue
            size = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
            found = np.linalg.lstsq(X / size, tau[:, j], rcond=1e-9)[0]
            left = float(np.sum((tau[:, j] - X / size @ found) ** 2)) / rows.independent
            inverse = np.linalg.pinv((X / size).T @ (X / size), rcond=1e-9, hermitian=True)
            std = np.sqrt(max(left * inverse[0, 0], 1e-300))
            factor[j] = found[0] / size[0]
            known[j] = found[0] > criteria.described_z * std
            share[j] = abs(found[0]) / max(float(np.linalg.norm(tau[:, j])), 1e-300)
        efforts = np.array([joint.effort for joint in robot.joints])
        rms = np.sqrt(np.mean(tau**2, axis=0))
        return cls(factor=factor, known=known, share=share, over_effort=rms / efforts)

    def confirmed(self, criteria: WiringCriteria) -> bool:
        """Whether the described torques show at most joints, in about their size."""
        known = np.flatnonzero(self.known)
        if len(known) < max(1, len(self.known) / 2):
            return False
        return bool(np.abs(np.log(self._typical(known))) < np.log(criteria.as_described))

    def hypothesis(self, now: Assignment, criteria: WiringCriteria) -> Hypothesis | None:
        """Another unit, or the motor side of gears, where the torques are far from described.

        Parameters
        ----------
        now : what belongs to which joint.
        criteria : how far is far.
        """
        n = len(self.factor)
        known = np.flatnonzero(self.known)
        every = tuple(range(n))
        if len(known) >= max(1, n / 2):
            typical = self._typical(known)
            low, high = criteria.milli
            if low < typical < high:
                mended = now.torques_scaled(1e-3, *every)
                return Hypothesis(kind="torque_unit", joints=every, mended=mended, ratios=(1e-3,))
            if np.all(self.factor[known] < 1 / criteria.least_gear):
                factors = np.where(
                    self.known, 1 / np.where(self.known, self.factor, 1), 1 / typical
                )
                mended = now
                for j, factor in enumerate(factors):
                    mended = mended.torques_scaled(float(factor), j)
                given = tuple(float(x) for x in factors)
                return Hypothesis(kind="torque_scale", joints=every, mended=mended, ratios=given)
            odd = np.abs(np.log(self.factor[known] / typical)) > np.log(criteria.odd_one)
            # What the model lacks may look a little like a small described torque.
            for j in known[odd & (self.share[known] > criteria.described_share)]:
                factor = typical / float(self.factor[j])
                mended = now.torques_scaled(factor, int(j))
                return Hypothesis(
                    kind="torque_scale", joints=(int(j),), mended=mended, ratios=(factor,)
                )
        for j in np.flatnonzero(~self.known & (self.over_effort > criteria.beyond_effort)):
            mended = now.torques_scaled(1e-3, int(j))
            return Hypothesis(kind="torque_unit", joints=(int(j),), mended=mended, ratios=(1e-3,))
        return None

    def _typical(self, known: np.ndarray) -> float:
        """The factor of most joints; of two, the one that is nearer to the description."""
        logs = np.sort(np.log(self.factor[known]))
        if len(logs) == 2:
            return float(np.exp(logs[np.argmin(np.abs(logs))]))
        return float(np.exp(np.median(logs)))


def far_from_described(model: Model, regression: WiringRegression, inertia: np.ndarray) -> float:
    """How far inertias are from the described ones: mean of the logarithm of their ratio.

    Parameters
    ----------
    model : whose bodies are the described ones.
    regression : along a motion.
    inertia : (n,) kg m^2 or kg, that were fitted.

    Returns
    -------
    Zero where they are as described.
    """
    described = _described(model, regression)
    known = (described > 0) & (inertia > 0)
    if not known.any():
        return 0.0
    return float(np.mean(np.abs(np.log(inertia[known] / described[known]))))


def moves_as_described(
    model: Model, regression: WiringRegression, inertia: np.ndarray, joints: Sequence[int]
) -> bool:
    """Whether what joints move is about what the description says, rotors and all.

    Parameters
    ----------
    model, regression, inertia : as for `far_from_described`.
    joints : their numbers; those whose bodies the description does not know count for nothing.

    Returns
    -------
    False where one of them is far from it, or none is known.
    """
    described = _described(model, regression)
    known = [j for j in joints if described[j] > 0]
    ratio = inertia[known] / described[known]
    return bool(known) and bool(np.all((ratio > 1 / _ABOUT) & (ratio < _ABOUT)))


def _described(model: Model, regression: WiringRegression) -> np.ndarray:
    """Mean inertia at each joint (n,) of the described bodies."""
    kept = len(model.base.independent)
    return np.asarray(regression.inertia_of[:, :kept] @ model.given_values()[:kept])
