"""Torque that was sampled at another moment than the study says: less than a sample is no physics.

A command that is logged at a sample acts until the next one, half a sample later in the mean. Taken
as measured at the sample, it changes viscous friction and inertia by more than their uncertainty
long before it is seen in the error.
"""

from __future__ import annotations

from dataclasses import dataclass

from dynident.diagnosis.search.ranking import Ranking
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.tables import number

_DEVIATIONS = 3.0
"""Standard deviations within which a delay may be half a sample."""
_ROUND = 0.1
"""Of a sample, by which it may be off besides."""


@dataclass(frozen=True, kw_only=True)
class SamplingTime:
    """When the torque acts, where a study takes a command that is held for a measured torque.

    Or the other way round.

    Attributes
    ----------
    later_s, sigma_s : by how much later than the study says, s.
    mend : the line of the study that mends it.
    """

    later_s: float
    sigma_s: float
    mend: str

    @property
    def sentence(self) -> str:
        """What was found, and what mends it, in plain words."""
        when = "later" if self.later_s > 0 else "earlier"
        return (
            f"The torque acts {number(1e3 * abs(self.later_s), 2)} ms {when} than the study "
            f"says (sigma {number(1e3 * self.sigma_s, 2)} ms), about half a sample, which is what "
            f"a held command makes: try {self.mend} in the study. Until then friction and inertia "
            "take it up."
        )


def sampling_time(
    evidence: Evidence, fitted: EvidenceFit, ranking: Ranking, *, least_share: float
) -> SamplingTime | None:
    """Return when the torque acts, where that is half a sample from when the study says.

    Parameters
    ----------
    evidence : the training recordings.
    fitted : the final model as it fits them.
    ranking : of the candidates on that model.
    least_share : of the squared systematic residual, that a delay must explain.
    """
    least = least_share * fitted.error_signal
    step = evidence.longest_step
    held = evidence.runs[0].recording.torque == "held_command"
    found = [
        score
        for score, refusal in zip(ranking.scores, ranking.refusals, strict=True)
        if refusal and score.values and refusal == score.effect.unresolved(score.values, step)
        # The study says one thing of all joints: a delay of one of them is no evidence against it.
        if score.effect.joint is None or fitted.model.robot.n == 1
        if score.drop >= least
    ]
    for score in found:
        later = -score.values[0]  # what is recorded late has acted before
        off = abs((-later if held else later) - 0.5 * step)
        if off <= _DEVIATIONS * score.sigma[0] + _ROUND * step:
            return SamplingTime(
                later_s=later,
                sigma_s=score.sigma[0],
                mend='torque = "measured"' if held else 'torque = "held_command"',
            )
    return None
