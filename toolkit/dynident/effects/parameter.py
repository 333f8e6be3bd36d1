"""What an effect says of its parameters."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass

import numpy as np


@dataclass(frozen=True)
class Parameter:
    """A linear parameter of an effect: its name, unit, physical bounds, and what it is in words.

    Attributes
    ----------
    is_level : whether it is a level of dry friction, which a joint that moves has overcome.
    """

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf
    _: KW_ONLY
    means: str = ""
    is_level: bool = False


@dataclass(frozen=True)
class ShapeParameter:
    """A parameter in which the columns are not linear, with the grid on which it is screened.

    It is sought by a coordinate without unit: its natural logarithm where it is positive, else its
    value as a share of its range.
    """

    name: str
    unit: str
    grid: tuple[float, ...]
    _: KW_ONLY
    lower: float
    upper: float
    means: str = ""

    def coordinate(self, value: float) -> float:
        """Return the coordinate of a value."""
        return math.log(value) if self.lower > 0 else value / (self.upper - self.lower)

    def at(self, coordinate: float) -> float:
        """Return the value at a coordinate, within the bounds."""
        found = np.exp(coordinate) if self.lower > 0 else coordinate * (self.upper - self.lower)
        return float(np.clip(found, self.lower, self.upper))

    def reach(self, factor: float) -> float:
        """Return how far a search may go: by a factor, or to the next value of the grid."""
        return math.log(factor) if self.lower > 0 else 1.5 / max(len(self.grid), 3)

    def slope(self, value: float) -> float:
        """Return the derivative of the value by the coordinate, at a value."""
        return value if self.lower > 0 else self.upper - self.lower
