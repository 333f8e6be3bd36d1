"""What a class says of itself: its words, where it may sit, and what it needs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

import numpy as np

from dynident.effect_contract.crane import block_of, crane, places
from dynident.effect_contract.disagreement import differs
from dynident.effects import Effect, Needs, catalogue, effects_of
from dynident.effects.residual_picture import Quantity, ResidualPicture
from dynident.effects.soundness import unsound_parameters
from dynident.errors import EffectError
from dynident.model import Model


def says_what_it_is(kind: type[Effect]) -> Iterator[str]:
    """A name, a law, what it looks like, the experiment that shows it; others by their names."""
    for attribute in ("name", "law", "sign_of", "experiment"):
        words = getattr(kind, attribute, None)
        if not isinstance(words, str) or not words.strip():
            yield f"{attribute} = {words!r}"
    known = catalogue()
    if kind.in_catalogue and known.get(kind.name) is not kind:
        yield f"'{kind.name}' is not in the catalogue"
    for attribute in (
        "confounded_with",
        "contains",
        "stands_in_for",
        "excludes",
        "requires",
        "beyond",
    ):
        for other in getattr(kind, attribute):
            if other not in known or other == kind.name:
                yield f"{attribute} names '{other}', which is no other effect"
    if not isinstance(kind.needs, Needs):
        yield f"needs = {kind.needs!r}, which is no Needs"
    elif kind.linear_in_torque and Needs.TORQUE not in kind.needs:
        yield "it is linear in the torque, and does not say that it needs it"


def pictures_can_be_drawn(kind: type[Effect]) -> Iterator[str]:
    """Each is finite wherever a residual map has a bin."""
    at, quantities = np.linspace(-1.0, 1.0, 9), get_args(Quantity)
    for one in kind.pictures:
        if not isinstance(one, ResidualPicture):
            yield f"pictures holds a {type(one).__name__}, which is no ResidualPicture"
        elif one.against not in quantities:
            yield f"a picture is against {one.against!r}, and may be {', '.join(quantities)}"
        else:
            yield from differs(f"'{one.words}' at 0 times", 0.0 * one.of(at, 1.0), 0.0 * at)


def can_be_somewhere(kind: type[Effect]) -> Iterator[str]:
    """Somewhere on the robot, and its columns are zero not everywhere."""
    if not places(kind):
        yield "candidates() yields no place"
        return
    block = block_of(kind, 0)
    if not any(np.any(one.columns(block)) for one in places(kind)):
        yield "its columns are zero at every place of the crane"


def refuses_wrong_places(kind: type[Effect]) -> Iterator[str]:
    """Joints that are missing, unknown or too many, by a line with the remedy."""
    wrong = {
        "joint": [(None,), ("swimg",), ("swing", "hoist")],
        "pair": [("swing",), ("swing", "swing"), ("swing", "hoits"), ("swimg", "swing")],
        "robot": [("swing",)],
        "joint or robot": [("swimg",), ("swing", "hoist"), (None, "hoist")],
    }
    if kind.place not in wrong:
        yield f"place = {kind.place!r}, and may be {', '.join(wrong)}"
        return
    for place in wrong[kind.place]:
        try:
            kind(*place).on(crane())
        except EffectError as error:
            unknown = [name for name in place if name in ("swimg", "hoits")]
            if kind.name not in str(error) or not error.remedy:
                yield f"the refusal of {place} names no effect or no remedy: {error}"
            elif unknown and ", ".join(crane().names) not in str(error):
                yield f"the refusal of {place} does not list the joints: {error}"
        else:
            yield f"on() accepts the joints {place}"


def has_words_for_its_place(effect: Effect) -> Iterator[str]:
    """Its label finds it again, and its advice and title name its joints."""
    if effect.in_catalogue and effects_of(effect.label, crane()) != (effect,):
        yield f"the label {effect.label} stands for another effect"
    if effect.label not in Model(crane(), (effect,)):
        yield f"a model with it does not contain {effect.label}"
    if "{" in effect.advice or "None" in effect.advice:
        yield f"the advice is '{effect.advice}'"
    for joint in (effect.joint, effect.source):
        if joint is not None and not (joint in effect.advice and joint in effect.title):
            yield f"its advice or its title does not name {joint}: '{effect.advice}'"


def has_parameters(effect: Effect) -> Iterator[str]:
    """At least one, of the right class, of different names."""
    yield from unsound_parameters(effect, crane())
