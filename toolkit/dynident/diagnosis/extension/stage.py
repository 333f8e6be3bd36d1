"""How far a diagnosis has come: the model as it is extended, and the evidence for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from dynident.arguments import checked
from dynident.diagnosis.nuisances.contacts import Contacts
from dynident.diagnosis.search.global_search import RankedModel
from dynident.diagnosis.search.payload_recordings import with_payload_decided
from dynident.diagnosis.search.ranking import Ranking
from dynident.diagnosis.search.selection import AddedEffect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.evidence.simulated_motion import SimulatedMotion
from dynident.recording import Dataset

Propose = Literal["unexplained", "always", "never"]
"""When laws are proposed for what the catalogue leaves."""

AskedSwitches = Literal["none", "all"]
"""Whether every choice among the effects added is fitted and judged, too."""


@checked
@dataclass(frozen=True, kw_only=True)
class DiagnosisTask:
    """What is asked: see `dynident.diagnosis.procedure.diagnose`."""

    train: Dataset
    test: Dataset | None
    most: int
    progress: Callable[[str], None]
    propose: Propose
    switches: AskedSwitches = "none"


_SAME_MISFIT = 1e-3
"""By which misfits of the same effects on the same rows may differ: shapes are sought to less."""


@dataclass(frozen=True, kw_only=True)
class VisitedModel:
    """A model by which a search has come.

    Attributes
    ----------
    effects : labels of what was added.
    doubtful : joints of which rows were left out.
    misfit : over the model as given, see `EvidenceFit.misfit`.
    """

    effects: frozenset[str]
    doubtful: frozenset[str]
    misfit: float

    def is_same(self, other: VisitedModel) -> bool:
        """Whether it is the same model, whatever was added first: the same is missing from it."""
        alike = self.effects == other.effects and self.doubtful == other.doubtful
        return alike and abs(self.misfit - other.misfit) <= _SAME_MISFIT * abs(other.misfit)


@dataclass(frozen=True, kw_only=True)
class Stage:
    """The model as far as it is extended, and the evidence that it is fitted to.

    Attributes
    ----------
    evidence, held : of the training and of the test recordings, contacts left out; `held` is None
        where blocks of time are held out.
    narrow : the training recordings behind lower cut-offs, where noise in the columns is unknown.
    loop : behind the simulated motion in the evidence, where there is one.
    contacts : those that were left out.
    start, fitted : fits of the model as given, and of the one with all effects added.
    found : these effects.
    rounds : the ranking after each of them, the first one before any.
    visited : the models that were ranked.
    refused : labels of effects that were withdrawn, with the reason: they are not tried again.
    doubtful : joints whose dry friction may follow another law at their reversals, with the speed
        (rad/s or m/s) within which rows were left out for that.
    notes : what was left out on the way, in plain words.
    """

    evidence: Evidence
    held: Evidence | None
    narrow: tuple[Evidence, ...]
    loop: SimulatedMotion
    contacts: Contacts
    start: EvidenceFit
    fitted: EvidenceFit
    found: tuple[AddedEffect, ...] = ()
    rounds: tuple[Ranking, ...] = ()
    visited: tuple[VisitedModel, ...] = ()
    refused: Mapping[str, str] = field(default_factory=dict)
    doubtful: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def proposals(self) -> int:
        """Effects added, one at several joints counting once."""
        return len({one.with_it or one.score.effect.label for one in self.found})

    @property
    def latest(self) -> tuple[AddedEffect, ...]:
        """What was added last, at all of its joints."""
        groups = [one.with_it or one.score.effect.label for one in self.found]
        return tuple(
            one for one, group in zip(self.found, groups, strict=True) if group == groups[-1]
        )

    @property
    def visiting(self) -> VisitedModel:
        """The model, as other ways may come by it, too."""
        return VisitedModel(
            effects=frozenset(one.score.effect.label for one in self.found),
            doubtful=frozenset(self.doubtful),
            misfit=self.fitted.misfit(self.start),
        )

    @property
    def judging(self) -> Evidence | None:
        """The test recordings, with those marked that carry a payload of the model."""
        return None if self.held is None else with_payload_decided(self.held, self.fitted)

    @property
    def ranked(self) -> RankedModel:
        """The model with its latest ranking."""
        return RankedModel(evidence=self.evidence, fitted=self.fitted, ranking=self.rounds[-1])
