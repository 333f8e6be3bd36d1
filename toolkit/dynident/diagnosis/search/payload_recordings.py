"""Which recordings carry the payload, where the study does not say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynident.diagnosis.search.scoring import Score
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, residuals
from dynident.evidence.runs import flagged_run


def with_payload(evidence: Evidence, score: Score) -> Evidence:
    """Return the evidence with the runs marked that carry the payload, once that is known."""
    if score.payload_recordings is None:
        return evidence
    return _flagged(evidence, score.payload_recordings)


def with_payload_decided(held: Evidence, fitted: EvidenceFit) -> Evidence:
    """Decide which test recordings carry a payload of known inertia, where the study is silent."""
    if not any(effect.is_payload for effect in fitted.model.effects):
        return held
    stated = [run.recording.payload for run in held.runs]
    sums = []
    for carries in (False, True):
        every = _flagged(held, [carries if said is None else said for said in stated])
        misfits = residuals(every, fitted.model, fitted.values)
        sums.append([float(np.sum(e**2)) for e in misfits])
    return _flagged(
        held,
        [
            loaded < without if said is None else said
            for said, without, loaded in zip(stated, *sums, strict=True)
        ],
    )


def _flagged(evidence: Evidence, carries: Sequence[bool]) -> Evidence:
    """Return the evidence of the same recordings, with or without the payload on board."""
    return evidence.with_runs(
        tuple(flagged_run(run, own) for run, own in zip(evidence.runs, carries, strict=True))
    )
