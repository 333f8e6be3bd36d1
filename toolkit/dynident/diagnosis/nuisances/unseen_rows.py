"""Effects that act where rows do not count: what is found of them is read off a remainder."""

from __future__ import annotations

import numpy as np

from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit
from dynident.tables import percent


def unseen_notes(
    evidence: Evidence, fitted: EvidenceFit, labels: tuple[str, ...]
) -> tuple[str, ...]:
    """Say of which effects the rows that count hold only a small part of the largest torque.

    Parameters
    ----------
    evidence : of the training recordings.
    fitted : the final model.
    labels : of effects that were added.

    Returns
    -------
    A sentence for each of these effects.
    """
    most, found = evidence.criteria.sticking.least_seen, []
    for effect in fitted.model.effects:
        if effect.label not in labels:
            continue
        share = _share_seen(evidence, fitted, effect.label)
        if share < most:
            found.append(
                f"{effect.title} acts where rows do not count: those that do hold at most "
                f"{percent(share, 0)} of its largest torque. Its values are extrapolated from "
                "there, and another effect may do the same."
            )
    return tuple(found)


def _share_seen(evidence: Evidence, fitted: EvidenceFit, label: str) -> float:
    """Largest torque of an effect in rows that count, over that in all rows."""
    effect = fitted.model.effect(label)
    values = fitted.values[fitted.model.slices[label]]
    joints, counted, every = list(effect.acting_at(fitted.model.robot)), 0.0, 0.0
    for number, run in enumerate(evidence.runs):
        count = run.certain_rows[:, joints]
        for columns in evidence.of(effect, number, fitted.model, fitted.values):
            torque = np.abs(columns @ values)
            counted = max(counted, float(torque[count].max(initial=0.0)))
            every = max(every, float(torque.max(initial=0.0)))
    return counted / every if every > 0 else 1.0
