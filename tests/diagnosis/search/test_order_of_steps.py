"""Which of the effects added is named first, once all shapes are known."""

from __future__ import annotations

from dataclasses import replace

from dynident.diagnosis.search.path import responses_in_place
from dynident.diagnosis.search.scores.candidate_moments import candidate_moments
from dynident.diagnosis.search.scores.scoring import score
from dynident.diagnosis.search.selection import AddedEffect
from dynident.effects import effects_of
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, synthetic, true_values

FULL = Model(arm()) + "viscous_friction" + "coulomb_friction"
FRICTION = {"Fv__shoulder": 1.2, "Fv__elbow": 0.5, "Fc__shoulder": 1.5, "Fc__elbow": 0.6}
SPRING, OFFSETS = "joint_elasticity@shoulder", ("torque_offset@shoulder", "torque_offset@elbow")


def ordered(offset: float) -> list[str]:
    """Labels in order, of offsets at both joints that were added before a spring of the gear."""
    (spring,) = effects_of(SPRING, FULL.robot)
    full = FULL + spring.shaped(9.0, 0.08, 0.3).at([2e-3]) + "torque_offset"
    values = {**FRICTION, "c__shoulder": 2e-3, "offset__shoulder": offset, "offset__elbow": offset}
    truth = true_values(full, **values)
    made = (
        synthetic(full, truth, seed, rate_hz=250.0, position_std=2e-6, torque_std=0.1)
        for seed in range(2)
    )
    evidence = Evidence(FULL, gather(Dataset(tuple(made))))
    start, final = fit_evidence(evidence, FULL), fit_evidence(evidence, full)
    by_label = {effect.label: effect for effect in full.effects}
    found = []
    for label in (*OFFSETS, SPRING):
        (part,) = candidate_moments(evidence, start, [by_label[label]])
        one = AddedEffect(score(start, by_label[label], *part, grid=1), 0.0, ())
        found.append(replace(one, with_it=OFFSETS[0]) if label == OFFSETS[1] else one)
    placed = responses_in_place(evidence, start, final, tuple(found))
    return [one.score.effect.label for one in placed]


def test_a_spring_found_late_comes_before_what_explains_less() -> None:
    assert ordered(offset=0.01) == [SPRING, *OFFSETS]


def test_a_spring_comes_after_what_explains_more() -> None:
    assert ordered(offset=3.0) == [*OFFSETS, SPRING]
