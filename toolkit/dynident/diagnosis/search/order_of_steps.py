"""The order of the effects added, once the shapes of those that ring or have backlash are known.

A search adds at each step what explains most. The shapes that it tries of a response with backlash,
or of a spring, may all miss the true one, and what resembles it is added first: a delay, say. The
response follows, gets its shape, and may then explain by itself more than what stands before it. It
is named first then, as it would have been had its shape been known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import groupby

from dynident.diagnosis.search.selection import AddedEffect
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence

_Group = tuple[AddedEffect, ...]


def responses_in_place(
    evidence: Evidence, start: EvidenceFit, final: EvidenceFit, found: _Group
) -> _Group:
    """Return the effects in order, responses before what explains clearly less in the same place.

    Clearly: less than `SearchCriteria.simpler_share` of what the response explains on the training
    recordings, as in a choice among candidates. All else keeps its order, and what was added at
    several joints at once stays together.

    Parameters
    ----------
    evidence : the training recordings.
    start, final : the model as given, and with all effects, whose shapes are taken.
    found : these effects, in the order in which they were added.
    """
    by_label = {effect.label: effect for effect in final.model.effects}

    def misfit(groups: Sequence[_Group]) -> float:
        effects = tuple(by_label[one.score.effect.label] for group in groups for one in group)
        fit = fit_evidence(evidence, start.model + effects, start) if effects else start
        return fit.misfit(start)

    order: list[_Group] = []
    for _, together in groupby(found, key=lambda one: one.with_it or one.score.effect.label):
        group, place = tuple(together), len(order)
        if any(one.score.effect.is_dynamic_response for one in group):
            place = _place(order, group, misfit, evidence.criteria.search.simpler_share)
        order.insert(place, group)
    return tuple(one for group in order for one in group)


def _place(
    order: list[_Group], group: _Group, misfit: Callable[[Sequence[_Group]], float], least: float
) -> int:
    """Where a group comes: before the first that explains less than a share of what it does."""
    for place, other in enumerate(order):
        before = misfit(order[:place])
        fall, others_fall = (before - misfit((*order[:place], one)) for one in (group, other))
        if others_fall < least * fall:
            return place
    return len(order)
