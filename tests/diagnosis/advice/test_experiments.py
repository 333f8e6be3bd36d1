"""Advice: which experiment would show an effect or tell effects apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dynident.criteria import DEFAULTS
from dynident.diagnosis.advice.candidate_experiments import (
    CandidateExperiment,
    CandidateExperiments,
    Recorded,
)
from dynident.diagnosis.advice.experiments import Adviser
from dynident.effects import catalogue, effects_of
from dynident.model import Model
from dynident.robot import Robot
from synthetic import ARM, arm, true_values

RECORDED = Recorded(
    lower=np.array([-0.8, -1.0]),
    upper=np.array([0.8, 0.6]),
    speed=np.array([1.7, 1.8]),
    acceleration=np.array([4.5, 4.4]),
    torque=np.array([21.0, 3.7]),
    span=16.0,
)


def fitted(robot: Robot, *more: str) -> tuple[Model, np.ndarray]:
    model = Model(robot) + "viscous_friction" + "coulomb_friction"
    for label in more:
        model = model + label
    return model, true_values(model, Fv__shoulder=1.2, Fv__elbow=0.5, Fc__shoulder=1.0)


@pytest.fixture(scope="module")
def adviser() -> Adviser:
    return advising(*fitted(arm()))


def advising(model: Model, values: np.ndarray) -> Adviser:
    return Adviser(CandidateExperiments(model=model, values=values, recorded=RECORDED))


def one(label: str):
    return effects_of(label, arm())[0]


def test_an_effect_that_is_part_of_the_robot_is_said_to_be_so(adviser: Adviser) -> None:
    said = adviser.revealing(one("rotor_inertia@shoulder"))
    assert said.startswith("no motion of this robot shows rotor inertia at shoulder")
    assert "Izz.upper" in said
    assert "my.fore" in adviser.revealing(one("joint_zero@elbow"))
    assert adviser.revealing(one("rotor_inertia@elbow")).startswith("accelerate elbow beyond 6.6")


def test_a_payload_is_to_be_recorded_with_and_without(adviser: Adviser) -> None:
    said = adviser.revealing(one("payload"))
    assert "with the payload and without" in said


@pytest.mark.parametrize(
    ("label", "numbers"),
    [
        ("joint_coupling@elbow:shoulder", ("move shoulder with elbow still", "4.8", "1.7")),
        ("joint_spring@elbow", ("from -2 to 2 rad", "recorded: -1 to 0.6")),
        ("torque_drift@elbow", ("10 min later", "0.27 min")),
        ("stribeck_friction@elbow", ("below 0.1 rad/s",)),
        ("quadratic_drag@shoulder", ("both directions", "4.8 rad/s")),
    ],
)
def test_advice_has_the_numbers_of_robot_and_recordings(
    adviser: Adviser, label: str, numbers: tuple[str, ...]
) -> None:
    said = adviser.revealing(one(label))
    assert all(part in said for part in numbers), said


def test_every_effect_has_advice(adviser: Adviser) -> None:
    for effect in catalogue().values():
        for place in effect.candidates(arm()):
            said = adviser.revealing(place.on(arm()))
            assert said and not said.endswith(".")


def test_tilt_of_the_base_and_zero_of_the_first_joint_are_the_same_on_a_planar_arm(
    adviser: Adviser,
) -> None:
    same = (one("joint_zero@shoulder"), one("base_tilt"))
    assert adviser.separating(same, [0.02]).startswith("no motion of this robot tells")


def test_effects_are_told_apart_where_they_differ_most(adviser: Adviser) -> None:
    pair = (one("torque_drift@elbow"), one("torque_offset@elbow"))
    assert "10 min later" in adviser.separating(pair, [0.01])
    pair = (one("payload"), one("drive_gain@elbow"))
    values = [0.4, 0.02, 0, 0, 0, 0, 0.001, 0, 0, 0.001]
    assert "differ by" in adviser.separating(pair, values)


def test_that_usual_motions_tell_little_apart_is_not_said_of_all_motions(adviser: Adviser) -> None:
    pair = (one("quadratic_drag@elbow"), one("asymmetric_friction@elbow"))
    assert "differ by" in adviser.separating(pair, [0.2])
    strict = replace(DEFAULTS, advice=replace(DEFAULTS.advice, clearly=0.99))
    said = Adviser(replace(adviser.trials, criteria=strict)).separating(pair, [0.2])
    assert said.startswith("usual motions leave less than 99 % of quadratic drag at elbow beside")
    assert "designed" in said and "no motion" not in said


def test_an_effect_already_in_the_model_is_told_from_others() -> None:
    model, values = fitted(arm(), "quadratic_drag@elbow")
    pair = (one("quadratic_drag@elbow"), one("asymmetric_friction@elbow"))
    said = advising(model, values).separating(pair, [0.2])
    assert "elbow" in said and "differ by" in said and "N m" in said


def test_difference_is_that_of_the_torques() -> None:
    model, values = fitted(arm())
    trials = CandidateExperiments(model=model, values=values, recorded=RECORDED)
    offset, drift = one("torque_offset@elbow"), one("torque_drift@elbow")
    before, left = trials.difference(offset, [2.0], drift, CandidateExperiment("wide"))
    assert before == pytest.approx([0.0, 2.0], abs=1e-9)
    assert np.linalg.norm(left) < np.linalg.norm(before)
    _, nothing = trials.difference(offset, [2.0], offset, CandidateExperiment("wide"))
    assert np.all(nothing < 1e-9)


def test_an_arm_without_limits_is_advised_beyond_what_was_recorded() -> None:
    text = ARM.replace('type="revolute"', 'type="continuous"').replace(
        'lower="-2.5" upper="2.5" velocity="6" ', ""
    )
    model, values = fitted(Robot.from_text(text))
    said = advising(model, values).revealing(one("quadratic_drag@shoulder"))
    assert "up to 2.5 rad/s (recorded: up to 1.7)" in said
