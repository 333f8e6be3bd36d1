"""What an effect draws in a map of residuals against one quantity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

Quantity = Literal["velocity", "position", "acceleration", "load", "time"]
"""Against which residuals are drawn."""


@dataclass(frozen=True)
class ResidualPicture:
    """A shape in a residual map by which an effect is recognised.

    Attributes
    ----------
    against : the quantity of the map, of the joint at which the effect is.
    words : what is seen and what it is a sign of, one clause.
    of : of the quantity (B,) and the largest that occurs, the shape (B,) up to a factor.
    """

    against: Quantity
    words: str
    of: Callable[[np.ndarray, float], np.ndarray]
