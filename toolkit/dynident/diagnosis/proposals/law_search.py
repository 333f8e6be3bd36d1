"""The search for laws: screen, confirm, sharpen, refit, compare with rivals; then the next one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count, islice

import numpy as np

from dynident.criteria import ProposalCriteria
from dynident.diagnosis.nuisances.friction_width import with_friction_width
from dynident.diagnosis.proposals.law_changes import change_p_value
from dynident.diagnosis.proposals.proposal import LawPicture, Proposal
from dynident.diagnosis.proposals.term_library import (
    LibraryTerm,
    centred,
    extended,
    library,
    pairs_within,
)
from dynident.diagnosis.proposals.term_screen import Screened, screen
from dynident.diagnosis.search.cross_validation import signed_rank
from dynident.diagnosis.search.path import judged_on
from dynident.diagnosis.search.ranking import judged
from dynident.diagnosis.search.scores.candidate_moments import candidate_moments
from dynident.diagnosis.search.scores.score import Score
from dynident.diagnosis.search.scores.scoring import score
from dynident.diagnosis.search.shaped_fit import refitted
from dynident.diagnosis.verdict import within_noise
from dynident.effects import Effect, LawEffect, law_effect
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_estimate import estimate_of
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence, in_metric_of
from dynident.evidence.held_out import HeldOut
from dynident.recording import Dataset
from dynident.tables import number

_SAME_SHAPE = 0.1
_AT_BOUND = 1e-3
_CHANGES = "What it leaves still changes with the same signals: another form of it would do better."
_CLASS = 10  # rows of a class in the picture, at least


@dataclass(frozen=True, kw_only=True)
class LawSearch:
    """What is searched.

    Attributes
    ----------
    evidence : of the training recordings.
    held : of the test recordings; None where blocks of time are held out.
    train : the training recordings.
    progress : is called with what is being done.
    """

    evidence: Evidence
    held: Evidence | None
    train: Dataset
    progress: Callable[[str], None] = lambda _: None

    def found(self, fitted: EvidenceFit) -> Iterator[FoundLaw]:
        """Yield laws for what a model leaves, each beside those before it.

        Parameters
        ----------
        fitted : the model to which they are added.
        """
        before = self._judged(fitted)
        known = {law.name for law in fitted.model.laws}
        names = (f"proposal{k}" for k in count(1))
        free = (name for name in names if name not in known)
        for name in islice(free, self.evidence.criteria.proposals.most):
            starts = list(self._from(fitted))
            every = (self._best(one, before, name, len(starts)) for one in starts)
            tried = [best for best in every if best is not None]
            if not tried:
                return
            best = min(tried, key=lambda one: one.wider.misfit(fitted))
            wider = best.wider
            after = self._judged(wider)
            proposal = self._proposal(best, (fitted, wider), (before, after))
            if proposal is None:
                return
            yield FoundLaw(proposal=proposal, fitted=wider)
            fitted, before = wider, after

    # --- one law ------------------------------------------------------------------------------

    def _best(
        self, fitted: EvidenceFit, before: HeldOut, name: str, searches: int
    ) -> _BestLaws | None:
        """Return the best law, confirmed, in the metric that it makes itself.

        Parameters
        ----------
        fitted, before : the model to which it is added, and what that leaves.
        name : of the law.
        searches : of which this is one: each tries as many terms.
        """
        criteria = self.evidence.criteria.proposals
        joints = self._joints(fitted, before)
        terms = {j: self._terms(fitted, before, j) for j in joints}
        metric: EvidenceFit = fitted
        best: _BestLaws | None = None
        for _ in range(criteria.rounds):
            looked_at, tried = self._looked_at(metric, terms)
            if best is not None:  # in this metric, too, with the shapes that it has by now
                looked_at = [best.term, *looked_at]
            tried *= searches
            passing = tuple(self._confirmed(metric, looked_at, tried, name))
            if not passing:
                break
            first = passing[0].effect
            # The refit seeks its shapes anew: from near ones it makes the same fit again.
            if best is not None and _alike(first, best.effect):
                return replace(best, scores=passing, tried=tried)
            wider = self._with(first, fitted)
            term = _of(first, looked_at, fitted.model.robot.names)
            best = _BestLaws(scores=passing, tried=tried, wider=wider, term=term)
            metric = in_metric_of(self.evidence, fitted, wider)
        return best

    def _with(self, law: Effect, fitted: EvidenceFit) -> EvidenceFit:
        """Return the model with a law more, all of it fitted anew, friction widths too."""
        wider = refitted(self.evidence, fitted.model + law, fitted)
        return with_friction_width(self.evidence, wider)

    def _from(self, fitted: EvidenceFit) -> Iterator[EvidenceFit]:
        """Yield fits from which a law is sought.

        What a law does at low speeds may have made dry friction look wider than the study says, and
        hides behind that: it is sought from there, and from the stated widths.
        """
        yield fitted
        stated, found = self.evidence.model.friction_widths, fitted.model.friction_widths
        if np.any(found > stated):
            widths = tuple(np.minimum(stated, found).tolist())
            yield fit_evidence(self.evidence, replace(fitted.model, friction_width=widths), fitted)

    def _joints(self, fitted: EvidenceFit, before: HeldOut) -> list[int]:
        """Joints at which something is left that is worth a law."""
        n = fitted.model.robot.n
        if before.least_ratio is None:
            return list(range(n))
        verdict = self.evidence.criteria.verdict
        return [j for j in range(n) if before.least_ratio[j] > verdict.within_noise]

    def _terms(self, fitted: EvidenceFit, before: HeldOut, joint: int) -> tuple[LibraryTerm, ...]:
        """The library at one joint, as far as its signals mean something."""
        robot = fitted.model.robot
        criteria = self.evidence.criteria.proposals
        slowest = criteria.least_decay * float(np.max(fitted.model.friction_widths))
        terms = library(robot, robot.names[joint], slowest)
        if before.joint_errors[joint] > criteria.trusted_load:
            terms = tuple(one for one in terms if not one.of_load)
        return terms

    def _looked_at(
        self, metric: EvidenceFit, terms: dict[int, tuple[LibraryTerm, ...]]
    ) -> tuple[list[tuple[int, LibraryTerm]], int]:
        """The terms that are evaluated as effects are, the best of the screening; of how many."""
        found: list[tuple[int, Screened]] = []
        criteria, tried = self.evidence.criteria.proposals, 0
        for joint, some in terms.items():
            self.progress(f"laws at {metric.model.robot.names[joint]}")
            repeating = [one for one in some if not one.of_session]
            kept = screen(self.evidence, metric, joint, repeating)
            wider, more = self._of_three(metric, joint, some, kept)
            tried += len(some) + more
            found += [(joint, one) for one in (*kept, *wider)]
        found.sort(key=lambda one: -one[1].penalised)
        every = [(joint, one.term) for joint, one in _best_start(found)]
        session = [(j, one) for j, some in terms.items() for one in some if one.of_session]
        # Two waves are like much else, and would leave no place for what is simpler.
        double = [one for one in every if one[1].waves > 1]
        others = [one for one in every if one[1].waves <= 1]
        best = [*others[: criteria.contenders], *double[: criteria.double_waves]]
        return best + session, tried

    def _of_three(
        self,
        metric: EvidenceFit,
        joint: int,
        some: Sequence[LibraryTerm],
        kept: Sequence[Screened],
    ) -> tuple[list[Screened], int]:
        """Products of three factors, the best first, and how many were tried.

        Whatever a product of three is, some product of two of them is like it; but not always one
        of the right two. So the best are exchanged a factor at a time, until none does better. What
        is counted are the terms that were tried, of all that might have been.
        """
        criteria = self.evidence.criteria.proposals
        factors = [one.factors[0] for one in some if len(one.factors) == 1]
        seeds = [one.term for one in kept[: criteria.seeds]]
        found: list[Screened] = []
        tried: set[LibraryTerm] = set()
        while new := [one for one in extended(seeds, factors) if one not in tried]:
            before = found[0].penalised if found else 0.0
            beside = len(some) + len(tried)
            found += screen(self.evidence, metric, joint, new, beside=beside)
            found.sort(key=lambda one: -one.penalised)
            tried.update(new)
            if not found or found[0].penalised <= before:
                break
            seeds = pairs_within([one.term for one in found[: criteria.exchanged]])
        return found, len(tried)

    def _confirmed(
        self,
        metric: EvidenceFit,
        looked_at: Sequence[tuple[int, LibraryTerm]],
        tried: int,
        name: str,
    ) -> list[Score]:
        """Laws that pass the gates of the search, best first."""
        robot, criteria = metric.model.robot, self.evidence.criteria.proposals
        passing: list[Score] = []
        for joint, term in looked_at:
            effect = law_effect(term.law(name))(robot.names[joint], shape=term.start).on(robot)
            (parts,) = candidate_moments(self.evidence, metric, [effect])
            first = score(metric, effect, *parts, grid=tried)
            if first.not_identifiable or first.p_value * tried >= criteria.level:
                continue
            self.progress(f"{effect.made_of.torque} at {effect.joint}")
            one, refusal = judged(self.evidence, metric, first, tried)
            if not refusal and one.p_value * tried < criteria.level:
                price = criteria.factor_price * term.price
                passing.append(replace(one, penalised=one.penalised - price))
        passing.sort(key=lambda one: -one.penalised)
        return _simplest_first(_each_once(passing), criteria)

    def _proposal(
        self,
        best: _BestLaws,
        fits: tuple[EvidenceFit, EvidenceFit],
        errors: tuple[HeldOut, HeldOut],
    ) -> Proposal | None:
        """Return the law with what it does; None where it does not help on held-out data."""
        (fitted, wider), (before, after) = fits, errors
        criteria = self.evidence.criteria.proposals
        missed = fitted.misfit(fitted)
        explains = 1.0 - wider.misfit(fitted) / missed if missed > 0 else 0.0
        if after.error >= before.error or explains < criteria.least_share:
            return None
        label = best.effect.label
        effect = wider.model.effect(label)
        assert isinstance(effect, LawEffect)
        own = wider.model.slices[label]
        estimate = estimate_of(self.evidence, wider, self.train)
        shapes = {one.name: one.sigma for one in estimate.shapes}
        as_it_says = change_p_value(self.evidence, wider, effect) >= criteria.changes_level
        remarks = (_remark(effect), "" if as_it_says else _CHANGES, _other_widths(fitted, wider))
        enough = explains >= criteria.explains and as_it_says
        return Proposal(
            effect=_recentred(effect),
            values=tuple(wider.values[own].tolist()),
            sigma=tuple(estimate.sigma[own].tolist()),
            shape_sigma=tuple(shapes[name] for name in wider.model.shape_names[label]),
            explains=float(explains),
            is_explanation=enough and self._nothing_left(after),
            p_value=min(1.0, best.scores[0].p_value * best.tried),
            tried=best.tried,
            test_error_before=before.error,
            test_error_after=after.error,
            noise_floor=after.floor,
            rivals=best.rivals(criteria),
            remark=" ".join(filter(None, remarks)),
            picture=_picture(before, after, fitted, str(effect.joint)),
        )

    def _nothing_left(self, after: HeldOut) -> bool:
        """Whether nothing but noise remains, as far as it is known."""
        return after.least_ratio is None or within_noise(after, self.evidence.criteria.verdict)

    def _judged(self, fitted: EvidenceFit) -> HeldOut:
        return judged_on(self.evidence, self.held, fitted)


@dataclass(frozen=True, kw_only=True)
class FoundLaw:
    """A law that is proposed, and the fit of the model with it and those before it."""

    proposal: Proposal
    fitted: EvidenceFit


@dataclass(frozen=True, kw_only=True)
class _BestLaws:
    """The laws that pass, best first, all in one metric.

    Attributes
    ----------
    scores : of them.
    tried : terms behind them.
    wider : fit of the model with the best of them.
    term : of the best of them, with the joint's column, beginning at the shapes that it has.
    """

    scores: tuple[Score, ...]
    tried: int
    wider: EvidenceFit
    term: tuple[int, LibraryTerm]

    @property
    def effect(self) -> LawEffect:
        """The best of them."""
        effect = self.scores[0].effect
        assert isinstance(effect, LawEffect)
        return effect

    def rivals(self, criteria: ProposalCriteria) -> tuple[LawEffect, ...]:
        """Return the others that no signed-rank test over the held-out blocks tells from it."""
        best, *others = self.scores
        found = [one.effect for one in others if _as_good(one, best, criteria)]
        return tuple(one for one in found if isinstance(one, LawEffect))


def _of(
    effect: Effect, looked_at: Sequence[tuple[int, LibraryTerm]], names: Sequence[str]
) -> tuple[int, LibraryTerm]:
    """The term of a law and the joint's column, beginning at the law's shapes."""
    assert isinstance(effect, LawEffect)
    asked = effect.joint, effect.made_of.torque
    joint, term = next((j, one) for j, one in looked_at if (names[j], one.torque) == asked)
    return joint, term.beginning_at(effect.shape)


def _recentred(effect: LawEffect) -> LawEffect:
    """The law with its frequencies' ranges about what was found, as others will seek them."""
    law = effect.made_of
    ranges = tuple(
        (name, *centred(name, value, (lower, upper)))
        for (name, lower, upper), value in zip(law.shape, effect.shape, strict=True)
    )
    return law_effect(replace(law, shape=ranges))(effect.joint, shape=effect.shape)


def _remark(effect: LawEffect) -> str:
    """Which shape is at the end of its range, in words."""
    for (name, lower, upper), value in zip(effect.made_of.shape, effect.shape, strict=True):
        if min(value - lower, upper - value) <= _AT_BOUND * (upper - lower):
            return f"Its {name} is at the end of what was sought: it may lie beyond."
    return ""


def _other_widths(fitted: EvidenceFit, wider: EvidenceFit) -> str:
    """Which friction widths the model with a law has, and had not without it, in words."""
    robot, pairs = fitted.model.robot, (fitted.model.friction_widths, wider.model.friction_widths)
    changed = [
        f"{number(new, 2)} {unit}/s at {joint} in place of {number(old, 2)}"
        for joint, unit, old, new in zip(robot.names, robot.units, *pairs, strict=True)
        if new != old
    ]
    return f"With it dry friction reverses over {', '.join(changed)}." if changed else ""


def _best_start(found: Sequence[tuple[int, Screened]]) -> list[tuple[int, Screened]]:
    """Of each law at each joint that with the first start of its shapes, in their order."""
    best: dict[tuple[int, str], tuple[int, Screened]] = {}
    for joint, one in found:
        best.setdefault((joint, one.term.torque), (joint, one))
    return list(best.values())


def _each_once(scores: Sequence[Score]) -> list[Score]:
    """Scores without those of a law that is better with another start of its shapes."""
    kept: list[Score] = []
    for one in scores:
        assert isinstance(one.effect, LawEffect)
        if not any(_alike(one.effect, other.effect) for other in kept):
            kept.append(one)
    return kept


def _simplest_first(scores: list[Score], criteria: ProposalCriteria) -> list[Score]:
    """Scores with the simplest of those first that nothing tells from the best.

    A wave of a low frequency is a constant, or a line: beside another law it is as good as none.
    """
    if not scores:
        return scores
    best, least = scores[0], (1.0 - criteria.simpler) * scores[0].penalised
    alike = [one for one in scores if one.penalised >= least and _as_good(one, best, criteria)]
    first = min(alike, key=_parameters, default=best)
    return [first, *(one for one in scores if one is not first)]


def _as_good(one: Score, best: Score, criteria: ProposalCriteria) -> bool:
    """Whether no signed-rank test over the held-out blocks tells a law from the best."""
    assert best.losses is not None and one.losses is not None
    return signed_rank(one.losses, best.losses) >= criteria.rival_level


def _parameters(score: Score) -> int:
    """Of a law: coefficients and shapes."""
    assert isinstance(score.effect, LawEffect)
    law = score.effect.made_of
    return len(law.linear) + len(law.shape)


def _alike(one: Effect, other: Effect) -> bool:
    """Whether two laws are one at one joint, with shapes that hardly differ."""
    assert isinstance(one, LawEffect)
    assert isinstance(other, LawEffect)
    same = one.joint == other.joint and one.made_of.torque == other.made_of.torque
    return same and bool(np.allclose(one.shape, other.shape, rtol=_SAME_SHAPE))


def _picture(before: HeldOut, after: HeldOut, fitted: EvidenceFit, joint: str) -> LawPicture:
    """What the law changes on held-out data, and what was left there without it."""
    robot = fitted.model.robot
    j = robot.names.index(joint)
    kept = np.concatenate([one.certain[:, j] for one in before.runs])
    law = np.concatenate(
        [
            new.predicted[:, j] - old.predicted[:, j]
            for old, new in zip(before.runs, after.runs, strict=True)
        ]
    )[kept]
    left = np.concatenate([one.measured[:, j] - one.predicted[:, j] for one in before.runs])[kept]
    order = np.argsort(law)
    classes = np.array_split(order, max(1, min(fitted.criteria.maps.bins, len(order) // _CLASS)))
    noise = float("nan") if after.noise_std is None else float(after.noise_std[j])
    spread = 2.0 * noise * np.sqrt(after.inflation[j])
    return LawPicture(
        law=np.array([law[rows].mean() for rows in classes]),
        residual=np.array([left[rows].mean() for rows in classes]),
        band=np.array([spread / np.sqrt(len(rows)) for rows in classes]),
        torque_unit=robot.torque_units[j],
    )
