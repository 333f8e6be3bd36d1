"""Laws that users write as formulas: read by a whitelist, never evaluated as code.

`parse_formula` makes a tree of a text, `linear_parameters` says in which of its parameters it is
linear, `multiplied_by` what one of them multiplies, `units_of` which units they have, `evaluate`
computes it, of numbers or of symbols, and `evaluate_slopes` its derivatives by its parameters.
"""

from dynident.formulas.formula_slopes import SlopeValues, evaluate_slopes
from dynident.formulas.formula_tree import (
    Formula,
    Number,
    Operation,
    Quantity,
    Signal,
    Unknown,
    nodes,
    quoted_joint,
    text_of,
)
from dynident.formulas.formula_value import Values, evaluate
from dynident.formulas.linearity import linear_parameters, multiplied_by
from dynident.formulas.parsing import LONGEST, parse_formula
from dynident.formulas.units import Unit, units_of

__all__ = [
    "LONGEST",
    "Formula",
    "Number",
    "Operation",
    "Quantity",
    "Signal",
    "SlopeValues",
    "Unit",
    "Unknown",
    "Values",
    "evaluate",
    "evaluate_slopes",
    "linear_parameters",
    "multiplied_by",
    "nodes",
    "parse_formula",
    "quoted_joint",
    "text_of",
    "units_of",
]
