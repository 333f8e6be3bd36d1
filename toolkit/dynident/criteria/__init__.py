"""The numbers that decide what a diagnosis says, in one place.

What comes in: nothing, or the numbers that a study wants otherwise (`Criteria.with_values`). What
goes out: one frozen `Criteria`, which `diagnose` is given and the evidence carries
(`evidence.criteria.gates.level`); `Criteria.table` lists it, `Criteria.changed` says what differs
from the defaults.

A number is a *criterion* if another one would give another answer: a level, a share from which
something counts, how much is searched and how finely, how much data a measurement needs. It says
of itself what it is, its unit, the range in which it makes sense, and where it comes from:

- *measured*: chosen on simulated or measured data, which are named;
- *literature*: with the citation;
- *taste*: a convention or a judgement; another choice could be defended as well.

A number is a *guard*, and stays where it is used, if it keeps the arithmetic sound (no division
by zero, directions that are rounding errors), limits memory, seeds a random choice, or belongs to
a formula (the median of a normal variable, the steps of a fixed point). Of an effect, its grid
and bounds are the effect's (`dynident.effects`). The bounds between kinds of answers in the blind
study's record belong to that record (`diagnosis.track_record`), which holds for the default
criteria only.

A study changes criteria by tables that are named as the groups are::

    [criteria.gates]
    level = 0.005
"""

from dynident.criteria.criteria import DEFAULTS, Criteria
from dynident.criteria.criteria_schema import criteria_schema
from dynident.criteria.criterion import ChangedCriterion
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

__all__ = [
    "DEFAULTS",
    "AdviceCriteria",
    "ChangedCriterion",
    "ContactCriteria",
    "Criteria",
    "FitCriteria",
    "GateCriteria",
    "GlobalSearchCriteria",
    "LoopCriteria",
    "MapCriteria",
    "NoiseCriteria",
    "NuisanceCriteria",
    "ProposalCriteria",
    "SearchCriteria",
    "ShapeCriteria",
    "StickingCriteria",
    "VerdictCriteria",
    "WiringCriteria",
    "criteria_schema",
]
