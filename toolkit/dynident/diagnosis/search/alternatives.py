"""What the data cannot tell from an effect: as likely to be it, and doing the same work.

Two candidates that lower the held-out loss alike are alternatives only if one of them is enough.
Where each explains another part of the residual, at other joints say, both may be present. So of
what is as likely (`as_likely`, the model confidence set), only that is named of whose gain the
effect takes a good part away (`alternatives`), and of which nothing significant is left once the
effect is in the model (`selection.alternatives_only`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynident.criteria import SearchCriteria
from dynident.diagnosis.search.confidence_set import as_good_as_first
from dynident.diagnosis.search.payload_recordings import with_payload
from dynident.diagnosis.search.ranking import Ranking
from dynident.diagnosis.search.scoring import (
    Score,
    candidate_moments,
    moments_with_payload,
    score,
)
from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, in_metric_of


def as_likely(evidence: Evidence, fitted: EvidenceFit, ranking: Ranking) -> list[Score]:
    """Return the rivals of the best effect that may as well be the best, best first.

    Parameters
    ----------
    evidence, fitted : the data, and the model as it fits them.
    ranking : of the candidates on that model; some pass every gate.

    Returns
    -------
    Those of the model confidence set, and those that explain as much. They may be present besides.
    """
    best, *others = ranking.passing
    likely = {
        *_of_the_confidence_set(ranking, best, evidence.criteria.search),
        *_as_much_once_fitted(evidence, fitted, ranking),
    }
    return [one for one in others if one.effect in likely]


def alternatives(
    evidence: Evidence, fitted: EvidenceFit, one: Score, rivals: Sequence[Score]
) -> list[Score]:
    """Return the rivals of an effect of whose gain it takes a good part away.

    What two explain together is as much as each explains alone, where either is enough, and the
    sum of both, where they have nothing in common.

    Parameters
    ----------
    evidence, fitted : the data, and the model as it fits them without either.
    one : the effect.
    rivals : those that are as likely.

    Returns
    -------
    Some of the rivals, in their order.
    """
    if not rivals:
        return []
    own = with_payload(evidence, one)
    wider = fit_evidence(own, fitted.model + one.effect, fitted)
    beside = in_metric_of(own, wider, fitted)
    least = evidence.criteria.search.in_common
    return [
        other
        for other in rivals
        if other.drop - _drop(own, beside, other) >= least * min(one.drop, other.drop)
    ]


def _drop(evidence: Evidence, fitted: EvidenceFit, one: Score) -> float:
    """What an effect explains beside a model, with the shape that it has."""
    (parts,) = candidate_moments(evidence, fitted, [one.effect])
    if one.payload_recordings is not None:
        parts = tuple(
            moments_with_payload(part, evidence, one.payload_recordings) for part in parts
        )
    return score(fitted, one.effect, *parts, grid=1).drop


def _of_the_confidence_set(
    ranking: Ranking, winner: Score, criteria: SearchCriteria
) -> tuple[Effect, ...]:
    """Effects of the model confidence set of all that pass, and those that explain as much.

    Parameters
    ----------
    ranking, winner : of a round, and its best effect.
    criteria : what counts as alike.

    Returns
    -------
    Without the winner. An effect that contains it and adds nothing to it is not named.
    """
    rivals = [
        other
        for other in ranking.passing
        if other.losses is not None
        and other.effect != winner.effect
        and not (
            other.effect.joint == winner.effect.joint
            and winner.effect.name in other.effect.contains
        )
    ]
    if not rivals:
        return ()
    losses = np.column_stack([one.losses for one in (winner, *rivals) if one.losses is not None])
    kept = as_good_as_first(losses, criteria)
    return tuple(
        other.effect
        for k, other in enumerate(rivals, 1)
        if _may_be_instead(other, winner, k in kept, criteria)
    )


def _may_be_instead(other: Score, winner: Score, likely: bool, criteria: SearchCriteria) -> bool:
    """Whether a rival may be named beside the winner.

    One of the confidence set may be, and one that explains a little less, which allows for what
    else is wrong with a model. But one with more parameters must not explain less than the winner
    beyond chance: what imitates by its further freedom, as a long wave does a ramp, has that
    allowance already, and the few blocks of time of a short recording put nothing out of the set,
    however far apart the two are there. What is missing counts as noise here, so that where much is
    left beside the winner, too, the rival stays. Columns of a first guess may explain more than
    they are seen to: such a rival stays as well.

    Parameters
    ----------
    other, winner : the two.
    likely : whether the rival is in the confidence set.
    criteria : what counts as alike, and as told apart.
    """
    less = winner.drop - other.drop
    larger = other.parameters > winner.parameters and other.effect.is_exact
    if larger and less > criteria.told_apart**2:
        return False
    return likely or abs(less) <= criteria.alike * winner.drop


def _as_much_once_fitted(
    evidence: Evidence, fitted: EvidenceFit, ranking: Ranking
) -> tuple[Effect, ...]:
    """Rivals of the best effect that explain as much once each is fitted together with the model.

    Before, columns that are not linear in their values are those of a first guess.
    """
    criteria = evidence.criteria.search
    best, *others = ranking.passing
    rivals = [
        s
        for s in others
        if s.effect.nonlinear
        and not s.effect.needs_recording
        and s.losses is not None
        and s.drop >= criteria.rival_share * best.drop
    ]
    if not (best.effect.nonlinear and not best.effect.needs_recording and rivals):
        return ()

    def explained(effect: Effect) -> float:
        wider = fit_evidence(evidence, fitted.model + effect, fitted)
        return fitted.misfit(fitted) - wider.misfit(fitted)

    most = explained(best.effect)
    return tuple(s.effect for s in rivals if explained(s.effect) >= (1.0 - criteria.alike) * most)
