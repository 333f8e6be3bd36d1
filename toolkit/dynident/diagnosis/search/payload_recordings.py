"""Which recordings carry the payload, where the study does not say.

To choose them is a choice that costs, among as many as there are subsets. It is confirmed half by
half of each recording, and by rivals that may choose recordings as freely: a warm motor, whose
torque constant or offset is another one in some recordings, looks like a load. A test recording
that is to carry the payload says so in both of its halves, each of which is judged by what the
other one says.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np
from scipy.linalg import block_diag

from dynident.diagnosis.search.scores.candidate_moments import (
    candidate_moments,
    moments_with_payload,
)
from dynident.diagnosis.search.scores.cleared_columns import cleared
from dynident.diagnosis.search.scores.score import Score
from dynident.diagnosis.search.scores.scoring import score
from dynident.effects import Effect, catalogue
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, residuals
from dynident.evidence.runs import Run, flagged_run
from dynident.moments.second_moments import SecondMoments

_RIVALS = {
    "torque_offset": "a torque offset",
    "drive_gain": "another drive gain",
}

Parts = tuple[SecondMoments, SecondMoments]
"""Moments of columns with the model's and the torque, and with themselves, block by block."""


def stated(runs: Sequence[Run]) -> bool:
    """Whether the study says of any recording if it carries the payload."""
    return any(run.recording.payload is not None for run in runs)


def payload_choices(runs: tuple[Run, ...], most: int) -> list[tuple[bool, ...]]:
    """Which runs may carry the payload: as the study says, or every choice where it is silent.

    Of more than `most` runs only those choices in which one carries it, or all but one.
    """
    if stated(runs):
        return [tuple(bool(run.recording.payload) for run in runs)]
    if len(runs) > most:
        singles = np.eye(len(runs), dtype=bool)
        return [tuple(bool(c) for c in row) for row in (*singles, *~singles)]
    every = product((False, True), repeat=len(runs))
    return [c for c in every if any(c) and not all(c)] or [(True,) * len(runs)]


def payload_scores(evidence: Evidence, fitted: EvidenceFit, effect: Effect) -> Iterator[Score]:
    """Score a payload in every choice of recordings that may carry it.

    Parameters
    ----------
    evidence, fitted : the training recordings, and the model as it fits them.
    effect : the payload.

    Yields
    ------
    Score
        Of each choice, which costs as many as there are subsets, tried or not.
    """
    choices = payload_choices(evidence.runs, evidence.criteria.search.payload_recordings)
    subsets = 1 if stated(evidence.runs) else max(2 ** len(evidence.runs) - 2, 1)
    (whole,) = candidate_moments(evidence, fitted, [effect])
    for choice in choices:
        parts = (moments_with_payload(part, evidence, choice) for part in whole)
        # A load has mass: of two complementary choices only one can be meant.
        yield score(fitted, effect, *parts, grid=subsets, payload_recordings=choice)


def unconfirmed(evidence: Evidence, fitted: EvidenceFit, one: Score) -> str:
    """Say why a payload that nobody mentioned is not believed.

    Parameters
    ----------
    evidence, fitted : the training recordings, and the model without the payload.
    one : its score, with the choice of recordings.

    Returns
    -------
    In words; empty where it is confirmed, stated, or no payload at all.
    """
    choice = one.payload_recordings
    if choice is None or stated(evidence.runs):
        return ""
    (whole,) = candidate_moments(evidence, fitted, [one.effect])
    parts = tuple(moments_with_payload(part, evidence, choice) for part in whole)
    own = parts[1].as_set().pooled()
    found = cleared(fitted, parts[0].pooled(), own, _used(own))
    if not found.identifiable[0]:
        return "its columns are noise in this data"
    gains = _gains_of_halves(evidence, fitted, whole, one, found.back[0])
    for run, carries, halves in zip(evidence.runs, choice, gains, strict=True):
        if not all((gain > 0) == carries for gain in halves):
            return f"the two halves of {run.recording.name} differ on whether it is carried there"
    for name, words in _RIVALS.items():
        rival = _best_drop(evidence, fitted, name)
        if rival >= one.penalised:
            return f"{words} that differs between recordings explains as much"
    return ""


def _gains_of_halves(
    evidence: Evidence, fitted: EvidenceFit, whole: Parts, one: Score, back: np.ndarray
) -> Iterator[tuple[float, float]]:
    """What carrying the payload takes off the squared residual of each half of each recording."""
    values = np.array(one.values)
    combination = np.append(-fitted.values + back @ values, 1.0)
    with_model, with_self = (part.signal for part in whole)
    gains = 2.0 * np.einsum("i,bik,k->b", combination, with_model, values)
    gains -= np.einsum("i,bij,j->b", values, with_self, values)
    start = 0
    for run in evidence.runs:
        own = gains[start : start + len(run.edges) - 1]
        start += len(own)
        half = len(own) // 2
        yield float(own[:half].sum()), float(own[half:].sum())


def _best_drop(evidence: Evidence, fitted: EvidenceFit, name: str) -> float:
    """What an effect at every joint explains, in the recordings where it explains most.

    Less the price of its parameters and of the choice, as of a payload.
    """
    robot = fitted.model.robot
    every = [e.on(robot) for e in catalogue()[name].candidates(robot) if e.joint is not None]
    each = [candidate_moments(evidence, fitted, [effect]).of(0) for effect in every]
    choices = payload_choices(evidence.runs, evidence.criteria.search.payload_recordings)
    price = 2.0 * math.log(max(2 ** len(evidence.runs) - 2, 1))
    most = -np.inf
    for choice in choices:
        parts = [
            tuple(moments_with_payload(part, evidence, choice).pooled() for part in one)
            for one in each
        ]
        beside = SecondMoments(
            np.concatenate([b.total for b, _ in parts], axis=1),
            parts[0][0].counts,
            None,
            np.concatenate([b.signal for b, _ in parts], axis=1),
        )
        own = SecondMoments(
            np.asarray(block_diag(*(s.total for _, s in parts))),
            parts[0][1].counts,
            None,
            np.asarray(block_diag(*(s.signal for _, s in parts))),
        ).as_set()
        found = cleared(fitted, beside, own, _used(own))
        (drop,), (rank,) = found.drops, found.ranks
        if rank:
            most = max(most, float(drop - rank * np.log(fitted.rows) - price))
    return most


def _used(own: SecondMoments) -> np.ndarray:
    return np.diagonal(own.signal, axis1=1, axis2=2) > 0


def with_payload(evidence: Evidence, score: Score) -> Evidence:
    """Return the evidence with the runs marked that carry the payload, once that is known."""
    if score.payload_recordings is None:
        return evidence
    return marked(evidence, score.payload_recordings)


def with_payload_decided(held: Evidence, fitted: EvidenceFit) -> Evidence:
    """Decide which test recordings carry a payload of known inertia, where the study is silent.

    One half of a recording decides for the other: it is carried where both say so.
    """
    if not any(effect.is_payload for effect in fitted.model.effects):
        return held
    said = [run.recording.payload for run in held.runs]
    sums = []
    for carries in (False, True):
        every = marked(held, [carries if one is None else one for one in said])
        misfits = residuals(every, fitted.model, fitted.values)
        halves = [np.array_split(e**2 / fitted.variances, 2, axis=1) for e in misfits]
        sums.append([[float(part.sum()) for part in pair] for pair in halves])
    decided = [
        all(loaded < without for without, loaded in zip(*pair, strict=True)) if one is None else one
        for one, *pair in zip(said, *sums, strict=True)
    ]
    return marked(held, decided)


def marked(evidence: Evidence, carries: Sequence[bool | None]) -> Evidence:
    """Return the evidence of the same recordings, with or without the payload on board.

    Parameters
    ----------
    evidence : of recordings.
    carries : for each of them, what is known; None for nothing.
    """
    return evidence.with_runs(
        tuple(flagged_run(run, own) for run, own in zip(evidence.runs, carries, strict=True))
    )
