"""A stage of the diagnosis without the reversals at which dry friction may follow another law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynident.diagnosis.nuisances.friction_width import with_friction_width
from dynident.diagnosis.nuisances.reversal_laws import ReversalLaw
from dynident.diagnosis.nuisances.sticking import without_reversals
from dynident.diagnosis.stage import Stage
from dynident.evidence.columns import Evidence
from dynident.evidence.evidence_fit import fit_evidence


def without_their_reversals(stage: Stage, laws: Sequence[ReversalLaw], effect: str) -> Stage:
    """Leave out the reversals of joints whose dry friction may follow another law.

    Parameters
    ----------
    stage : the model as far as it is extended.
    laws : which; those of joints where that was done before do not count.
    effect : label of what would be missing else; empty where nothing of the catalogue would.

    Returns
    -------
    Its last ranking is gone. The same stage where the recordings would hold too little.
    """
    new = [law for law in laws if law.joint not in stage.doubtful]
    within = {law.joint: law.within for law in new}
    evidence = without_reversals(stage.evidence, tuple(within), within)
    fewer = np.flatnonzero(_certain(evidence) < _certain(stage.evidence))
    names = [stage.evidence.model.robot.names[j] for j in fewer]
    if not names:
        return stage
    start = fit_evidence(evidence, stage.start.model, stage.start)
    fitted = fit_evidence(evidence, stage.fitted.model, stage.fitted)
    note = as_much([law for law in new if law.joint in names], effect)
    return replace(
        stage,
        evidence=evidence,
        held=stage.held and without_reversals(stage.held, tuple(within), within),
        start=with_friction_width(evidence, start),
        fitted=with_friction_width(evidence, fitted),
        rounds=stage.rounds[:-1],
        doubtful=stage.doubtful | set(names),
        notes=(*stage.notes, f"{note}."),
    )


def as_much(laws: Sequence[ReversalLaw], effect: str) -> str:
    """Say what is not known of dry friction, in plain words.

    Parameters
    ----------
    laws : that explain as much as an effect.
    effect : its label; empty where they explain what no effect does.
    """
    where = " and ".join(f"at {law.joint} one that {law.words}" for law in laws)
    explain = "explains" if len(laws) == 1 else "explain"
    if effect:
        return (
            f"{effect} cannot be told from another law of dry friction: {where} {explain} as much"
        )
    return (
        f"dry friction follows another law than the model's: {where} {explain} more; around those "
        "reversals nothing is told"
    )


def _certain(evidence: Evidence) -> np.ndarray:
    """Rows that count, of each joint, (n,)."""
    return np.sum([run.certain_rows.sum(axis=0) for run in evidence.runs], axis=0)
