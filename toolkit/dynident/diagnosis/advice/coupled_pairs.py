"""Two joints that load each other: what the study says of it, and whether they do so alike."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import permutations

import numpy as np

from dynident.diagnosis.result import Diagnosis
from dynident.errors import RecordingError
from dynident.recording import Recording
from dynident.recording.formats.column_expressions import parse
from dynident.tables import listed, number

_ALIKE, _SURE = 2.0, 3.0
"""Standard deviations: by which two values may differ, and which a value has at least."""


def stated_pairs(recordings: Iterable[Recording]) -> set[frozenset[str]]:
    """Pairs of joints of which one's position is made of the motor of the other, too."""
    found = set()
    for one in recordings:
        made = {
            ours.removeprefix("q."): _names(theirs)
            for ours, theirs, _ in one.provenance.columns
            if ours.startswith("q.")
        }
        found |= {
            frozenset((joint, other))
            for joint, other in permutations(made, 2)
            if len(made[other]) == 1 and made[other] < made[joint]
        }
    return found


def _names(theirs: str) -> set[str]:
    """Columns that an expression is made of; a name that is none stands for itself."""
    try:
        return set(parse(theirs).terms)
    except RecordingError:
        return {theirs}


def alike_notes(found: Diagnosis) -> tuple[str, ...]:
    """What is said of couplings that go both ways, and have the same values within their errors."""
    estimate = found.after
    model, notes = estimate.model, []
    added = {(e.joint, e.source): e for e in (step.effect for step in found.steps) if e.source}
    for (joint, source), one in added.items():
        back = added.get((source, joint))
        if back is None or back.name != one.name or str(joint) > str(source):
            continue
        there, here = model.slices[one.label], model.slices[back.label]
        x, y = estimate.values[there], estimate.values[here]
        sigma = estimate.sigma[there], estimate.sigma[here]
        C = estimate.covariance
        cross = np.diag(C[there, here])
        apart = np.sqrt(np.clip(sigma[0] ** 2 + sigma[1] ** 2 - 2 * cross, 0.0, None))
        with np.errstate(invalid="ignore"):
            sure = (np.abs(x) > _SURE * sigma[0]) & (np.abs(y) > _SURE * sigma[1])
            alike = np.abs(x - y) < _ALIKE * apart
        signs = set(np.sign(x[sure]))
        if len(signs) != 1 or not np.all(alike[sure]):
            continue
        parameters = one.parameters(model.robot)
        each = [
            f"{parameters[k].name} {number(x[k], 3)} and {number(y[k], 3)} {parameters[k].unit}"
            for k in np.flatnonzero(sure)
        ]
        turns = "sum" if signs == {1.0} else "difference"
        notes.append(
            f"{joint} and {source} load each other alike: {listed(each)}, no further apart than "
            "twice the standard error of their difference. So does a part of the drive that turns "
            f"with the {turns} of both, as in a wrist whose gears couple it."
        )
    return tuple(notes)
