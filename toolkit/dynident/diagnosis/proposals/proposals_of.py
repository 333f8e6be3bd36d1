"""What is proposed: laws beside what the catalogue has added, or one in the place of that.

A wrong effect that resembles a law hides it: what is left beside that effect is another law, or
none. So laws are also sought for the model as given, and for the one without the last effect. One
that alone does what the catalogue's effects and the laws beside them do, with fewer parameters,
is proposed instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

from dynident.diagnosis.proposals.law_search import FoundLaw, LawSearch
from dynident.diagnosis.proposals.proposal import Proposal
from dynident.diagnosis.search.cross_validation import left_out_losses, signed_rank
from dynident.diagnosis.search.path import Path
from dynident.diagnosis.verdict import within_noise
from dynident.effects import Effect
from dynident.evidence.evidence_fit import EvidenceFit, in_metric_of
from dynident.evidence.held_out import HeldOut


def proposals_of(search: LawSearch, path: Path) -> tuple[Proposal, ...]:
    """Return laws for what the catalogue leaves, one after the other.

    Parameters
    ----------
    search : what is searched.
    path : the models from the given one to that with all that the catalogue has for it.
    """
    beside = tuple(search.found(path.final))
    for shorter in _shorter(search, path):
        laws = search.found(shorter.fitted)
        first = next(laws, None)
        if first is not None and shorter.loses_nothing(first, beside):
            instead = tuple(one.label for one in shorter.left_out)
            return _told(tuple(chain([first], laws)), instead)
    return _told(beside, ())


def _told(found: Sequence[FoundLaw], instead: tuple[str, ...]) -> tuple[Proposal, ...]:
    """Proposals as they are told; several terms can follow any law, as a series does."""
    alone = len(found) == 1
    return tuple(
        replace(
            one.proposal,
            is_explanation=one.proposal.is_explanation and alone,
            instead_of=instead,
        )
        for one in found
    )


@dataclass(frozen=True, kw_only=True)
class _Shorter:
    """A model without effects that the catalogue has added.

    Attributes
    ----------
    search : what is searched.
    path : of the catalogue.
    fitted, judged : the model without them, and its held-out error.
    left_out : these effects.
    """

    search: LawSearch
    path: Path
    fitted: EvidenceFit
    judged: HeldOut
    left_out: tuple[Effect, ...]

    def loses_nothing(self, law: FoundLaw, beside: Sequence[FoundLaw]) -> bool:
        """Whether a law does here what the effects left out do with the laws beside them.

        It must explain what this model leaves, with fewer parameters, lower the catalogue's
        held-out error clearly, and keep that of both; and on blocks of training data that are
        held out in turn nothing may speak for both.
        """
        criteria, proposal = self.search.evidence.criteria.proposals, law.proposal
        both = beside[-1].fitted if beside else self.path.final
        many = sum(_size(one, both) for one in self.left_out)
        many += sum(_size(one.proposal.effect, both) for one in beside)
        if proposal.explains < criteria.explains or _size(proposal.effect, law.fitted) >= many:
            return False
        catalogue = self.path.judged[-1]
        floor = (catalogue.floor or 0.0) ** 2
        given, alone = self.judged.error**2, proposal.test_error_after**2
        least = beside[-1].proposal.test_error_after ** 2 if beside else catalogue.error**2
        if alone - floor > criteria.replacing_left * (catalogue.error**2 - floor):
            return False
        if given - alone < criteria.replacing_share * (given - least):
            return False
        in_one_metric = in_metric_of(self.search.evidence, law.fitted, both)
        losses = left_out_losses(in_one_metric), left_out_losses(both)
        return signed_rank(*losses) >= criteria.rival_level


def _shorter(search: LawSearch, path: Path) -> Iterator[_Shorter]:
    """The model as given, and the one without the last effect, if the catalogue leaves anything."""
    last, steps = path.judged[-1], len(path.found)
    if last.least_ratio is not None and within_noise(last, search.evidence.criteria.verdict):
        return
    added = [one.score.effect.label for one in path.found]
    for many in dict.fromkeys((0, steps - 1)) if steps else ():
        yield _Shorter(
            search=search,
            path=path,
            fitted=path.stages[many],
            judged=path.judged[many],
            left_out=tuple(e for e in path.final.model.effects if e.label in added[many:]),
        )


def _size(effect: Effect, fitted: EvidenceFit) -> int:
    """Parameters of an effect, shapes included."""
    robot = fitted.model.robot
    return len(effect.parameters(robot)) + len(effect.shape_parameters(robot))
