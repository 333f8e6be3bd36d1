"""Two joints that load each other: what the study says of it, and whether they do so alike."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

import numpy as np
from scipy.special import chdtrc

from dynident.diagnosis.result import Diagnosis
from dynident.errors import RecordingError
from dynident.recording import Recording
from dynident.recording.formats.column_expressions import parse
from dynident.tables import listed, number
from dynident.tables import p_value as p_value_words

_OF_BOTH = ("cv", "ca")
"""Parameters of a coupling that are equal in both directions where one part turns with both."""
_SURE = 3.0
"""Standard deviations that a value has at least, to be named."""
_LEAST = 0.05
"""Probability below which two couplings differ."""


def stated_pairs(recordings: Iterable[Recording]) -> set[frozenset[str]]:
    """Pairs of joints whose positions are made of one motor, among others.

    A name with a sign in it, as in "motor-left", looks like a difference. It is taken for one where
    it is written as no name is, or holds what another joint is made of alone.
    """
    found = set()
    for one in recordings:
        written = {
            ours.removeprefix("q."): theirs
            for ours, theirs, _ in one.provenance.columns
            if ours.startswith("q.")
        }
        made = {joint: _names(theirs) for joint, theirs in written.items()}
        alone = {name for names in made.values() if len(names) == 1 for name in names}
        for pair in combinations(made, 2):
            both = made[pair[0]] & made[pair[1]]
            formula = any(mark in written[joint] for joint in pair for mark in "*/()")
            if both and (formula or both & alone):
                found.add(frozenset(pair))
    return found


def _names(theirs: str) -> set[str]:
    """Columns that an expression is made of; a name that is none stands for itself."""
    try:
        return set(parse(theirs).terms)
    except RecordingError:
        return {theirs}


def alike_notes(found: Diagnosis) -> tuple[str, ...]:
    """What is said of couplings that go both ways, where nothing speaks against equal values."""
    estimate = found.after
    model, notes = estimate.model, []
    steps = (step.effect for step in found.steps)
    added = {
        (str(e.joint), e.source): e
        for e in steps
        if e.name == "joint_coupling" and e.label in model.slices
    }
    for (joint, source), one in added.items():
        back = added.get((str(source), joint))
        parameters = one.parameters(model.robot)
        if back is None or joint > str(source) or parameters != back.parameters(model.robot):
            continue  # of one direction, told already, or of other units
        there, here = model.slices[one.label], model.slices[back.label]
        x, y = estimate.values[there], estimate.values[here]
        sure = _sure(x, estimate.sigma[there]) & _sure(y, estimate.sigma[here])
        named = [k for k in np.flatnonzero(sure) if parameters[k].name in _OF_BOTH]
        signs = {float(np.sign(value)) for k in named for value in (x[k], y[k])}
        p_value = _same(x - y, estimate.covariance, there, here)
        if len(signs) != 1 or not p_value > _LEAST:
            continue
        each = [
            f"{parameters[k].name} {number(x[k], 3)} and {number(y[k], 3)} {parameters[k].unit}"
            for k in named
        ]
        turns = "sum" if signs == {1.0} else "difference"
        notes.append(
            f"{joint} and {source} may load each other alike: {listed(each)}; that all parameters "
            f"of the two couplings are equal is not rejected (Wald test, p = "
            f"{p_value_words(p_value)}, if the model lacks nothing else). A part of the drive that "
            f"turns with the {turns} of both would, as in a wrist whose gears couple it."
        )
    return tuple(notes)


def _sure(values: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    return (sigma > 0.0) & (np.abs(values) > _SURE * sigma)


def _same(difference: np.ndarray, C: np.ndarray, there: slice, here: slice) -> float:
    """How probable it is that equal parameters are estimated so far apart: a Wald test."""
    known = np.concatenate([np.diag(C[there, there]), np.diag(C[here, here])])
    if not np.all(np.isfinite(known) & (known > 0.0)):
        return 0.0  # one of them is not known on its own
    of_it = C[there, there] + C[here, here] - C[there, here] - C[here, there]
    size = np.sqrt(np.clip(np.diag(of_it), np.finfo(float).tiny, None))
    d = difference / size
    scaled = of_it / np.outer(size, size)
    return float(chdtrc(len(d), d @ np.linalg.lstsq(scaled, d, rcond=None)[0]))
