"""The score of an effect, and what is impossible in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.model import not_met


@dataclass(frozen=True, kw_only=True)
class Score:
    """What one effect, with one shape, would bring if it were added.

    Attributes
    ----------
    effect : with its shape.
    payload_recordings : which runs carry the payload; None for effects to which that does not
        matter.
    not_identifiable : whether nothing of its columns is left beside the model's.
    rank : number of its parameters that the data can tell.
    drop : of the squared, whitened, noise-free residual.
    share : drop over the squared residual with its noise.
    p_value : before correction for the number of tests; blocks of time are the sampling units.
    penalised : drop less the price of its parameters and of its grid.
    values, sigma : (k,) its parameters and their standard deviations; of a share of the predicted
        torque, of that which the model predicts without it, where that is possible.
    covariance : (k, k) of the values; None where nothing of them can be told.
    fall : of the squared residual with its noise, at the value at which the column is taken. A
        column that noise drives is other in every repetition: that counts against it.
    losses : (B,) held-out squared residual of each block with the effect in the model.
    gains : (B,) held-out squared residual of each block without it less that with it.
    """

    effect: Effect
    payload_recordings: tuple[bool, ...] | None
    not_identifiable: bool
    rank: int = 0
    drop: float = 0.0
    share: float = 0.0
    p_value: float = 1.0
    penalised: float = -np.inf
    values: tuple[float, ...] = ()
    sigma: tuple[float, ...] = ()
    covariance: np.ndarray | None = None
    fall: float = 0.0
    losses: np.ndarray | None = None
    gains: np.ndarray | None = None

    @property
    def parameters(self) -> int:
        """Number of parameters that the effect brings, its shape among them."""
        return len(self.values) + len(self.effect.shape)

    @property
    def drop_at_point(self) -> float:
        """The drop if its value is the one at which its column was taken.

        A column that is not linear in the value says nothing of another value.
        """
        if len(self.values) != 1 or len(self.effect.point) != 1 or self.values[0] == 0:
            return self.drop
        return self.drop * (1.0 - (1.0 - self.effect.point[0] / self.values[0]) ** 2)


def impossible(one: Score, fitted: EvidenceFit) -> str:
    """What is physically impossible in a score's values; empty where nothing is.

    Of several values some may leave their bounds by their uncertainty. A single one that is out of
    them says that at its bound, where there is no effect, the data are explained better. A level of
    friction is impossible where the joint moved with less.
    """
    if one.not_identifiable:
        return ""
    parameters = one.effect.parameters(fitted.model.robot)
    deviations = fitted.criteria.gates.beyond_bounds if len(one.values) > 1 else 0.0
    for parameter, value, sigma in zip(parameters, one.values, one.sigma, strict=False):
        slack = deviations * sigma
        if value < parameter.lower - slack or value > parameter.upper + slack:
            return f"would need {parameter.name} = {value:.3g} {parameter.unit}"
        if parameter.is_level and one.effect.joint is not None:
            peak = float(fitted.torque_peaks[fitted.model.robot.names.index(one.effect.joint)])
            if value > peak + fitted.criteria.gates.beyond_bounds * sigma:
                return f"would need {not_met(parameter, value, one.effect.joint, peak)}"
    return ""


def admissible(one: Score, evidence: Evidence, fitted: EvidenceFit) -> bool:
    """Return whether a shape may be the best one.

    What the samples do not tell is no better shape, however little it leaves: a spring that only
    gives way, and never resonates, is explained by any stiffness that is high enough.

    Parameters
    ----------
    one : the score of an effect with that shape.
    evidence, fitted : the recordings, and the model without the effect as it fits them.

    Returns
    -------
    Whether its values are possible, and the samples tell them.
    """
    told = not one.effect.unresolved(one.values, evidence.longest_step)
    return told and not impossible(one, fitted)
