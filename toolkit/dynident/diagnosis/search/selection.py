"""Which effect is added next, what cannot be told from it, and what is dropped again.

Of the effects that pass every gate the one that explains most is added, or a simpler one that does
nearly as much. Beside it stand those that the data cannot tell from it. At the end, effects that
the others have made superfluous are dropped.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dynident.diagnosis.details import Withdrawn
from dynident.diagnosis.search.alternatives import alternatives, as_likely
from dynident.diagnosis.search.ranking import Ranking, rank
from dynident.diagnosis.search.scores.score import Score
from dynident.effects import Effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.held_out import on_recordings
from dynident.model import Model
from dynident.tables import percent


@dataclass(frozen=True)
class AddedEffect:
    """An effect that the search has added, with what was known of it then.

    Attributes
    ----------
    score : what it would bring, with its shape.
    p_value : corrected for the number of tests.
    indistinguishable : effects that explain the same.
    with_it : the label of the effect that it was added together with, at another joint; empty for
        the one that was chosen.
    """

    score: Score
    p_value: float
    indistinguishable: tuple[Effect, ...]
    with_it: str = ""

    def alternatives_to(self, model: Model) -> tuple[Effect, ...]:
        """Effects that explain the same and are not in the model."""
        return tuple(effect for effect in self.indistinguishable if effect not in model)


def choose(evidence: Evidence, fitted: EvidenceFit, ranking: Ranking) -> AddedEffect | None:
    """Return the effect to add; None where none passes every gate.

    Parameters
    ----------
    evidence, fitted : the data, and the model as it fits them.
    ranking : of the candidates on that model.

    Returns
    -------
    The effect that explains most; or the simpler one in it, where that does most of the work.
    """
    passing, criteria = ranking.passing, evidence.criteria.search
    if not passing:
        return None
    best = passing[0]
    simpler = [
        s
        for s in passing
        if s.effect.name in best.effect.stands_in_for
        and s.effect.joint == best.effect.joint
        and s.drop >= criteria.simpler_share * best.drop
    ]
    if simpler:
        # The column that they share is the same whoever it belongs to: both are named.
        return AddedEffect(simpler[0], ranking.corrected(simpler[0]), (best.effect,))
    # Of what is as likely the simplest comes first, whether it does the same or something else:
    # what is left for the others is seen when it is there.
    likely = (best, *as_likely(evidence, fitted, ranking))
    as_good = [s for s in likely if s.drop >= criteria.simpler_share * best.drop]
    # Of what is alike the simplest; of these the first one: they stand in order.
    chosen = min(as_good, key=lambda one: one.parameters)
    rivals = alternatives(evidence, fitted, chosen, [s for s in likely if s is not chosen])
    return AddedEffect(chosen, ranking.corrected(chosen), tuple(s.effect for s in rivals))


def at_other_joints(
    evidence: Evidence, fitted: EvidenceFit, best: AddedEffect, added: int
) -> tuple[AddedEffect, ...]:
    """Return the same effect at the other joints that call for it, where every joint has it.

    One proposal for all of them is simpler than one after the other.

    Parameters
    ----------
    evidence, fitted : the data, and the model as it fits them.
    best : the effect that was chosen.
    added : number of effects added so far.

    Returns
    -------
    Those that pass every gate; none where the effect is not such a one.
    """
    effect = best.score.effect
    if not effect.at_every_joint:
        return ()
    siblings = tuple(
        one
        for one in type(effect).candidates(fitted.model.robot)
        if one.joint != effect.joint and one not in fitted.model
    )
    if not siblings:
        return ()
    ranking = rank(evidence, fitted, added, only=tuple(e.on(fitted.model.robot) for e in siblings))
    return tuple(
        AddedEffect(one, ranking.corrected(one), (), with_it=effect.label)
        for one in ranking.passing
    )


def breaks_its_promise(fitted: EvidenceFit, wider: EvidenceFit, one: Score) -> str:
    """Say how much less a filtered dynamic regressor explains in a model than it did beside it.

    With it the bodies change, and with them the response, which may not follow.

    Parameters
    ----------
    fitted, wider : the model without the effect, and with it.
    one : its score beside the first.

    Returns
    -------
    In words; empty where it keeps enough, for any other effect, and where the noise is unknown.
    """
    if not (one.effect.is_dynamic_response and fitted.noise_known):
        return ""
    promised = min(one.drop / fitted.error_signal, 1.0) if fitted.error_signal > 0 else 1.0
    before, after = fitted.misfit(fitted), wider.misfit(fitted)
    if before - after >= fitted.criteria.search.least_kept * promised * before:
        return ""
    found = percent(max(1.0 - after / before, 0.0) if before > 0 else 0.0, 1)
    return (
        f"fitted with the model it explains {found} of the residual, where its columns alone "
        f"promise {percent(promised, 1)}"
    )


def alternatives_only(one: AddedEffect, following: Ranking) -> AddedEffect:
    """Leave out effects that stay significant beside the one added: they are more, not instead."""
    still = {s.effect.label for s in following.passing}
    alternatives = tuple(
        e
        for e in one.indistinguishable
        if e.label not in still or one.score.effect.name in e.contains
    )
    return replace(one, indistinguishable=alternatives)


# --- what is dropped again -----------------------------------------------------------------------


@dataclass(frozen=True)
class Kept:
    """What is left when superfluous effects are dropped.

    Attributes
    ----------
    final, found : the model with the effects that are needed, and these.
    unhelpful : effects that training recordings call for, and that help nowhere else.
    """

    final: EvidenceFit
    found: list[AddedEffect]
    unhelpful: tuple[Withdrawn, ...] = ()


def without_superfluous(
    evidence: Evidence,
    held: Evidence | None,
    fitted: EvidenceFit,
    found: list[AddedEffect],
    progress: Callable[[str], None],
) -> Kept:
    """Drop every added effect that the others have made superfluous, or that helps nowhere else.

    Parameters
    ----------
    evidence : of the training recordings.
    held : of the test recordings; None where blocks of time are held out.
    fitted, found : the model with all effects, and these in the order in which they were added.
    progress : is called with what is being done.

    Returns
    -------
    The model with the effects that are needed.
    """
    kept, unhelpful = list(found), []
    for one in found:
        if _belongs(one.score.effect, kept):
            continue
        effect = fitted.model.effect(one.score.effect.label)
        rest = fit_evidence(evidence, fitted.model - effect, fitted)
        progress(f"doing without {effect.label}")
        needed = len(kept) == 1 or rank(evidence, rest, len(kept) - 1, only=(effect,)).passing
        if not needed or not _helps(held, rest, fitted):
            kept.remove(one)
            fitted = rest
            if needed:
                why = "lowers the residual of the test recordings at no joint"
                alike = one.alternatives_to(fitted.model)
                unhelpful.append(Withdrawn(effect=effect, why=why, with_it=alike))
    return Kept(fitted, kept, tuple(unhelpful))


def _helps(held: Evidence | None, without: EvidenceFit, fitted: EvidenceFit) -> bool:
    """Whether an effect lowers the residual of the test recordings at any joint.

    The whole of it, or what of it repeats: columns that carry noise may take the latter away and
    add to the former.
    """
    if held is None:
        return True  # its gain was cross-validated
    before, after = (on_recordings(held, one) for one in (without, fitted))
    falls = [before.residual_rms**2 - after.residual_rms**2]
    scale = after.residual_rms
    if after.noise_std is not None and after.ratio is not None:
        assert before.noise_std is not None and before.ratio is not None
        scale = before.noise_std
        falls.append((before.ratio * before.noise_std) ** 2 - (after.ratio * after.noise_std) ** 2)
    return any(bool(np.any(fall > held.criteria.search.least_fall * scale**2)) for fall in falls)


def _belongs(effect: Effect, found: list[AddedEffect]) -> bool:
    """Whether an effect is part of another one, which would bring it back, or required by one."""
    others = (one.score.effect for one in found)
    return any(
        effect.label in o.requires or (effect.name in o.contains and effect.joint == o.joint)
        for o in others
    )
