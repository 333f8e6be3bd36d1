"""Effects whose torque is a formula, see `dynident.formulas`."""

from dynident.effects.laws.law import PREFIX, Law
from dynident.effects.laws.law_effect import LawEffect, law_effect
from dynident.effects.laws.law_file import LawEntry, LawsEntry, laws_of, laws_table

__all__ = [
    "PREFIX",
    "Law",
    "LawEffect",
    "LawEntry",
    "LawsEntry",
    "law_effect",
    "laws_of",
    "laws_table",
]
