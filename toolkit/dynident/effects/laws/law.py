"""A law of a user: its name, its formula, and the ranges of the parameters inside it."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from functools import cached_property

from dynident.errors import EffectError
from dynident.formulas import (
    Formula,
    Signal,
    linear_parameters,
    multiplied_by,
    nodes,
    parse_formula,
)

PREFIX = "law:"
"""What the name of an effect begins with that is a law."""
_NAME = re.compile(r"[A-Za-z]\w{0,39}", re.ASCII)


@dataclass(frozen=True, kw_only=True)
class Law:
    """A torque at a joint as a formula of the motion.

    Attributes
    ----------
    name : a word.
    torque : the formula, see `dynident.formulas.parse_formula`; `q`, `v`, `a` and `load` are of the
        joint at which the law sits, `sign` is the study's law of dry friction.
    shape : (name, lower, upper) of each parameter that may stand anywhere in the formula, in the
        unit that it has there. All others must be factors of terms.

    Raises
    ------
    EffectError
        If it has no proper name, the formula cannot be read, is not linear in what has no range,
        does not vanish with that, or a range is none.

    Examples
    --------
    >>> shape = (("k", 1.0, 6.0), ("p", -1.6, 1.6))
    >>> drum = Law(name="drum", torque="e*load*cos(k*q + p)", shape=shape)
    >>> drum.linear
    ('e',)
    >>> fit = di.fit(study.model + law_effect(drum)("elbow"), study.train)
    """

    name: str
    torque: str
    shape: tuple[tuple[str, float, float], ...] = ()
    formula: Formula = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not _NAME.fullmatch(self.name):
            remedy = "use a word of up to 40 letters, digits and underscores"
            raise EffectError(f"'{str(self.name)[:60]}' is no name of a law", remedy=remedy)
        names = [name for name, _, _ in self.shape]
        for name, lower, upper in self.shape:
            if not (math.isfinite(lower) and math.isfinite(upper) and lower < upper):
                remedy = "give [low, high], finite and in this order"
                raise EffectError(f"the range of {name} is no range", self.label, remedy)
            if names.count(name) > 1:
                raise EffectError(f"{name} has two ranges", self.label, "give one")
        try:
            object.__setattr__(self, "formula", parse_formula(self.torque))
            _ = self.linear
            if self.shape and not self.signals:
                remedy = "put a signal into it, as q or v"
                raise EffectError("a constant has no shape", remedy=remedy)
        except EffectError as error:
            raise EffectError(error.what, self.label, error.remedy) from None

    @property
    def label(self) -> str:
        """The name of its effect, `law:name`."""
        return f"{PREFIX}{self.name}"

    @cached_property
    def linear(self) -> tuple[str, ...]:
        """Parameters in which it is linear, in their order in the formula."""
        return linear_parameters(self.formula, [name for name, _, _ in self.shape])

    @cached_property
    def columns(self) -> tuple[Formula, ...]:
        """The torque of each linear parameter, per unit of it."""
        shapes = [name for name, _, _ in self.shape]
        return tuple(multiplied_by(self.formula, name, shapes) for name in self.linear)

    @cached_property
    def signals(self) -> tuple[Signal, ...]:
        """What it takes of the motion, each once."""
        return tuple(dict.fromkeys(n for n in nodes(self.formula) if isinstance(n, Signal)))

    @cached_property
    def quantities(self) -> frozenset[str]:
        """Kinds of its signals."""
        return frozenset(one.quantity for one in self.signals)
