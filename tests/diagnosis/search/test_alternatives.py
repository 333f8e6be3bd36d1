"""Beside an effect is named what is enough instead of it, not what is as likely besides."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.diagnosis.search.alternatives import as_likely
from dynident.diagnosis.search.ranking import Ranking, rank
from dynident.diagnosis.search.scoring import Score
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


def scored(label: str, drop: float, loss: float) -> Score:
    """An effect that every one of thirty blocks finds the worse, the larger the loss."""
    (effect,) = effects_of(label, PLAIN.robot)
    return Score(
        effect=effect,
        payload_recordings=None,
        not_identifiable=False,
        drop=drop,
        values=(1.0,) * len(effect.parameters(PLAIN.robot)),
        losses=loss + 0.01 * np.random.default_rng(0).random(30),
    )


@pytest.mark.parametrize(
    ("rival", "drop", "loss", "named"),
    [
        # Less, beyond noise and not by much, with a shape besides.
        ("torque_ripple@shoulder", 2000.0 - 1.1 * 3.92**2, 2.0, False),
        ("torque_ripple@shoulder", 2000.0 - 0.9 * 3.92**2, 2.0, True),
        # With less: what else is wrong may do that.
        ("torque_offset@shoulder", 2000.0 - 1.1 * 3.92**2, 2.0, True),
        # As many parameters.
        ("asymmetric_friction@shoulder", 2000.0 - 1.1 * 3.92**2, 2.0, True),
        # Its columns are those of a first guess.
        ("joint_zero@shoulder", 2000.0 - 1.1 * 3.92**2, 2.0, True),
        ("torque_ripple@shoulder", 1900.0, 2.0, False),
        # Blocks of time do not tell these.
        ("torque_ripple@shoulder", 2000.0 - 0.9 * 3.92**2, 1.0, True),
        ("torque_ripple@shoulder", 2000.0 - 1.1 * 3.92**2, 1.0, False),
        ("torque_offset@shoulder", 1900.0, 1.0, True),
    ],
)
def test_of_what_has_more_parameters_more_is_asked(rival, drop, loss, named) -> None:
    evidence = evidence_of((DRAG, 0.1))
    winner, other = scored("joint_spring@shoulder", 2000.0, 1.0), scored(rival, drop, loss)
    ranking = Ranking((winner, other), 2, ("", ""))
    assert as_likely(evidence, fit_evidence(evidence, PLAIN), ranking) == [other] * named
