"""The loop: compare, find what is missing, add it, fit again, compare."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dynident.closed_loop import Controller
from dynident.criteria import DEFAULTS, Criteria
from dynident.diagnosis.assembly import Found, Search, told
from dynident.diagnosis.nuisances.contacts import Contacts
from dynident.diagnosis.nuisances.friction_width import with_friction_width
from dynident.diagnosis.nuisances.quantisation import nothing_but_rounding
from dynident.diagnosis.result import Diagnosis
from dynident.diagnosis.search.global_search import RankedModel, global_search
from dynident.diagnosis.search.payload_recordings import with_payload, with_payload_decided
from dynident.diagnosis.search.pruning import without_superfluous
from dynident.diagnosis.search.ranking import Ranking, candidates, rank
from dynident.diagnosis.search.selection import alternatives_only, breaks_its_promise, choose
from dynident.diagnosis.search.shaped_fit import refitted, shaped
from dynident.effects import Effect
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.held_out import on_recordings
from dynident.evidence.runs import gather
from dynident.evidence.simulated_motion import SimulatedMotion, motion_of_loop
from dynident.fitting.estimate import Estimate
from dynident.model import Model
from dynident.recording import Dataset, numbered
from dynident.threads import single_threaded


@single_threaded
def diagnose(
    model: Model | Estimate,
    train: Dataset,
    test: Dataset | None = None,
    *,
    controller: Controller | None = None,
    most: int | None = None,
    criteria: Criteria = DEFAULTS,
    progress: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Find where a model fails and which physical effects it lacks.

    Parameters
    ----------
    model : the model as given (or an estimate of it: it is fitted anew, with instruments where
        the motion repeats).
    train : recordings to fit.
    test : recordings to judge by; without any, blocks of the training recordings are held out.
    controller : of the closed loop behind the recordings; where nothing repeats, the simulated
        loop gives the instruments.
    most : effects that are added at most; None for `SearchCriteria.most_effects`.
    criteria : the numbers that decide the answer, see `dynident.criteria`.
    tell : told what is being done, for a progress display.

    Raises
    ------
    RecordingError
        If a recording is too short, or does not repeat with its period.
    """
    given = model.model if isinstance(model, Estimate) else model
    if most is None:
        per_joint = criteria.search.most_effects_per_joint * given.robot.n
        most = max(criteria.search.most_effects, per_joint)
    train, *others = numbered(train, *([] if test is None else [test]))
    test = others[0] if others else None
    progress("reading the motion")
    loop = motion_of_loop(given, train, controller, progress, criteria)
    runs = loop.runs or gather(train, criteria.noise)
    evidence = Evidence(given, runs, criteria, _candidates(given))
    held = None
    if test is not None and len(test):
        held = Evidence(given, gather(test, criteria.noise), criteria)
    progress("evaluating every effect")
    start = with_friction_width(evidence, shaped(evidence, given))
    progress("looking for contacts")
    contacts = Contacts.find(evidence, held, start)
    evidence, held = contacts.left_out(evidence), contacts.left_out_of_test(held)
    if contacts.pulses:
        start = with_friction_width(evidence, shaped(evidence, given))
    grown = _Growth(train, start, most, progress).run(evidence, loop)
    evidence, fitted, found, rounds = grown.evidence, grown.fitted, grown.found, grown.rounds
    if held is not None:
        held = with_payload_decided(held, fitted)
    kept = without_superfluous(evidence, held, fitted, found, progress)
    if len(kept.found) < len(found):
        rounds.append(rank(evidence, kept.final, len(kept.found), progress))
    sure = contacts.confirmed(evidence, held, kept.final)
    evidence, held = sure.left_out(evidence), sure.left_out_of_test(held)
    if sure.pulses != contacts.pulses:
        start = fit_evidence(evidence, start.model, start)
        kept = replace(kept, final=fit_evidence(evidence, kept.final.model, kept.final))
    disturbances = sure.disturbances(evidence, held, start)
    notes = grown.loop.notes
    search = Search(
        evidence, start, kept.final, tuple(kept.found), tuple(rounds), disturbances, notes
    )
    return told(search, train, test, held)


def _candidates(given: Model) -> tuple[Effect, ...]:
    """Every variant of every effect that is asked about in each round."""
    return tuple(v for effect in candidates(given) for v in effect.variants(given.robot))


@dataclass(frozen=True)
class _Grown:
    """A model with the effects that were added, and the ranking of each round.

    Attributes
    ----------
    evidence : with the payload where it was found to be, and the latest simulated motion.
    loop : behind that motion.
    """

    evidence: Evidence
    loop: SimulatedMotion
    fitted: EvidenceFit
    found: list[Found]
    rounds: list[Ranking]

    @property
    def asked(self) -> RankedModel:
        return RankedModel(self.fitted, self.rounds[-1])


@dataclass(frozen=True)
class _Growth:
    """The addition of effects; see `diagnose`."""

    train: Dataset
    start: EvidenceFit
    most: int
    progress: Callable[[str], None]

    def run(self, evidence: Evidence, loop: SimulatedMotion) -> _Grown:
        """Grow a model from the first one, and again if a global search finds what was missed."""
        first = rank(evidence, self.start, 0, self.progress)
        nothing = _Grown(evidence, loop, self.start, [], [first])
        grown = self.grown(nothing)
        if not self.most or loop.runs:
            return grown  # simulated motions are renewed as the model grows: there is no way back
        again = global_search(grown.evidence, nothing.asked, grown.asked, self.progress)
        if again is None:
            return grown
        base = grown
        if again.fitted is not grown.fitted:
            # What was kept of a first look belongs to the other branch.
            base = replace(nothing, evidence=evidence.looked_at_anew())
        other = self.grown(replace(base, rounds=[*base.rounds[:-1], again.ranking]))
        return other if other.fitted.misfit(self.start) < grown.fitted.misfit(self.start) else grown

    def grown(self, one: _Grown) -> _Grown:
        """Add the best effect and ask again, until nothing is material any more."""
        evidence, loop, fitted = one.evidence, one.loop, one.fitted
        found, rounds = list(one.found), list(one.rounds)
        while len(found) < self.most and not _resolved(evidence, fitted, self.train):
            chosen = choose(evidence, fitted, rounds[-1])
            if chosen is None:
                break
            self.progress(f"adding {chosen.score.effect.label}")
            evidence = with_payload(evidence, chosen.score)
            wider = with_friction_width(
                evidence, refitted(evidence, fitted.model + chosen.score.effect, fitted)
            )
            if breaks_its_promise(fitted, wider, chosen.score):
                break
            found.append(chosen)
            fitted = wider
            if _has_changed(evidence, self.start, fitted):
                evidence = evidence.looked_at_anew()
            loop, moved = loop.renewed(evidence, fitted)
            if moved is not evidence:
                evidence = moved
                fitted = with_friction_width(evidence, refitted(evidence, fitted.model, fitted))
            rounds.append(rank(evidence, fitted, len(found), self.progress))
            found[-1] = alternatives_only(chosen, rounds[-1])
        return _Grown(evidence, loop, fitted, found, rounds)


def _has_changed(evidence: Evidence, start: EvidenceFit, fitted: EvidenceFit) -> bool:
    """Whether effects have changed the predicted torque enough to look at candidates again."""
    before, now = (on_recordings(evidence, one) for one in (start, fitted))
    return now.error < before.error - evidence.criteria.search.another_model


def _resolved(evidence: Evidence, fitted: EvidenceFit, train: Dataset) -> bool:
    """Whether what is left is what the processing cannot resolve, or what encoders' steps leave."""
    judged = on_recordings(evidence, fitted)
    small = np.all(judged.residual_rms <= evidence.criteria.verdict.resolution * judged.torque_rms)
    return bool(small) or nothing_but_rounding(judged, fitted, train)
