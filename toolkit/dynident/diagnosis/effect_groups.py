"""Effects that are told as one: of one kind, at several joints."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from dynident.diagnosis.details import Candidate
from dynident.effects import Effect


def grouped_title(effects: Sequence[Effect], joints: int) -> str:
    """What effects are called together.

    Parameters
    ----------
    effects : at least one; of one kind, where they are told as one.
    joints : of the robot.
    """
    first = effects[0]
    if len(effects) == 1:
        return first.title
    if len({one.name for one in effects}) > 1 or any(one.source for one in effects):
        return f"{first.title}, and {in_words(len(effects) - 1)} more"
    name, at = first.name.replace("_", " "), [str(one.joint) for one in effects]
    if len(at) == joints:
        return f"{name} at {every_joint(joints)}"
    return f"{name} at {', '.join(at[:-1])} and {at[-1]}"


def every_joint(count: int) -> str:
    """All joints of a robot that has several, in words."""
    return f"{'both' if count == 2 else f'all {in_words(count)}'} joints"


def in_words(count: int) -> str:
    """A small number in words."""
    words = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"]
    return words[count] if count < len(words) else str(count)


@dataclass(frozen=True)
class HiddenEffects:
    """Effects that the data cannot show, for one and the same reason.

    Attributes
    ----------
    title : as "contact at all six joints".
    remark : the experiment that would show them.
    """

    title: str
    remark: str


def hidden_effects(candidates: Iterable[Candidate], joints: int) -> tuple[HiddenEffects, ...]:
    """Return the candidates that are not identifiable, those of one kind and reason together.

    Parameters
    ----------
    candidates : of a diagnosis, in their order.
    joints : of the robot.
    """
    groups: dict[tuple[str, str], list[Candidate]] = {}
    for one in candidates:
        if one.status == "absorbed":
            effect = one.effect
            alone = effect.joint is None or effect.source is not None
            key = (effect.label, "") if alone else (effect.name, _of_each(one))
            groups.setdefault(key, []).append(one)
    return tuple(
        HiddenEffects(
            title=grouped_title([one.effect for one in group], joints),
            remark=_of_each(group[0]) if len(group) > 1 else _remark(group[0]),
        )
        for group in groups.values()
    )


def _remark(one: Candidate) -> str:
    return one.remark or one.effect.advice


def _of_each(one: Candidate) -> str:
    """The remark, as it is of any joint."""
    name = re.escape(str(one.effect.joint))
    return re.sub(rf"(?<![\w.]){name}(?!\w)", "each of these joints", _remark(one))
