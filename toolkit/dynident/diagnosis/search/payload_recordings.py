"""Which recordings carry the payload, where the study does not say."""

from __future__ import annotations

import numpy as np

from dynident.diagnosis.search.scoring import Score
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, residuals
from dynident.evidence.runs import flagged_run


def carry(evidence: Evidence, score: Score) -> None:
    """Mark the runs that carry the payload, once that is known."""
    if score.payload_recordings is not None:
        evidence.runs = tuple(
            flagged_run(run, carries)
            for run, carries in zip(evidence.runs, score.payload_recordings, strict=True)
        )


def decide_payload(held: Evidence, fitted: EvidenceFit) -> None:
    """Decide which test recordings carry a payload of known inertia, where the study is silent."""
    if not any("payload" in effect.needs for effect in fitted.model.effects):
        return
    stated = [run.recording.payload is not None for run in held.runs]
    sums = []
    for carries in (False, True):
        held.runs = tuple(
            run if said else flagged_run(run, carries)
            for run, said in zip(held.runs, stated, strict=True)
        )
        misfits = residuals(held, fitted.model, fitted.values)
        sums.append([float(np.sum(e**2)) for e in misfits])
    held.runs = tuple(
        run if said else flagged_run(run, with_load < without)
        for run, said, without, with_load in zip(held.runs, stated, *sums, strict=True)
    )
