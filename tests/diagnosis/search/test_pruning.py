"""What was added and is not needed is dropped again, and each step is judged by what it adds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.diagnosis.nuisances.friction_width import with_friction_width
from dynident.diagnosis.search.path import path_of
from dynident.diagnosis.search.ranking import candidates, rank
from dynident.diagnosis.search.selection import AddedEffect, choose, without_superfluous
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


def evidence_of(seeds: range, drag: float, offset: float) -> Evidence:
    """Recordings of an arm with a drag and an offset that the plain model lacks."""
    full = PLAIN + DRAG + OFFSET
    truth = true_values(full, **FRICTION, Fq__shoulder=drag, offset__elbow=offset)
    made = tuple(
        synthetic(full, truth, seed, rate_hz=250.0, position_std=2e-5, torque_std=0.3)
        for seed in seeds
    )
    every = tuple(v for e in candidates(PLAIN) for v in e.variants(PLAIN.robot))
    return Evidence(PLAIN, gather(Dataset(made)), candidates=every)


def added(evidence: Evidence, *labels: str) -> tuple[EvidenceFit, list[AddedEffect]]:
    """The model with effects added one after the other, as the diagnosis adds them."""
    fitted, found = fit_evidence(evidence, PLAIN), []
    for label in labels:
        (effect,) = effects_of(label, PLAIN.robot)
        one = choose(evidence, fitted, rank(evidence, fitted, len(found), only=(effect,)))
        assert one is not None
        found.append(one)
        fitted = fit_evidence(evidence, fitted.model + effect, fitted)
    return fitted, found


def kept(evidence: Evidence, held: Evidence | None) -> list[str]:
    fitted, found = added(evidence, DRAG, OFFSET)
    left = without_superfluous(evidence, held, fitted, found, lambda _: None)
    assert [e.label for e in left.final.model.effects][-len(left.found) :] == [
        one.score.effect.label for one in left.found
    ]
    return [one.score.effect.label for one in left.found]


def test_what_helps_in_training_and_in_the_test_stays() -> None:
    evidence = evidence_of(range(3), 0.4, 0.4)
    assert kept(evidence, evidence_of(range(3, 5), 0.4, 0.4)) == [DRAG, OFFSET]
    assert kept(evidence, None) == [DRAG, OFFSET]


def test_what_does_not_help_in_the_test_recordings_goes() -> None:
    """The machine of the test recordings has no drag."""
    assert kept(evidence_of(range(3), 0.4, 0.4), evidence_of(range(3, 5), 0.0, 0.4)) == [OFFSET]


def test_what_another_effect_explains_as_well_goes() -> None:
    evidence = evidence_of(range(3), 0.4, 0.0)
    plain = fit_evidence(evidence, PLAIN)
    ripple, drag = (
        effects_of("torque_ripple@shoulder", PLAIN.robot)[0],
        effects_of(DRAG, PLAIN.robot)[0],
    )
    ranking = rank(evidence, plain, 0, only=(ripple, drag))
    found = [AddedEffect(s, 0.0, ()) for s in sorted(ranking.scores, key=lambda s: s.drop)]
    model = PLAIN
    for one in found:
        model = model + one.score.effect
    left = without_superfluous(
        evidence, None, fit_evidence(evidence, model, plain), found, lambda _: None
    )
    assert [one.score.effect.label for one in left.found] == [DRAG]
    assert np.isclose(left.final.values[left.final.model.slices[DRAG]], 0.4, atol=0.05)


def test_each_stage_of_a_path_has_the_friction_width_that_it_calls_for() -> None:
    """The study states five times the width: no step is credited with what that mends."""
    evidence = evidence_of(range(3), 0.4, 0.4)
    stated = 5 * float(PLAIN.friction_widths[0])
    wide = PLAIN.with_friction_width("shoulder", stated).with_friction_width("elbow", stated)
    start = fit_evidence(evidence, wide)
    _, found = added(evidence, DRAG, OFFSET)
    last = fit_evidence(evidence, wide + DRAG + OFFSET, start)
    fitted = with_friction_width(evidence, last)
    path = path_of(evidence, None, start, fitted, tuple(found), lambda _: None)
    assert [one.score.effect.label for one in path.found] == [DRAG, OFFSET]
    assert path.withdrawn == ()
    first, *later = (one.model.friction_widths for one in path.stages)
    np.testing.assert_allclose(first, stated)
    for widths in later:
        np.testing.assert_allclose(widths, PLAIN.friction_width, rtol=0.4)
    errors = [one.error for one in path.judged]
    assert errors == sorted(errors, reverse=True)


def test_what_cannot_be_told_from_a_withdrawn_effect_is_refused_with_it() -> None:
    """The machine of the test recordings has no drag, and is not asked for a twin of it."""
    evidence, held = evidence_of(range(3), 0.8, 0.0), evidence_of(range(3, 5), 0.0, 0.0)
    start = fit_evidence(evidence, PLAIN)
    fitted, (drag,) = added(evidence, DRAG)
    twins = effects_of("torque_ripple@shoulder", PLAIN.robot) + effects_of(OFFSET, PLAIN.robot)
    drag = replace(drag, indistinguishable=twins)
    path = path_of(evidence, held, start, fitted, (drag,), lambda _: None)
    (taken_back,) = path.withdrawn
    assert path.found == () and path.final is start
    assert "raises the error on the test recordings" in taken_back.why
    assert taken_back.with_it == twins
    assert set(taken_back.refusals) == {DRAG, "torque_ripple@shoulder", OFFSET}
    assert "torque offset at elbow, which are indistinguishable from it" in taken_back.sentence
    assert [one["effect"] for one in taken_back.to_dict()["with_it"]] == [e.name for e in twins]
    assert replace(path, looks=2).notes == ()  # nothing is claimed
    (note,) = replace(path, found=(drag,), looks=2).notes
    assert "judged 2 sets of effects" in note
