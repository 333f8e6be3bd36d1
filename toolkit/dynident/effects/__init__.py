"""The catalogue of physical effects: one class, in one file, each.

A new effect is a subclass of `Effect` and nothing else: with a name of its own it joins the
catalogue when it is defined, wherever that is, and with it the fits, the diagnosis, the simulator,
the report and the tests. Those that dynident brings are files in the folders here: `friction`,
`drives`, `transmissions` and `bodies` say where an effect sits. docs/your_own_effects.md has an
example of one's own.
"""

from dynident.effects.block import FRICTION_WIDTH, Block
from dynident.effects.effect import Effect, JointEffect, force_unit, motion_unit
from dynident.effects.laws import (
    Law,
    LawEffect,
    LawEntry,
    LawsEntry,
    law_effect,
    laws_of,
    laws_table,
)
from dynident.effects.origin import Origin, origin_of
from dynident.effects.parameter import Parameter, ShapeParameter
from dynident.effects.registry import catalogue, effects_of
from dynident.effects.residual_picture import ResidualPicture
from dynident.effects.terms import Term
from dynident.effects.traits import Needs
from dynident.effects.transmission import Transmission

__all__ = [
    "FRICTION_WIDTH",
    "Block",
    "Effect",
    "JointEffect",
    "Law",
    "LawEffect",
    "LawEntry",
    "LawsEntry",
    "Needs",
    "Origin",
    "Parameter",
    "ResidualPicture",
    "ShapeParameter",
    "Term",
    "Transmission",
    "catalogue",
    "effects_of",
    "force_unit",
    "law_effect",
    "laws_of",
    "laws_table",
    "motion_unit",
    "origin_of",
]
