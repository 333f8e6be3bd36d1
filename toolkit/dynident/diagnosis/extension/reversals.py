"""A stage of the diagnosis without the reversals at which dry friction may follow another law."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from dynident.diagnosis.extension.stage import Stage
from dynident.diagnosis.nuisances.friction_width import with_friction_width
from dynident.diagnosis.nuisances.reversal_laws import ReversalLaw
from dynident.diagnosis.nuisances.sticking import every_row_is_asked_for, without_reversals
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence


def without_their_reversals(stage: Stage, laws: Sequence[ReversalLaw], effect: str) -> Stage:
    """Leave out the reversals of joints whose dry friction may follow another law.

    Parameters
    ----------
    stage : the model as far as it is extended.
    laws : which; those of joints where that was done before do not count, nor those that lag: they
        have a memory, which is physics that the model lacks.
    effect : label of what would be missing else; empty where nothing of the catalogue would.

    Returns
    -------
    Its last ranking is gone. The same stage where the recordings would hold too little, or the
    study asks for every row.
    """
    if every_row_is_asked_for(stage.evidence):
        return stage
    new = [law for law in laws if law.joint not in stage.doubtful and not law.lags]
    within = {law.joint: law.within for law in new}
    fewer = _fewer(stage.evidence, within)
    within = {joint: within[joint] for joint in fewer}
    if not within:
        return stage
    said = as_much([law for law in new if law.joint in within], effect)
    gone = left_out(stage, within)
    return replace(gone, rounds=stage.rounds[:-1], notes=(*stage.notes, f"{said}."))


def left_out(stage: Stage, within: Mapping[str, float]) -> Stage:
    """Return a stage without the rows around some reversals, its models fitted anew.

    Parameters
    ----------
    stage : with its rankings, which are not made anew.
    within : rad/s or m/s for joints, speed within which rows are left out.
    """
    joints = tuple(within)
    evidence = without_reversals(stage.evidence, joints, within)
    start = fit_evidence(evidence, stage.start.model, stage.start)
    fitted = fit_evidence(evidence, stage.fitted.model, stage.fitted)
    return replace(
        stage,
        evidence=evidence,
        held=stage.held and without_reversals(stage.held, joints, within),
        start=with_friction_width(evidence, start),
        fitted=with_friction_width(evidence, fitted),
        doubtful={**stage.doubtful, **within},
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
        doubt = f"{effect} cannot be told from another law of dry friction"
        return f"{doubt}: {where} {explain} as much"
    return (
        f"Dry friction may follow another law than the model's: {where} {explain} a part of what "
        "no effect does"
    )


def _fewer(evidence: Evidence, within: Mapping[str, float]) -> list[str]:
    """Joints of which leaving out these reversals takes rows."""
    less = without_reversals(evidence, tuple(within), within)
    lost = np.flatnonzero(_certain(less) < _certain(evidence))
    return [evidence.model.robot.names[j] for j in lost]


def _certain(evidence: Evidence) -> np.ndarray:
    """Rows that count, of each joint, (n,)."""
    return np.sum([run.certain_rows.sum(axis=0) for run in evidence.runs], axis=0)
