"""Two joints that load each other: what the study says of it, and whether they do so alike."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import permutations

import numpy as np
from scipy.special import chdtrc

from dynident.diagnosis.result import Diagnosis
from dynident.errors import RecordingError
from dynident.recording import Recording
from dynident.recording.formats.column_expressions import parse
from dynident.tables import listed, number
from dynident.tables import p_value as p_value_words

_SURE = 3.0
"""Standard deviations that a value has at least, to be named."""
_LEAST = 0.05
"""Probability below which two couplings are not called alike."""


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
        sure = _sure(x, estimate.sigma[there]) & _sure(y, estimate.sigma[here])
        signs = set(np.sign([*x[sure], *y[sure]]))
        p_value = _same(x - y, estimate.covariance, there, here)
        if len(signs) != 1 or not p_value > _LEAST:
            continue
        parameters = one.parameters(model.robot)
        each = [
            f"{parameters[k].name} {number(x[k], 3)} and {number(y[k], 3)} {parameters[k].unit}"
            for k in np.flatnonzero(sure)
        ]
        turns = "sum" if signs == {1.0} else "difference"
        notes.append(
            f"{joint} and {source} load each other alike: {listed(each)}; equal parameters are not "
            f"rejected (Wald test of all, p = {p_value_words(p_value)}). A part of the drive that "
            f"turns with the {turns} of both does so, as in a wrist whose gears couple it."
        )
    return tuple(notes)


def _sure(values: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    return (sigma > 0.0) & (np.abs(values) > _SURE * sigma)


def _same(difference: np.ndarray, C: np.ndarray, there: slice, here: slice) -> float:
    """How probable it is that equal parameters are estimated so far apart: a Wald test."""
    of_it = C[there, there] + C[here, here] - C[there, here] - C[here, there]
    size = np.sqrt(np.diag(of_it))
    if not np.all(size > 0.0):
        return 0.0  # one of them is not known on its own
    scaled = of_it / np.outer(size, size)
    d = difference / size
    return float(chdtrc(len(d), d @ np.linalg.lstsq(scaled, d, rcond=None)[0]))
