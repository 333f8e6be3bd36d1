"""Forces made of the few laws that a simulator evaluates natively."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Law = Literal["constant", "position", "speed", "sign", "magnitude"]


@dataclass(frozen=True)
class Term:
    """One term of a force: coefficient * law(x).

    Attributes
    ----------
    at : column of the joint whose torque it takes.
    law : with x the sum of positions (`position`) or speeds of the joints in `of`: "constant" 1,
        "position" x, "speed" x, "sign" tanh(x / w), w the width of dry friction, "magnitude" |x|.
    of : columns of the joints whose motion it follows; none for a constant.
    coefficient : N m or N per unit of the law; any sign.
    """

    at: int
    law: Law
    of: tuple[int, ...]
    coefficient: float
