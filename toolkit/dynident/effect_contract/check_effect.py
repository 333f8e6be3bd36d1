"""`check_effect`: every rule of the contract in turn, and the first that is broken by its name."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

from dynident.effect_contract import (
    column_rules,
    derivative_rules,
    file_rules,
    parameter_rules,
    scaling_rules,
    simulation_rules,
    word_rules,
)
from dynident.effect_contract.crane import places
from dynident.effects import Effect
from dynident.errors import DynidentError, EffectError

_CORRECT = "correct the class"


@dataclass(frozen=True)
class ContractRule:
    """A promise that every effect keeps.

    Attributes
    ----------
    name : of the rule, as complaints have it.
    asked_of : a class once, or its effect at every place of a robot.
    complaints : yields how it is broken, with figures.
    remedy : what to do about it.
    """

    name: str
    asked_of: Literal["class", "place"]
    complaints: Callable[[Any], Iterator[str]]
    remedy: str = _CORRECT


_COPY = "copy what is to be changed"
_UNITS = "state the unit with which column times parameter is a torque"
RULES = (
    ContractRule("words", "class", word_rules.says_what_it_is, "say it as a class attribute"),
    ContractRule("pictures", "class", word_rules.pictures_can_be_drawn),
    ContractRule("places refused", "class", word_rules.refuses_wrong_places),
    ContractRule("parameters", "place", word_rules.has_parameters),
    ContractRule("finite columns", "place", column_rules.columns_are_finite),
    ContractRule("block unchanged", "place", column_rules.blocks_stay_as_they_are, _COPY),
    ContractRule("seen somewhere", "class", word_rules.can_be_somewhere),
    ContractRule("words of its place", "place", word_rules.has_words_for_its_place),
    ContractRule("units", "place", parameter_rules.units_are_of_its_joint, _UNITS),
    ContractRule("bounds", "place", parameter_rules.bounds_leave_room),
    ContractRule("shapes refused", "place", parameter_rules.shapes_outside_are_refused),
    ContractRule("acting joints", "place", column_rules.acts_where_it_says),
    ContractRule("families", "place", column_rules.families_are_their_variants),
    ContractRule("one sample as many", "place", column_rules.one_sample_is_as_many),
    ContractRule("needs", "place", column_rules.needs_no_more_than_it_says, "state its `needs`"),
    ContractRule("traits", "place", column_rules.traits_agree),
    ContractRule("payload", "place", column_rules.payload_acts_on_board_only),
    ContractRule("scaling with torque", "place", scaling_rules.scales_with_the_torque),
    ContractRule("scaling as units", "place", scaling_rules.scales_as_its_units, _UNITS),
    ContractRule("contained effects", "class", column_rules.contained_effects_are_in_it),
    ContractRule("chords", "place", derivative_rules.chords_tend_to_the_derivative),
    ContractRule("derivatives", "place", derivative_rules.sensitivities_are_the_derivatives),
    ContractRule("zero values", "place", simulation_rules.zero_is_no_effect),
    ContractRule("simulation equals columns", "place", simulation_rules.simulation_is_the_columns),
    ContractRule("simulated terms", "place", simulation_rules.terms_are_the_force),
    ContractRule("study file", "class", file_rules.studies_keep_it),
    ContractRule("estimate file", "class", file_rules.estimates_keep_it),
)
"""In the order in which they are asked: each may take for granted what those before it say."""


def check_effect(kind: type[Effect]) -> None:
    """Put an effect's class to the test that every effect of the catalogue passes.

    Words, units, bounds, columns, derivatives, simulation and files, at every place of a small
    crane with joints that slide and turn. It takes about a second.

    Raises
    ------
    EffectError
        If a rule is broken: the first one is named, with figures.
    """
    if not (isinstance(kind, type) and issubclass(kind, Effect)):
        what = f"{kind!r:.80} is no subclass of Effect"
        raise EffectError(what, remedy="give the class, not an effect at a joint")
    for rule in RULES:
        try:
            asked = (kind,) if rule.asked_of == "class" else places(kind)
        except (Exception, SystemExit) as error:
            raise _broken(rule, kind.__qualname__, _said(error, kind), _CORRECT) from None
        for one in asked:
            where = one.label if isinstance(one, Effect) else kind.__qualname__
            try:
                complaint, remedy = next(iter(rule.complaints(one)), None), rule.remedy
            except (Exception, SystemExit) as error:  # raised by the class
                complaint, remedy = _said(error, kind), _CORRECT
            if complaint is not None:
                raise _broken(rule, where, complaint, remedy)


def _broken(rule: ContractRule, where: str, complaint: str, remedy: str) -> EffectError:
    what = f"breaks the rule '{rule.name}': {' '.join(complaint.split())}"
    return EffectError(what, where, remedy)


def _said(error: BaseException, kind: type[Effect]) -> str:
    """What went wrong and where, in the file of the class if it was there."""
    frames = traceback.extract_tb(error.__traceback__)
    file = getattr(sys.modules.get(kind.__module__), "__file__", None)
    own = [one for one in frames if one.filename == file]
    if isinstance(error, DynidentError):
        said = error.what
    else:
        said, own = f"{type(error).__name__}: {error}", own or list(frames)
    return said + (f" ({own[-1].filename}:{own[-1].lineno})" if own else "")
