"""Beside an effect is named what is enough instead of it, not what is as likely besides."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.diagnosis.search.alternatives import as_likely
from dynident.diagnosis.search.ranking import Ranking, rank
from dynident.diagnosis.search.scores.score import Score
from dynident.diagnosis.search.selection import AddedEffect, choose
from dynident.effects import effects_of
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import EvidenceFit, fit_evidence
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
PLAIN = Model(arm()) + "viscous_friction" + "coulomb_friction"
DRAG, OFFSET = "quadratic_drag@shoulder", "torque_offset@elbow"
SPRING, WRONG = "joint_spring@shoulder", "quadratic_drag@elbow"
TILT, ZERO = "base_tilt", "joint_zero@shoulder"


def evidence_of(*hidden: tuple[str, float]) -> Evidence:
    """Three recordings of an arm with effects of these values that the plain model lacks."""
    full = PLAIN
    for label, _ in hidden:
        full = full + label
    truth = true_values(full, **FRICTION)
    for label, value in hidden:
        truth[full.slices[label]] = value
    made = tuple(
        synthetic(full, truth, seed, rate_hz=250.0, position_std=2e-5, torque_std=0.3)
        for seed in range(3)
    )
    return Evidence(PLAIN, gather(Dataset(made)))


def ranked(evidence: Evidence, *labels: str) -> tuple[EvidenceFit, Ranking]:
    fitted = fit_evidence(evidence, PLAIN)
    only = tuple(e for label in labels for e in effects_of(label, PLAIN.robot))
    ranking = rank(evidence, fitted, 0, only=only)
    assert len(ranking.passing) == len(labels)
    return fitted, ranking


def chosen(evidence: Evidence, *labels: str) -> AddedEffect:
    fitted, ranking = ranked(evidence, *labels)
    found = choose(evidence, fitted, ranking)
    assert found is not None
    return found


def test_effects_at_two_joints_are_both_there_however_equal_their_gains() -> None:
    """Neither takes anything of the other's gain: each joint has a torque of its own."""
    _, ranking = ranked(evidence_of((DRAG, 0.1), (OFFSET, 0.1)), DRAG, OFFSET)
    drop = {one.effect.label: one.drop for one in ranking.scores}
    drag = 0.1 * float(np.sqrt(drop[OFFSET] / drop[DRAG]))
    evidence = evidence_of((DRAG, drag), (OFFSET, 0.1))
    first, second = ranked(evidence, DRAG, OFFSET)[1].passing
    assert second.drop == pytest.approx(first.drop, rel=0.05)
    assert chosen(evidence, DRAG, OFFSET).indistinguishable == ()


def test_what_is_enough_instead_is_named() -> None:
    """In one vertical plane a tilted base is an offset of the first joint's position."""
    found = chosen(evidence_of((TILT, 0.1)), TILT, ZERO)
    named = {found.score.effect.label, *(one.label for one in found.indistinguishable)}
    assert named == {TILT, ZERO}


def scored(label: str, drop: float) -> Score:
    """An effect of which blocks of time say as much as of any other."""
    (effect,) = effects_of(label, PLAIN.robot)
    values = (1.0,) * len(effect.parameters(PLAIN.robot))
    return Score(
        effect=effect,
        payload_recordings=None,
        not_identifiable=False,
        rank=len(values),
        drop=drop,
        values=values,
        losses=np.random.default_rng(0).random(30),
    )


@pytest.mark.parametrize(
    ("hidden", "rival", "named"),
    [
        # Told apart by noise, however little blocks of time say: with a shape besides.
        (((SPRING, 10.0),), "torque_ripple@shoulder", False),
        (((SPRING, 0.01),), "torque_ripple@shoulder", True),
        # More is wrong with either than they differ by.
        (((SPRING, 10.0), (WRONG, 30.0)), "torque_ripple@shoulder", True),
        # As many parameters; columns of a first guess.
        (((SPRING, 10.0),), "asymmetric_friction@shoulder", True),
        (((SPRING, 10.0),), "joint_zero@shoulder", True),
    ],
)
def test_of_what_has_more_parameters_more_is_asked(hidden, rival, named) -> None:
    evidence = evidence_of(*hidden)
    winner, other = scored(SPRING, 1000.0), scored(rival, 999.0)
    ranking = Ranking((winner, other), 2, ("", ""))
    assert as_likely(evidence, fit_evidence(evidence, PLAIN), ranking) == [other] * named
