"""Which effect is added next, and what is named with it."""

from __future__ import annotations

from dataclasses import replace

from dynident.diagnosis.assembly import Found
from dynident.diagnosis.search.ranking import Ranking, indistinguishable
from dynident.diagnosis.search.scoring import Score
from dynident.effects import Effect
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence


def choose(evidence: Evidence, fitted: EvidenceFit, ranking: Ranking) -> Found | None:
    """The best material effect; or the simpler one in it, where that does most of the work."""
    material, criteria = ranking.material, evidence.criteria.search
    if not material:
        return None
    best = material[0]
    simpler = [
        s
        for s in material
        if s.effect.name in best.effect.stands_in_for
        and s.effect.joint == best.effect.joint
        and s.drop >= criteria.simpler_share * best.drop
    ]
    if simpler:
        # The column that they share is the same whoever it belongs to: both are named.
        return Found(simpler[0], ranking.corrected(simpler[0]), (best.effect,))
    alike = {
        *indistinguishable(ranking, best, criteria),
        *_alike_once_fitted(evidence, fitted, ranking),
    }
    among = [s for s in material if s is best or s.effect in alike]
    as_good = [s for s in among if s.drop >= criteria.simpler_share * best.drop]
    chosen = min(as_good, key=_size)  # the first of the simplest: they stand in order
    others = tuple(s.effect for s in among if s is not chosen)
    return Found(chosen, ranking.corrected(chosen), others)


def _alike_once_fitted(
    evidence: Evidence, fitted: EvidenceFit, ranking: Ranking
) -> tuple[Effect, ...]:
    """Rivals of the best effect that explain the same once each is fitted together with the model.

    Before, columns that are not linear in their values are those of a first guess.
    """
    criteria = evidence.criteria.search
    best, *others = ranking.material
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


def breaks_its_promise(fitted: EvidenceFit, wider: EvidenceFit, one: Score) -> bool:
    """Whether a driven response does not explain in a model what it explained beside it.

    With it the bodies change, and with them the response, which may not follow.
    """
    if not (one.effect.is_dynamic_response and fitted.noise_known):
        return False
    promised = min(one.drop / fitted.error_signal, 1.0) if fitted.error_signal > 0 else 1.0
    before, after = fitted.misfit(fitted), wider.misfit(fitted)
    return before - after < fitted.criteria.search.least_kept * promised * before


def _size(one: Score) -> int:
    """Number of parameters that an effect brings: of what is alike, the simplest is added."""
    return len(one.values) + len(one.effect.shape)


def alternatives_only(one: Found, following: Ranking) -> Found:
    """Leave out effects that stay material beside the one added: they are more, not instead."""
    still = {s.effect.label for s in following.material}
    alternatives = tuple(
        e
        for e in one.indistinguishable
        if e.label not in still or one.score.effect.name in e.contains
    )
    return replace(one, indistinguishable=alternatives)
