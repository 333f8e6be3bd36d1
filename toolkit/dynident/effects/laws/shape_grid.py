"""Values of the parameters inside a formula from which a search for them begins."""

from __future__ import annotations

import numpy as np

from dynident.effects.laws.law import Law
from dynident.formulas import Formula, Operation, Signal, Unknown, nodes

_MOST = 400  # combinations of all shapes
_SPACING = 0.5  # of a frequency, rad per rad, m or s: a cycle more or less over 4 pi
_PHASES = 4
_OTHERS = 8
_WIDE = 5.0  # upper over lower bound from which values are spaced evenly by their logarithm


def shape_grid(law: Law) -> dict[str, tuple[float, ...]]:
    """Return the values of each shape parameter that are screened, ascending.

    Frequencies in sines are spaced so that a search reaches the next peak, and phases cover a
    turn; all others are few. Together they are at most 400 combinations.

    Parameters
    ----------
    law : with the ranges.
    """
    kinds = _kinds(law.formula)
    counts: dict[str, int] = {}
    for name, lower, upper in law.shape:
        match kinds.get(name):
            case "frequency":
                counts[name] = int(np.clip((upper - lower) / _SPACING + 1, 6, _MOST))
            case "phase":
                counts[name] = _PHASES
            case _:
                counts[name] = _OTHERS
    while np.prod(list(counts.values())) > _MOST:
        widest = max(counts, key=lambda name: counts[name])
        counts[widest] = max(2, int(0.8 * counts[widest]))
    return {
        name: _values(lower, upper, counts[name], kinds.get(name, ""))
        for name, lower, upper in law.shape
    }


def _values(lower: float, upper: float, count: int, kind: str) -> tuple[float, ...]:
    if kind == "phase":
        # The ends of a turn are the same phase.
        inside = lower + (upper - lower) * (np.arange(count) + 0.5) / count
        return tuple(inside.tolist())
    if kind != "frequency" and lower > 0 and upper > _WIDE * lower:
        return tuple(np.clip(np.geomspace(lower, upper, count), lower, upper).tolist())
    return tuple(np.linspace(lower, upper, count).tolist())


def _kinds(formula: Formula) -> dict[str, str]:
    """Name -> frequency, of what multiplies a signal inside a sine; or phase, if added there."""
    found: dict[str, str] = {}
    for node in nodes(formula):
        if isinstance(node, Operation) and node.name in ("sin", "cos"):
            for inner in nodes(node.of[0]):
                if isinstance(inner, Operation) and inner.name in "*/":
                    own = [n for one in inner.of for n in nodes(one)]
                    if any(isinstance(n, Signal) for n in own):
                        found |= {n.name: "frequency" for n in own if isinstance(n, Unknown)}
            for inner in nodes(node.of[0]):
                if isinstance(inner, Unknown):
                    found.setdefault(inner.name, "phase")
    return found
