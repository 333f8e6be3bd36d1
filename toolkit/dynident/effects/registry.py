"""The catalogue: every effect that stands in a file of this room, and what a label stands for."""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from functools import cache
from pathlib import Path
from types import MappingProxyType

from dynident.effects.effect import Effect
from dynident.errors import EffectError


@cache
def catalogue() -> MappingProxyType[str, type[Effect]]:
    """Every effect by its name, in alphabetical order."""
    found: dict[str, type[Effect]] = {}
    for module in pkgutil.walk_packages([str(Path(__file__).parent)], f"{__package__}."):
        content = importlib.import_module(module.name)
        for value in vars(content).values():
            if isinstance(value, type) and issubclass(value, Effect) and hasattr(value, "name"):
                found[value.name] = value
    return MappingProxyType(dict(sorted(found.items())))


def effects_of(label: str, robot) -> tuple[Effect, ...]:
    """Return the effects that a label stands for: `name@joint` one, `name` one per place.

    Parameters
    ----------
    label : str
        `name`, `name@joint` or `name@joint:source`.
    robot : Robot
        The robot on which they sit.

    Raises
    ------
    EffectError
        If the name or a joint is unknown; the message lists the valid choices.
    """
    name, _, place = label.partition("@")
    known = catalogue()
    if name not in known:
        close = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean '{close[0]}'?" if close else f"effects: {', '.join(known)}"
        raise EffectError(f"no effect is named '{name}'", remedy=hint)
    effect = known[name]
    if not place and effect.place == "joint or robot":
        return (effect().on(robot),)
    if not place:
        return tuple(one.on(robot) for one in effect.candidates(robot))
    joint, source = _joints(place, robot.names)
    return (effect(joint, source).on(robot),)


def _joints(place: str, names: tuple[str, ...]) -> tuple[str, str | None]:
    """Split `joint` or `joint:source`; names of joints may hold colons of their own."""
    if place in names:
        return place, None
    for joint in names:
        if place.startswith(f"{joint}:") and place[len(joint) + 1 :] in names:
            return joint, place[len(joint) + 1 :]
    joint, _, source = place.partition(":")
    return joint, source or None
