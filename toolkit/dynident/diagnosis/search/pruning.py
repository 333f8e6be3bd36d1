"""Effects that were added and turn out not to be needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dynident.diagnosis.assembly import Found
from dynident.diagnosis.search.ranking import rank
from dynident.effects import Effect
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.held_out import on_recordings


@dataclass(frozen=True)
class Kept:
    """What is left when superfluous effects are dropped."""

    final: EvidenceFit
    found: list[Found]


def without_superfluous(
    evidence: Evidence,
    held: Evidence | None,
    fitted: EvidenceFit,
    found: list[Found],
    progress: Callable[[str], None],
) -> Kept:
    """Drop every added effect that the others have made superfluous, or that helps nowhere else."""
    kept = list(found)
    for one in found:
        if _belongs(one.score.effect, kept):
            continue
        effect = next(e for e in fitted.model.effects if e.label == one.score.effect.label)
        rest = fit_evidence(evidence, fitted.model - effect, fitted)
        progress(f"doing without {effect.label}")
        needed = len(kept) == 1 or rank(evidence, rest, len(kept) - 1, only=(effect,)).material
        if not needed or not _helps(held, rest, fitted):
            kept.remove(one)
            fitted = rest
    return Kept(fitted, kept)


def _helps(held: Evidence | None, without: EvidenceFit, fitted: EvidenceFit) -> bool:
    """Whether an effect lowers the residual of the test recordings at any joint.

    The whole of it, or what of it repeats: columns that carry noise may take the latter away and
    add to the former.
    """
    if held is None:
        return True  # its gain was cross-validated
    before, after = (on_recordings(held, one) for one in (without, fitted))
    falls = [before.residual_rms**2 - after.residual_rms**2]
    scale = after.residual_rms
    if after.noise_std is not None and after.ratio is not None:
        assert before.noise_std is not None and before.ratio is not None
        scale = before.noise_std
        falls.append((before.ratio * before.noise_std) ** 2 - (after.ratio * after.noise_std) ** 2)
    return any(bool(np.any(fall > held.criteria.search.least_fall * scale**2)) for fall in falls)


def _belongs(effect: Effect, found: list[Found]) -> bool:
    """Whether an effect is part of another one: without it the other would bring it back."""
    others = (one.score.effect for one in found)
    return any(effect.name in o.contains and effect.joint == o.joint for o in others)
