"""One number that decides an answer: what it is, its unit, where it comes from, its range."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import Field, dataclass, field, fields, replace
from typing import Any, TypeVar

from dynident.errors import CriteriaError

T = TypeVar("T")
Number = float | int | tuple[float, ...]

TWO_LINK_CASES = "measured: 160 simulated two-link robots with one hidden effect, and healthy ones"


@dataclass(frozen=True, kw_only=True)
class AboutCriterion:
    """What is known of a criterion beside its value.

    Attributes
    ----------
    default : what it is where nobody says otherwise.
    what : what it is, one clause.
    unit : "1" for a pure number.
    source : "measured: ...", "literature: ..." or "taste", see `dynident.criteria`.
    over, least, most : the range: above `over`, or from `least`; up to `most`.
    """

    default: Any
    what: str
    unit: str
    source: str
    over: float
    least: float
    most: float

    def objection(self, value: Any) -> str:
        """Why a value cannot stand in for the default; empty where it can."""
        default = self.default
        if isinstance(default, tuple):
            if not isinstance(value, tuple) or len(value) < 2:
                return "needs a list of at least two numbers"
            each = [replace(self, default=0.0).objection(x) for x in value]
            if any(each):
                return next(filter(None, each))
            return "" if list(value) == sorted(set(value)) else "its numbers must ascend"
        if isinstance(default, int) and (not isinstance(value, int) or isinstance(value, bool)):
            return "needs a whole number"
        if not isinstance(value, float | int) or isinstance(value, bool):
            return "needs a number"
        if math.isfinite(value) and value > self.over and self.least <= value <= self.most:
            return ""
        return f"{value:g} is out of its range ({self.range})"

    @property
    def range(self) -> str:
        """The range in words."""
        low = f"above {self.over:g}" if self.over > -math.inf else f"at least {self.least:g}"
        return low if self.most == math.inf else f"{low}, at most {self.most:g}"


def criterion(
    default: T,
    unit: str,
    what: str,
    source: str = "taste",
    *,
    over: float | None = None,
    least: float = 0.0,
    most: float = math.inf,
) -> T:
    """Return a field of a group of criteria.

    Parameters
    ----------
    default : a number, whole or not, or ascending numbers.
    unit, what, source, over, least, most : see `AboutCriterion`.
    """
    known = AboutCriterion(
        default=default,
        what=what,
        unit=unit,
        source=source,
        over=-math.inf if over is None else over,
        least=least if over is None else -math.inf,
        most=most,
    )
    return field(default=default, metadata={"criterion": known})  # type: ignore[return-value]


@dataclass(frozen=True, kw_only=True)
class CriteriaGroup:
    """Criteria of one subject.

    Raises
    ------
    CriteriaError
        If a value is of the wrong kind or out of its range; it names the criterion.
    """

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        for one in fields(self):
            objection = about(one).objection(getattr(self, one.name))
            if objection:
                raise CriteriaError(f"{one.name}: {objection}", remedy=described(one))

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Names of its criteria."""
        return tuple(one.name for one in fields(cls))

    def changed(self, group: str) -> Iterator[ChangedCriterion]:
        """Yield what differs from the defaults; `group` is the name of this group."""
        for one in fields(self):
            value, usual = getattr(self, one.name), about(one).default
            if value != usual:
                yield ChangedCriterion(name=f"{group}.{one.name}", value=value, usual=usual)


@dataclass(frozen=True, kw_only=True)
class ChangedCriterion:
    """A criterion that is not the default.

    Attributes
    ----------
    name : "group.criterion".
    value, usual : as it is, and the default.
    """

    name: str
    value: Number
    usual: Number

    @property
    def cells(self) -> tuple[str, str, str]:
        """Name, value and default, as a row of a table."""
        return self.name, _plain(self.value), _plain(self.usual)

    def __str__(self) -> str:
        return "{} = {} (default {})".format(*self.cells)


def about(one: Field[Any]) -> AboutCriterion:
    """What is known of a field of a group."""
    return one.metadata["criterion"]


def described(one: Field[Any]) -> str:
    """Say what a field is, with its default."""
    found = about(one)
    unit = "" if found.unit == "1" else f" {found.unit}"
    return f"{one.name} is: {found.what} (default {_plain(found.default)}{unit})"


def _plain(value: Any) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(_plain(x) for x in value) + "]"
    return f"{value:g}"
