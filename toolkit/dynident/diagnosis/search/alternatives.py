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

from dynident.diagnosis.search.confidence_set import as_good_as_first
from dynident.diagnosis.search.payload_recordings import with_payload
from dynident.diagnosis.search.ranking import Ranking
from dynident.diagnosis.search.scores.candidate_moments import (
    candidate_moments,
    moments_with_payload,
)
from dynident.diagnosis.search.scores.score import Score
from dynident.diagnosis.search.scores.scoring import score
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
    likely = {
        *_of_the_confidence_set(evidence, fitted, ranking),
        *_as_much_once_fitted(evidence, fitted, ranking),
    }
    return [one for one in ranking.passing[1:] if one.effect in likely]


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
    evidence: Evidence, fitted: EvidenceFit, ranking: Ranking
) -> tuple[Effect, ...]:
    """Effects of the model confidence set of all that pass, and those that explain as much.

    Parameters
    ----------
    evidence, fitted : the data, and the model as it fits them.
    ranking : of a round, the winner first.

    Returns
    -------
    Without the winner. An effect that contains it and adds nothing to it is not named.
    """
    winner, *others = ranking.passing
    rivals = [
        other
        for other in others
        if other.losses is not None
        and not (
            other.effect.joint == winner.effect.joint
            and winner.effect.name in other.effect.contains
        )
    ]
    if not rivals:
        return ()
    criteria = evidence.criteria.search
    losses = np.column_stack([one.losses for one in (winner, *rivals) if one.losses is not None])
    kept = as_good_as_first(losses, criteria)
    named = [
        other
        for k, other in enumerate(rivals, 1)
        if k in kept or abs(winner.drop - other.drop) <= criteria.alike * winner.drop
    ]
    apart = _told_apart(evidence, fitted, winner, [one for one in named if _is_larger(one, winner)])
    return tuple(one.effect for one in named if one.effect not in apart)


def _is_larger(other: Score, winner: Score) -> bool:
    """Whether a rival has more parameters that the data tell, and columns that are as they are.

    Columns of a first guess may explain more than they are seen to.
    """
    more = other.rank + len(other.effect.shape) > winner.rank + len(winner.effect.shape)
    carried = {one.payload_recordings is not None for one in (other, winner)}
    return more and other.effect.is_exact and carried == {False}


def _told_apart(
    evidence: Evidence, fitted: EvidenceFit, winner: Score, larger: Sequence[Score]
) -> set[Effect]:
    """Rivals with more parameters that, once fitted, explain less than the winner beyond chance.

    What imitates by its further freedom, as a long wave does a ramp, comes within the per cent that
    allows for what else is wrong with a model; and the few blocks of time of a short recording put
    nothing out of the confidence set, however far apart the two are there. Here it is the noise
    that tells, with all that is left beside the winner: where more is wrong than the two differ by,
    the rival stays.

    Parameters
    ----------
    evidence, fitted : the data, and the model without either.
    winner, larger : the effect, and the rivals.
    """
    if not larger:
        return set()
    rows = fitted.rows / fitted.model.robot.n
    wider = fit_evidence(evidence, fitted.model + winner.effect, fitted)
    left = rows * wider.misfit(wider)
    least = left + evidence.criteria.search.told_apart**2
    instead = {
        one.effect: fit_evidence(evidence, fitted.model + one.effect, fitted) for one in larger
    }
    return {effect for effect, fit in instead.items() if rows * fit.misfit(wider) - left > least}


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
