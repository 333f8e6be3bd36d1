"""What a fit leaves at one joint: systematic residual and noise, told apart by replicates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.criteria import Criteria
from dynident.evidence.columns.joint_columns import JointColumns
from dynident.evidence.evidence import Evidence
from dynident.evidence.noise_model import (
    NoiseModel,
    SpeedClasses,
    differences,
    flat_noise,
    measure_noise,
    systematic_square,
)


@dataclass(frozen=True, kw_only=True)
class JointResidual:
    """What a fit leaves at one joint.

    Attributes
    ----------
    stretches, classes : of noise in the order of time, and classes of the joint's speed in them.
    plain : residuals of which nothing tells the noise.
    systematic : mean square of what the replicates of a run have in common, for each.
    """

    criteria: Criteria
    stretches: list[np.ndarray]
    classes: SpeedClasses
    plain: list[np.ndarray]
    systematic: list[float]

    @classmethod
    def of(
        cls,
        evidence: Evidence,
        columns: Sequence[Sequence[Sequence[JointColumns]]],
        values: np.ndarray,
        joint: int,
    ) -> JointResidual:
        """Return what values leave of the torque at a joint.

        Parameters
        ----------
        evidence : the recordings.
        columns : of the model and the torque, for each run, joint and replicate.
        values : (p,) of the fit.
        joint : column of the joint.

        Returns
        -------
        Residuals and noise of all runs.
        """
        combination = np.append(-values, 1.0)
        left = cls(
            criteria=evidence.criteria,
            stretches=[],
            classes=evidence.speed_classes(joint),
            plain=[],
            systematic=[],
        )
        for run, joints in zip(evidence.runs, columns, strict=True):
            certain = run.certain(joint)
            if not certain.any():
                continue
            residual = run.fold([c.times(combination) for c in joints[joint]])[:, certain]
            if run.kind == "single":
                left.plain.append(residual[0])
                continue
            left.systematic.append(systematic_square(residual, run.kind))
            left.stretches.extend(differences(residual, run.kind))
        return left

    @property
    def square(self) -> float:
        """Mean square of what is systematic; of everything, where nothing tells it from noise.

        Zero where no instant of the joint counts.
        """
        if self.systematic:
            return max(float(np.mean(self.systematic)), 0.0)
        return float(np.mean(np.concatenate(self.plain) ** 2)) if self.plain else 0.0

    @property
    def variance(self) -> float:
        """Of the noise; zero where there is none, or nothing tells it."""
        return float(np.mean(np.concatenate(self.stretches) ** 2)) if self.stretches else 0.0

    @property
    def noise(self) -> NoiseModel:
        """The noise; the residual itself, where nothing tells them from each other."""
        root = float(np.sqrt(self.square))
        if self.stretches:
            return measure_noise(self.stretches, self.classes, self.criteria.noise, root)
        return flat_noise(root or 1.0)
