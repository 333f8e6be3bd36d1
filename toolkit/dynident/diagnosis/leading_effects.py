"""Which of the effects added carry the fall of the held-out error, and which are small beside them.

The error is over all joints, and the torque of a wrist is a hundredth of a shoulder's: what takes
most of a small joint's own error is no small effect either.

Effects that every joint has and that were added together count as one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from dynident.diagnosis.details import (
    LARGE_AT_A_JOINT,
    JointResult,
    Step,
    TestError,
    named_together,
    together,
)
from dynident.diagnosis.effect_groups import in_words
from dynident.tables import listed, points, two_percent

MOST_OF_IT = 0.9
"""Share of the whole fall that the effects which lead a verdict carry together, at least."""


@dataclass(frozen=True, kw_only=True)
class LeadingEffects:
    """The fewest effects that carry most of the fall, and the rest.

    Attributes
    ----------
    leading : one or more steps each, in the order in which they were added.
    local : those beside them that are large at their own joint.
    smaller : the rest; without `local` and these, all effects are needed to carry so much.
    """

    leading: tuple[tuple[Step, ...], ...]
    local: tuple[tuple[Step, ...], ...]
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
        chance = [all(step.uncertain_over_all for step in group) for group in groups]
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
        others = [groups[k] for k in range(len(groups)) if k not in first]
        return cls(
            leading=tuple(groups[k] for k in first),
            local=tuple(group for group in others if any(map(_is_large, group))),
            smaller=tuple(group for group in others if not any(map(_is_large, group))),
        )

    @property
    def carried(self) -> str:
        """How much of the fall the leading ones make, as "7.06 of the 7.60 points"."""
        own, rest = sum(map(_fall, self.leading)), sum(map(_fall, self.local + self.smaller))
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
        if not self.local and not self.smaller:
            return named
        parts = [f"{named} ({self.carried} by which the held-out error falls)"]
        parts += [f"{self._named(group)} ({at})" for group, at in self._at_joints]
        if self.smaller:
            count, small = len(self.smaller), ", ".join(self._names(self.smaller))
            parts.append(
                f"{in_words(count)} smaller {'one' if count == 1 else 'ones'} "
                f"({points(sum(map(_fall, self.smaller)))} points: {small})"
            )
        return listed(parts)

    @property
    def names(self) -> list[str]:
        """Each of the leading ones with what cannot be told from it."""
        return self._names(self.leading)

    @property
    def local_in_words(self) -> str:
        """What the local ones do at their joints, as a clause; empty where there are none."""
        if len(self.local) > 1:
            many = in_words(len(self.local))
            return f"{many} more take a third or more off the error of their joint"
        return "".join(f"{self._named(group)} takes {at}" for group, at in self._at_joints)

    def own_joint_in_words(self, error: TestError, joints: Sequence[JointResult]) -> str:
        """What all that was added does to the joint which gains most by a leading one.

        Parameters
        ----------
        error : over all joints.
        joints : with what becomes of each.

        Returns
        -------
        As "elbow from 14.70 % to 2.30 %"; empty where the error of all tells it.
        """
        if error.before - error.after >= LARGE_AT_A_JOINT * error.before:
            return ""
        there = {s.at_joint.joint for s in _steps(self.leading) if s.at_joint and _is_large(s)}
        gained = [one for one in joints if one.name in there and one.error_after < one.error_before]
        if not gained:
            return ""
        most = min(gained, key=lambda one: one.error_after / one.error_before)
        before, after = two_percent(most.error_before, most.error_after)
        return f"{most.name} from {before} to {after}"

    @property
    def _at_joints(self) -> list[tuple[tuple[Step, ...], str]]:
        """Each of the local ones with the fall of the error at its joint."""
        found = []
        for group in self.local:
            there = [one.at_joint for one in group if one.at_joint and _is_large(one)]
            first = min(there, key=lambda one: one.after / one.before)
            more = f" and at {in_words(len(there) - 1)} more" if there[1:] else ""
            found.append((group, f"{first.in_words}{more}"))
        return found

    def _named(self, group: Sequence[Step]) -> str:
        return " and ".join(self._names((group,)))

    def _names(self, groups: Sequence[Sequence[Step]]) -> list[str]:
        return named_together(_steps(groups), _steps(self.leading + self.local + self.smaller))


def _steps(groups: Sequence[Sequence[Step]]) -> list[Step]:
    return [step for group in groups for step in group]


def _is_large(step: Step) -> bool:
    return step.at_joint is not None and step.at_joint.is_large


def _fall(group: Sequence[Step]) -> float:
    return sum(step.fall for step in group)
