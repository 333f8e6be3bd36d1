"""What candidates would take off the held-out error, each added alone.

The same error, on the same rows, as that of the steps: a search weights each joint by its noise,
so that its own figures are shares of another sum.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from types import MappingProxyType

from dynident.diagnosis.search.payload_recordings import with_payload, with_payload_decided
from dynident.diagnosis.search.ranking import Ranking
from dynident.diagnosis.search.scores.score import Score
from dynident.errors import FitError
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.held_out import on_held_out


def candidate_gains(
    ranking: Ranking,
    evidence: Evidence,
    held: Evidence | None,
    fitted: EvidenceFit,
    error: float,
    first: int,
    *,
    known: Mapping[str, float] = MappingProxyType({}),
) -> dict[str, float]:
    """Return by how much the held-out error falls with each of the best candidates.

    Everything is fitted anew with the candidate at the shape that the search found for it, where
    only columns that depend on the values have the noise measured anew more than once; the widths
    of dry friction stay. Nothing is chosen by these figures.

    Parameters
    ----------
    ranking : of the candidates.
    evidence, held : training and test recordings; without the latter blocks of time are held out.
    fitted : the model without any of them.
    error : its held-out torque error, relative.
    first : so many of the ranking are tried at any rate, beside those that were cross-validated:
        each is a fit more.
    known : falls that were found before, of the same ranking and fit.

    Returns
    -------
    Falls of that error by label; of none that this data cannot tell, whose fit does not settle, or
    whose response would cost a search of its own.
    """
    told = [one for one in ranking.scores if one.rank and not one.not_identifiable]
    asked = {one.effect.label: one for one in told[:first]}
    asked |= {one.effect.label: one for one in told if one.gains is not None}
    found = {}
    for label, one in asked.items():
        if one.effect.is_dynamic_response and one.gains is None:
            continue
        if label in known:
            found[label] = known[label]
            continue
        with suppress(FitError):  # it cannot be fitted with the model: nothing is known of it
            found[label] = error - _error_with(one, evidence, held, fitted)
    return found


def _error_with(
    one: Score, evidence: Evidence, held: Evidence | None, fitted: EvidenceFit
) -> float:
    """The held-out error with a candidate; FitError where it cannot be fitted with the model."""
    carrying = with_payload(evidence, one)
    wider = fit_evidence(carrying, fitted.model + one.effect, fitted, noise_rounds=1)
    if not wider.settled:
        raise FitError("columns and values do not agree", one.effect.label)
    decided = None if held is None else with_payload_decided(held, wider)
    return on_held_out(carrying, decided, wider).error
