"""Which of the effects added carry the fall of the held-out error, and which are small beside them.

Effects that every joint has and that were added together count as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dynident.diagnosis.details import Step, named_together, together
from dynident.diagnosis.effect_groups import in_words
from dynident.tables import points

MOST_OF_IT = 0.9
"""Share of the whole fall that the effects which lead a verdict carry together, at least."""


@dataclass(frozen=True, kw_only=True)
class LeadingEffects:
    """The fewest effects that carry most of the fall, and the rest.

    Attributes
    ----------
    leading, smaller : one or more steps each, in the order in which they were added; without
        smaller ones all effects are needed to carry so much.
    """

    leading: tuple[tuple[Step, ...], ...]
    smaller: tuple[tuple[Step, ...], ...]

    @classmethod
    def of(cls, steps: Sequence[Step]) -> LeadingEffects:
        """Divide the effects of a path: the largest falls first, until they make most of it.

        A fall that may be chance leads only where all may be.

        What makes no torque without one of these goes with it, and what one of these requires:
        the values of both are right only together.
        """
        groups = [tuple(group) for group in together(steps)]
        falls = [_fall(group) for group in groups]
        chance = [all(step.uncertain for step in group) for group in groups]
        order = sorted(range(len(groups)), key=lambda k: (chance[k], -falls[k]))
        leaders = chance.count(False) or len(groups)
        whole, many, carried = sum(falls[k] for k in order[:leaders]), 0, 0.0
        while many < leaders and (many == 0 or carried < MOST_OF_IT * whole):
            carried += falls[order[many]]
            many += 1
        led = [step.effect for k in order[:many] for step in groups[k]]
        needed = {label for effect in led for label in effect.requires}
        needing = {effect.label for effect in led}
        with_them = [
            k
            for k in order[many:]
            if needed & {step.effect.label for step in groups[k]}
            or needing & set(groups[k][0].effect.requires)
        ]
        first = sorted([*order[:many], *with_them])
        last = [k for k in range(len(groups)) if k not in first]
        return cls(leading=tuple(groups[k] for k in first), smaller=tuple(groups[k] for k in last))

    @property
    def carried(self) -> str:
        """How much of the fall the leading ones make, as "7.06 of the 7.60 points"."""
        own, rest = (sum(map(_fall, groups)) for groups in (self.leading, self.smaller))
        # What was kept although the error rose a little is no part of a whole.
        return (
            f"{points(own)} of the {points(own + rest)} points"
            if rest > 0
            else f"{points(own)} points"
        )

    @property
    def in_words(self) -> str:
        """The effects with everything that cannot be told from them, those that lead first."""
        named = ", ".join(self.names)
        if not self.smaller:
            return named
        count = len(self.smaller)
        others = ", ".join(
            named_together(_steps(self.smaller), _steps(self.leading + self.smaller))
        )
        return (
            f"{named} ({self.carried} by which the held-out error falls) and {in_words(count)} "
            f"smaller {'one' if count == 1 else 'ones'} "
            f"({points(sum(map(_fall, self.smaller)))} points: {others})"
        )

    @property
    def names(self) -> list[str]:
        """Each of the leading ones with what cannot be told from it."""
        return named_together(_steps(self.leading), _steps(self.leading + self.smaller))


def _steps(groups: Sequence[Sequence[Step]]) -> list[Step]:
    return [step for group in groups for step in group]


def _fall(group: Sequence[Step]) -> float:
    return sum(step.fall for step in group)
