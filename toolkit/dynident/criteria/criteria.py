"""All criteria of a diagnosis, by subject."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from dynident.criteria.criterion import ChangedCriterion, CriteriaGroup, about
from dynident.criteria.evidence_criteria import FitCriteria, MapCriteria, NoiseCriteria
from dynident.criteria.judgement_criteria import (
    AdviceCriteria,
    ContactCriteria,
    LoopCriteria,
    NuisanceCriteria,
    StickingCriteria,
    VerdictCriteria,
)
from dynident.criteria.search_criteria import (
    GateCriteria,
    GlobalSearchCriteria,
    ProposalCriteria,
    SearchCriteria,
    ShapeCriteria,
)
from dynident.criteria.wiring_criteria import WiringCriteria
from dynident.errors import CriteriaError
from dynident.tables import Table
from dynident.words import nearest


@dataclass(frozen=True, kw_only=True, repr=False)
class Criteria:
    """The numbers that decide what a diagnosis says; see `dynident.criteria`.

    Attributes
    ----------
    noise : how noise is measured, and what exceeds it.
    fit : how the diagnosis fits a model.
    search : how much is tried, which of several effects is named.
    gates : what an effect must show to be significant and relevant.
    shapes, global_search : how shape parameters are found, near a grid and among all.
    contacts, nuisances, sticking : what is no missing physics and is allowed for.
    proposals : which laws are proposed where the catalogue does not explain what is missing.
    verdict : when a model is complete.
    maps : when a picture of the residual shows something.
    advice : which experiments are advised.
    loops : what the errors of a simulated closed loop mean.
    wiring : when recordings contradict what is said of their columns.
    """

    noise: NoiseCriteria = field(default_factory=NoiseCriteria)
    fit: FitCriteria = field(default_factory=FitCriteria)
    search: SearchCriteria = field(default_factory=SearchCriteria)
    gates: GateCriteria = field(default_factory=GateCriteria)
    shapes: ShapeCriteria = field(default_factory=ShapeCriteria)
    global_search: GlobalSearchCriteria = field(default_factory=GlobalSearchCriteria)
    contacts: ContactCriteria = field(default_factory=ContactCriteria)
    nuisances: NuisanceCriteria = field(default_factory=NuisanceCriteria)
    sticking: StickingCriteria = field(default_factory=StickingCriteria)
    proposals: ProposalCriteria = field(default_factory=ProposalCriteria)
    verdict: VerdictCriteria = field(default_factory=VerdictCriteria)
    maps: MapCriteria = field(default_factory=MapCriteria)
    advice: AdviceCriteria = field(default_factory=AdviceCriteria)
    loops: LoopCriteria = field(default_factory=LoopCriteria)
    wiring: WiringCriteria = field(default_factory=WiringCriteria)

    @classmethod
    def with_values(cls, values: Mapping[str, Any]) -> Criteria:
        """Return the defaults with other values in places.

        Parameters
        ----------
        values : by group, then by criterion: `{"gates": {"level": 0.005}}`, as a study has them.

        Raises
        ------
        CriteriaError
            If a group or a criterion is unknown, or a value is of the wrong kind or out of its
            range; it names the first.
        """
        kinds = {one.name: one.default_factory for one in fields(cls)}
        groups = {}
        for group, wanted in values.items():
            if group not in kinds:
                what = f"unknown group '{group}'"
                raise CriteriaError(what, remedy=nearest(group, list(kinds), "groups"))
            kind: Any = kinds[group]
            if not isinstance(wanted, Mapping):
                remedy = f"write [criteria.{group}] with {', '.join(kind.names()[:2])}, ..."
                raise CriteriaError(f"{group}: a table is needed here", remedy=remedy)
            for name in wanted:
                if name not in kind.names():
                    remedy = nearest(name, kind.names(), "criteria")
                    raise CriteriaError(f"unknown criterion '{group}.{name}'", remedy=remedy)
            plain = {k: tuple(v) if isinstance(v, list) else v for k, v in wanted.items()}
            try:
                groups[group] = kind(**plain)
            except CriteriaError as error:
                raise CriteriaError(f"{group}.{error.what}", remedy=error.remedy) from None
        return cls(**groups)

    def __repr__(self) -> str:
        """What differs from the defaults only: the rest is long."""
        return f"Criteria({', '.join(str(one) for one in self.changed)})"

    @property
    def changed(self) -> tuple[ChangedCriterion, ...]:
        """What differs from the defaults."""
        return tuple(
            one for group in fields(self) for one in getattr(self, group.name).changed(group.name)
        )

    def table(self) -> Table:
        """Every criterion: its value, what it is, where it comes from."""
        rows = []
        for group in fields(self):
            own: CriteriaGroup = getattr(self, group.name)
            for one in fields(own):
                known, value = about(one), getattr(own, one.name)
                shown = ", ".join(
                    f"{x:g}" for x in (value if isinstance(value, tuple) else (value,))
                )
                rows.append(
                    (f"{group.name}.{one.name}", shown, known.unit, known.what, known.source)
                )
        columns = ("criterion", "value", "unit", "what it is", "source")
        return Table("Criteria of the diagnosis", columns, tuple(rows))


DEFAULTS = Criteria()
"""Every criterion as it is where nobody says otherwise."""
