"""What is said of effects that several others together, or a part of the description, may be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dynident import diagnose as find
from dynident.diagnosis.nuisances.look_alikes import look_alike_notes
from dynident.diagnosis.search.scores.score import Score
from dynident.diagnosis.search.selection import AddedEffect, without_superfluous
from dynident.evidence.evidence import Evidence
from dynident.evidence.evidence_fit import fit_evidence
from dynident.evidence.runs import gather
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from synthetic import arm, synthetic, true_values
from torso import WAIST

PROBLEMS = Path(__file__).resolve().parents[3] / "problems"


@pytest.mark.slow
def test_offsets_that_do_what_a_tilt_does_are_named_beside_it() -> None:
    """On a gantry the two are the same torque; rivals are otherwise compared one by one."""
    given = Model(gantry()) + "viscous_friction" + "coulomb_friction"
    friction = {f"{name}__{axis}": 20.0 for name in ("Fv", "Fc") for axis in "xyz"}
    true = given + "torque_offset@x" + "torque_offset@y"
    truth = true_values(true, **friction, offset__x=4.0, offset__y=-3.0)
    runs = [synthetic(true, truth, k, rate_hz=250.0, torque_std=1.0) for k in range(2)]
    said = find(given, Dataset(tuple(runs[:1])), Dataset(tuple(runs[1:])), propose="never")
    assert [step.effect.label for step in said.steps] == ["base_tilt"]
    assert any(
        "Torque offsets at x, y and z together fit these recordings as well as base tilt" in note
        for note in said.notes
    )


def gantry() -> Robot:
    """Three slides at right angles, the last one upright."""
    links, joints, parent = ['<link name="base"/>'], [], "base"
    for axis, direction, mass in (("x", "1 0 0", 40), ("y", "0 1 0", 12), ("z", "0 0 1", 5)):
        links.append(
            f'<link name="{axis}_link"><inertial><origin xyz="0 0 0"/><mass value="{mass}"/>'
            '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
        )
        joints.append(
            f'<joint name="{axis}" type="prismatic"><parent link="{parent}"/>'
            f'<child link="{axis}_link"/><axis xyz="{direction}"/>'
            '<limit lower="-3" upper="3" velocity="5" effort="900"/></joint>'
        )
        parent = f"{axis}_link"
    return Robot.from_text(f'<robot name="gantry">{"".join([*links, *joints])}</robot>')


def test_a_payload_on_another_branch_is_said_not_to_be_sought() -> None:
    head, plain = Robot.from_file(PROBLEMS / "vision_head" / "robot.urdf"), arm()
    for robot, notes in ((head, ["right_eye alone, not on left_eye"]), (plain, [])):
        found = notes_on(Model(robot), Model(robot))
        assert len(found) == len(notes)
        assert all(words in one for words, one in zip(notes, found, strict=True))


def notes_on(given: Model, true: Model, *added: str) -> tuple[str, ...]:
    """Of a fit with effects more than the given model has, to a recording of the true one."""
    run = synthetic(true, true_values(true), 1, rate_hz=250.0, torque_std=0.05)
    evidence = Evidence(given, gather(Dataset((run,))))
    model = given
    for one in added:
        model = model + one
    return look_alike_notes(evidence, fit_evidence(evidence, model))


def on_a_tilt(unbalance: float = 0.0, waves: float = 0.0) -> list[Recording]:
    """Two recordings of the torso, whose description is wrong about its trunk by so many kg m."""
    true = Model(Robot.from_text(WAIST)) + "base_tilt" + "unbalance@waist" + "torque_ripple@waist"
    true = true.with_shapes((*true.effects[:-1], true.effects[-1].shaped(3.0)))
    values = true_values(true)
    values[true.slices["base_tilt"]] = 0.04, 0.03
    values[true.slices["unbalance@waist"]] = 9.81 * unbalance * np.array([0.03, -0.04])
    values[true.slices["torque_ripple@waist"]] = waves, 0.0
    return [synthetic(true, values, k, rate_hz=250.0, torque_std=0.02) for k in range(2)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("unbalance", "waves", "added"),
    [
        (0.0, 0.0, ["base_tilt"]),
        (0.4, 0.0, ["base_tilt", "unbalance@waist"]),
        (0.0, 0.2, ["base_tilt", "torque_ripple@waist"]),
    ],
)
def test_a_tilted_base_shows_where_the_description_is_wrong_about_the_first_link(
    unbalance: float, waves: float, added: list[str]
) -> None:
    """It used to be called a spring or a ripple of the waist."""
    runs = on_a_tilt(unbalance, waves)
    given = Model(Robot.from_text(WAIST))
    said = find(given, Dataset(tuple(runs[:1])), Dataset(tuple(runs[1:])), propose="never")
    assert [step.effect.label for step in said.steps] == added
    assert not any("is hardly one" in note for note in said.notes)


@pytest.mark.parametrize(("per_turn", "said"), [(2.0, True), (12.0, False)])
def test_a_ripple_of_few_waves_may_be_any_curve_over_the_position(
    per_turn: float, said: bool
) -> None:
    given = Model(arm()) + "viscous_friction"
    run = synthetic(given, true_values(given), 1, rate_hz=250.0, torque_std=0.05)
    evidence = Evidence(given, gather(Dataset((run,))))
    wider = given + "torque_ripple@elbow"
    wider = wider.with_shapes((wider.effects[-1].shaped(per_turn),))
    notes = look_alike_notes(evidence, fit_evidence(evidence, wider))
    assert any("elbow travels through" in x and "a balancer" in x for x in notes) == said


@pytest.mark.parametrize(("distance", "said"), [(0.1, False), (0.9, True)])
def test_an_unbalance_that_no_link_can_have_is_said_to_be_hardly_one(
    distance: float, said: bool
) -> None:
    evidence = Evidence(
        Model(Robot.from_text(WAIST)), gather(Dataset(tuple(on_a_tilt(6.0 * distance)[:1])))
    )
    fitted = fit_evidence(evidence, evidence.model + "base_tilt" + "unbalance@waist")
    notes = look_alike_notes(evidence, fitted)
    assert any("unbalance at waist is hardly one: the weight of all" in x for x in notes) == said


def test_a_tilt_stays_while_what_it_makes_felt_is_there() -> None:
    """And an unbalance without one, as a study may have it, is no matter."""
    evidence = Evidence(Model(Robot.from_text(WAIST)), gather(Dataset(tuple(on_a_tilt(0.4)[:1]))))
    tilted = fit_evidence(evidence, evidence.model + "base_tilt" + "unbalance@waist")
    found = [
        AddedEffect(Score(effect=one, payload_recordings=None, not_identifiable=False), 0.0, ())
        for one in tilted.model.effects[-2:]
    ]
    kept = without_superfluous(evidence, None, tilted, found, lambda _: None)
    assert [one.score.effect.name for one in kept.found] == ["base_tilt", "unbalance"]
    alone = fit_evidence(evidence, evidence.model + "unbalance@waist")
    assert look_alike_notes(evidence, alone) == ()


def test_an_offset_may_be_friction_that_differs_between_the_directions() -> None:
    given = Model(arm()) + "viscous_friction" + "coulomb_friction"
    (note,) = notes_on(given, given, "torque_offset@elbow")
    assert "torque offset at elbow may also be dry friction" in note
    assert notes_on(given, given, "torque_offset@elbow", "asymmetric_friction@elbow") == ()
