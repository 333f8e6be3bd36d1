"""The catalogue: every effect that is defined, here or elsewhere, and what a label stands for."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Sequence
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import MappingProxyType

from dynident.arguments import checked
from dynident.effects.effect import Effect
from dynident.effects.known_effects import known_effects, unchanged_if_it_fails
from dynident.effects.laws import PREFIX, Law, LawEffect, law_effect
from dynident.errors import EffectError, warn
from dynident.words import nearest

ENTRY_POINTS = "dynident.effects"
"""Group of entry points by which packages bring effects: each names a module, or a class in one."""
_asked: set[EntryPoint] = set()


@checked
def catalogue() -> MappingProxyType[str, type[Effect]]:
    """Return every effect that is defined by now, by its name, in alphabetical order.

    The package's own, those of installed packages (entry points of the group `dynident.effects`),
    and every subclass of `Effect` with a name of its own, wherever it was defined.
    """
    _load_packages()
    return MappingProxyType({name: one.kind for name, one in known_effects().items()})


def _load_own() -> None:
    """Import every file of this room: before anybody can take the name of an effect in it."""
    for module in pkgutil.walk_packages([str(Path(__file__).parent)], f"{__package__}."):
        importlib.import_module(module.name)


@cache
def _packages() -> tuple[EntryPoint, ...]:
    found = entry_points(group=ENTRY_POINTS)
    return tuple(sorted(found, key=lambda one: (_package(one), one.name)))


def _package(one: EntryPoint) -> str:
    return one.dist.name if one.dist else one.value


def _load_packages() -> None:
    """Import the effects of installed packages, once; one that fails is a warning."""
    for one in _packages():
        if one in _asked:
            continue
        _asked.add(one)
        try:
            with unchanged_if_it_fails():
                one.load()
        except (Exception, SystemExit) as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            where = f"the package {_package(one)} are missing: {one.value} fails"
            said = f"effects of {where} ({reason})"
            warn(said)


@checked
def effects_of(label: str, robot, laws: Sequence[Law] = ()) -> tuple[Effect, ...]:
    """Return the effects that a label stands for: `name@joint` one, `name` one per place.

    Parameters
    ----------
    label : str
        `name`, `name@joint` or `name@joint:source`; `law:name` of a law.
    robot : Robot
        The robot on which they sit.
    laws : of Law
        Those that there are besides the catalogue.

    Raises
    ------
    EffectError
        If the name or a joint is unknown; the message lists the valid choices.
    """
    name, _, place = label.partition("@")
    known = {**catalogue(), **{law.label: law_effect(law) for law in laws}}
    if name.startswith(PREFIX) and name not in known:
        remedy = nearest(name, [law.label for law in laws], "laws") if laws else "none is stated"
        raise EffectError(f"no law is named '{name.removeprefix(PREFIX)}'", remedy=remedy)
    if name not in known:
        hint = nearest(name, list(known), "effects")
        raise EffectError(f"no effect is named '{name}'", remedy=hint)
    effect = known[name]
    if not place and effect.place == "joint or robot":
        return (effect().on(robot),)
    if not place:
        found = tuple(one.on(robot) for one in effect.candidates(robot))
        if not found:
            why = effect.elsewhere(robot) if issubclass(effect, LawEffect) else None
            raise why or EffectError("fits no joint of the robot", label)
        return found
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


_load_own()
