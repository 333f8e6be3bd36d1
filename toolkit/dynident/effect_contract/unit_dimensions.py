"""The dimensions of a unit as it is written: exponents of force, length and time."""

from __future__ import annotations

import re
from dataclasses import dataclass

from dynident.errors import EffectError

_POWERS: dict[str, tuple[int, int, int]] = {
    "N": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "kg": (1, -1, 2),
    "Hz": (0, 0, -1),
    "J": (1, 1, 0),
    "W": (1, 1, -1),
    "min": (0, 0, 1),
    "h": (0, 0, 1),
    **dict.fromkeys(("1", "rad", "deg", "rev", "%", "K", "degC", "A", "V"), (0, 0, 0)),
}
"""Of force, length and time; angles, temperatures and currents are not among them."""
_FACTOR = re.compile(r"([A-Za-z%]+|1)(?:\^(-?\d{1,2}))?")


@dataclass(frozen=True)
class Dimensions:
    """Exponents of force, length and time."""

    force: int = 0
    length: int = 0
    time: int = 0

    def __mul__(self, other: Dimensions) -> Dimensions:
        return Dimensions(
            self.force + other.force, self.length + other.length, self.time + other.time
        )

    def __pow__(self, power: int) -> Dimensions:
        return Dimensions(power * self.force, power * self.length, power * self.time)


def factors(unit: str) -> tuple[tuple[str, int], ...]:
    """Return the units that one is a product of, with their powers.

    Raises
    ------
    EffectError
        If it is not written as `N m s^2/rad` or `rad/(N m)`, with known units.
    """
    above, slash, below = unit.partition("/")
    if below.startswith("(") and below.endswith(")"):
        below = below[1:-1]
    elif " " in below:
        raise _refusal(unit, "two units follow the stroke", "write N m/(rad s)")
    found = [(name, power) for name, power in _product(above, unit)]
    if slash:
        found += [(name, -power) for name, power in _product(below, unit)]
    return tuple(found)


def dimensions(unit: str) -> Dimensions:
    """Return the dimensions of a unit; see `factors`."""
    found = Dimensions()
    for name, power in factors(unit):
        found = found * Dimensions(*_POWERS[name]) ** power
    return found


def _product(text: str, unit: str) -> list[tuple[str, int]]:
    found = []
    for word in text.split(" "):
        match = _FACTOR.fullmatch(word)
        if match is None:
            raise _refusal(unit, f"'{word}' is no unit", "write it as N m s^2/rad")
        if match[1] not in _POWERS:
            known = ", ".join(_POWERS)
            raise _refusal(unit, f"no unit is named '{match[1]}'", f"units: {known}")
        found.append((match[1], int(match[2] or 1)))
    return found


def _refusal(unit: str, what: str, remedy: str) -> EffectError:
    return EffectError(f"the unit '{unit[:40]}' cannot be read: {what}", None, remedy)
