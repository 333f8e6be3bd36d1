"""What the tool says of its own certainty, counted on some cases and checked on others."""

from __future__ import annotations

from collections import Counter

from blind_study.foreign import KIN
from blind_study.judge import Judged, Place
from dynident.diagnosis.track_record import MOST_EFFECTS, kind_of
from dynident.effects import catalogue

SEEN = 0.7
"""Ratio from which an effect counts as seen above the noise."""

Kind = tuple[str, str]


def kind(one: Judged) -> Kind | None:
    """The kind of an answer, as the tool knows it; None where it says nothing of its record."""
    if one.before_over_floor is None or one.broken:
        return None
    if one.verdict == "unexplained" and one.withdrawn and not one.added:
        return None
    effects = len({_proposal(place) for place in one.added})
    if effects > MOST_EFFECTS:
        return None
    return kind_of(one.verdict, effects=effects, over_floor=one.before_over_floor)


def _proposal(place: Place) -> tuple[str | None, ...]:
    """What counts as one effect: one that every joint has counts once for all of them."""
    return place[:1] if catalogue()[place[0]].at_every_joint else place


def is_right(one: Judged) -> bool:
    """Whether what an answer claims is so."""
    if one.added:
        kin = KIN.get(one.truth[0][0], ()) if one.truth else ()
        named = one.first is not None and one.first[0] in kin
        return one.right or (named and one.first is not None and one.first[1] == one.truth[0][1])
    if one.verdict == "unexplained":
        return one.kind == "foreign"
    return one.kind in ("healthy", "absorbed") or one.ratio < SEEN


def counts(judged: list[Judged]) -> dict[Kind, tuple[int, int]]:
    """Right answers and answers of each kind."""
    total: Counter[Kind] = Counter()
    right: Counter[Kind] = Counter()
    for one in judged:
        found = kind(one)
        if found is not None:
            total[found] += 1
            right[found] += is_right(one)
    return {one: (right[one], total[one]) for one in sorted(total)}
