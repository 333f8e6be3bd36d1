"""What an effect says of its parameters."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

import numpy as np


@dataclass(frozen=True)
class Parameter:
    """A linear parameter of an effect: its name, unit and physical bounds."""

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True)
class ShapeParameter:
    """A parameter in which the columns are not linear, with the grid on which it is screened."""

    name: str
    unit: str
    grid: tuple[float, ...]
    _: KW_ONLY
    lower: float
    upper: float
