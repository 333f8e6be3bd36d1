"""Which of the effects that a diagnosis added a further motion may tell from others."""

from __future__ import annotations

from dynident.diagnosis.result import Diagnosis
from dynident.effects import Effect


def open_groups(diagnosis: Diagnosis) -> tuple[tuple[Effect, ...], ...]:
    """Return each effect that was added with those that explain the recordings as well.

    Only such as the design of a recording knows: whose torque is a function of an instant.

    Parameters
    ----------
    diagnosis : of the recordings so far.
    """
    added = {step.effect.label for step in diagnosis.steps}
    found = []
    for step in diagnosis.steps:
        rivals = tuple(
            one for one in step.indistinguishable if one.label not in added and one.is_of_an_instant
        )
        if rivals and step.effect.is_of_an_instant:
            found.append((step.effect, *rivals))
    return tuple(found)
