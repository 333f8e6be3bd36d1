"""What has changed between two estimates of one robot, as an answer with its tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dynident.fitting.comparing.unlike_effects import LoneParameter
from dynident.tables import Shown, Table, json_row, number, p_value

LEVEL = 0.05
"""Probability that anything is said to have changed where nothing has."""
_INTERVAL = 1.959964


@dataclass(frozen=True, kw_only=True)
class ParameterChange:
    """A parameter, or a combination that both estimates identify, then and now.

    Attributes
    ----------
    parameter, unit : name of its head, as in the table of an estimate.
    stands_for : the combination; empty where it is the parameter alone.
    before, after : values.
    sigma : standard deviation of the difference.
    z : the difference over it.
    p_adjusted : that any of all parameters seems to have changed as much, by Holm.
    has_changed : beyond the joint uncertainty, by this and by the test of all together.
    """

    parameter: str
    unit: str
    stands_for: str
    before: float
    after: float
    sigma: float
    z: float
    p_adjusted: float
    has_changed: bool


@dataclass(frozen=True, kw_only=True, repr=False)
class EstimateChanges(Shown):
    """What two estimates of one robot say of the time between them.

    Attributes
    ----------
    parameters : the surest change first.
    statistic, freedom, p_value : of the hypothesis that nothing has changed, chi-square.
    only_before, only_after : parameters of effects that one of them has alone. Then p values are
        the larger of two, as estimated and without these effects.
    caveats : in plain words.
    """

    parameters: tuple[ParameterChange, ...]
    statistic: float
    freedom: int
    p_value: float
    only_before: tuple[LoneParameter, ...] = ()
    only_after: tuple[LoneParameter, ...] = ()
    caveats: tuple[str, ...] = ()

    @property
    def changed(self) -> tuple[ParameterChange, ...]:
        """Parameters that have changed beyond their joint uncertainty."""
        return tuple(one for one in self.parameters if one.has_changed)

    @property
    def sentence(self) -> str:
        """The answer in plain words."""
        return " ".join([self._of_shared, *self._of_others])

    @property
    def _of_shared(self) -> str:
        count, both = len(self.changed), " that both have" if self.only_one else ""
        if count:
            has = "have" if count > 1 else "has"
            of = f"{count} of {len(self.parameters)} parameters{both}"
            return f"{of} {has} changed beyond the joint uncertainty."
        if self.p_value < LEVEL:
            return (
                f"Something{both} has changed beyond the joint uncertainty, and no parameter alone "
                "tells what."
            )
        return (
            f"None of {len(self.parameters)} parameters{both} has changed beyond the joint "
            "uncertainty."
        )

    @property
    def _of_others(self) -> list[str]:
        return [
            f"Only the estimate {when} has {', '.join(dict.fromkeys(o.effect for o in found))}."
            for when, found in (("before", self.only_before), ("after", self.only_after))
            if found
        ]

    @property
    def only_one(self) -> tuple[LoneParameter, ...]:
        """Parameters that one of them has alone."""
        return (*self.only_before, *self.only_after)

    def to_dict(self) -> dict[str, Any]:
        """The JSON of `changes --json`."""
        return {
            "changed": [one.parameter for one in self.changed],
            "chi_square": {
                "statistic": self.statistic,
                "freedom": self.freedom,
                "p_value": self.p_value,
            },
            "parameters": [json_row(one) for one in self.parameters],
            "only_before": [json_row(one) for one in self.only_before],
            "only_after": [json_row(one) for one in self.only_after],
            "caveats": list(self.caveats),
        }

    def table(self) -> Table:
        """Every parameter, the surest change first."""
        rows = tuple(
            (
                one.parameter,
                number(one.before, 4),
                number(one.after, 4),
                f"{number(one.after - one.before, 3)} \u00b1 {number(_INTERVAL * one.sigma, 2)}",
                one.unit,
                number(one.z, 3),
                p_value(one.p_adjusted),
                "changed" if one.has_changed else "",
                one.stands_for,
            )
            for one in self.parameters
        )
        head = (
            "parameter",
            "before",
            "after",
            "change, 95 %",
            "unit",
            "z",
            "p",
            "finding",
            "stands for",
        )
        overall = (
            f"All together: chi-square {number(self.statistic, 4)} with {self.freedom} degrees of "
            f"freedom, p {p_value(self.p_value)}."
        )
        each = (
            "p: corrected (Holm) for all parameters. One is said to have changed where both p, its "
            f"own and that of all together, are below {LEVEL:g}."
        )
        if self.only_one:
            each += " Every p is the larger of two: as estimated, and without what one has alone."
        return Table("Parameters then and now", head, rows, (overall, each))

    def lone_table(self) -> Table:
        """Every parameter that one of them has alone, with its uncertainty."""
        rows = tuple(
            (
                one.parameter,
                one.effect,
                when,
                "not identified on its own" if np.isnan(one.value) else number(one.value, 4),
                f"\u00b1 {number(_INTERVAL * one.sigma, 2)}" if np.isfinite(one.sigma) else "",
                one.unit,
                one.stands_for,
            )
            for when, found in (("before", self.only_before), ("after", self.only_after))
            for one in found
        )
        head = ("parameter", "effect", "only", "value", "95 %", "unit", "stands for")
        return Table("Effects that one of them has alone", head, rows)

    def tables(self) -> tuple[Table | str, ...]:
        """Everything that `show` prints, in its order."""
        alone = (self.lone_table(),) if self.only_one else ()
        return (self.sentence, self.table(), *alone, *self.caveats)
