"""The catalogue of physical effects: one class, in one file, each.

A new effect is a new file in one of the folders here and nothing else: every subclass of `Effect`
found in them joins the catalogue, and with it the fits, the diagnosis, the simulator, the report
and the tests. `friction`, `drives`, `transmissions` and `bodies` say where an effect sits.
"""

from dynident.effects.block import FRICTION_WIDTH, Block
from dynident.effects.effect import Effect, JointEffect
from dynident.effects.parameter import Parameter, ShapeParameter
from dynident.effects.registry import catalogue, effects_of
from dynident.effects.terms import Term
from dynident.effects.traits import Needs
from dynident.effects.transmission import Transmission

__all__ = [
    "FRICTION_WIDTH",
    "Block",
    "Effect",
    "JointEffect",
    "Needs",
    "Parameter",
    "ShapeParameter",
    "Term",
    "Transmission",
    "catalogue",
    "effects_of",
]
