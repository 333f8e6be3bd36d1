"""Values that no robot can have, alone or together, at the states that were recorded."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.criteria import DEFAULTS
from dynident.effects import Block
from dynident.model import Model, beyond_bounds, impossible_joints
from dynident.model.possible_values import ImpossibleJoint
from synthetic import arm, smooth_motion, true_values

BARE = Model(arm()) + "viscous_friction" + "coulomb_friction"
FRICTION = {"Fv__shoulder": 1.0, "Fv__elbow": 0.5, "Fc__shoulder": 0.4, "Fc__elbow": 0.3}
GATES = DEFAULTS.gates


def states(model: Model, session: float = 7.0) -> Block:
    t, q, v, a = smooth_motion(2, 0, 20.0, 8.0, 8.0)
    return model.block(t * session / 8.0, q, v, a)


def found(model: Model, changes: dict[str, float], sigma: float = 1e-3) -> list[str]:
    values = true_values(model, **FRICTION)
    for name, value in changes.items():
        values[model.names.index(name)] = value
    covariance, each = sigma**2 * np.eye(model.size), np.full(model.size, sigma)
    every = (
        *beyond_bounds(model, values, each, GATES),
        *impossible_joints(model, values, covariance, states(model), GATES),
    )
    return [one.where for one in every]


def joints(values: np.ndarray, sigma: float = 1e-3) -> tuple[ImpossibleJoint, ...]:
    covariance = sigma**2 * np.eye(BARE.size)
    return impossible_joints(BARE, values, covariance, states(BARE), GATES)


def test_a_robot_as_it_is_can_be() -> None:
    assert found(BARE, {}) == []
    assert found(BARE + "stribeck_friction@elbow", {"Fs@elbow": 0.2}) == []


@pytest.mark.parametrize(
    ("effects", "changes", "where"),
    [
        ((), {"Fv@elbow": -0.1}, "Fv of viscous_friction@elbow"),
        (("drive_gain@elbow",), {"e@elbow": 8330.0}, "e of drive_gain@elbow"),
        (("thermal_friction@elbow",), {"Fvt@elbow": -2.0}, "friction at elbow"),
        (("rotor_inertia@elbow",), {"Ia@elbow": -3.0}, "inertia at elbow"),
    ],
)
def test_what_no_robot_can_have_is_said_where(effects, changes, where) -> None:
    model = BARE
    for effect in effects:
        model = model + effect
    assert where in found(model, changes)


def test_what_is_not_certain_is_not_said() -> None:
    assert found(BARE, {"Fv@elbow": -0.1}, sigma=0.05) == []
    assert found(BARE + "rotor_inertia@elbow", {"Ia@elbow": -3.0}, sigma=2.0) == []


def test_warmth_that_turns_friction_round_is_impossible_although_each_instant_is_possible() -> None:
    """A large change over a short session beside a friction as large, and of the other sign."""
    model = BARE + "thermal_friction@elbow"
    assert found(model, {"Fv@elbow": -128.0, "Fvt@elbow": 136.0}) == [
        "Fv of viscous_friction@elbow"
    ]


@pytest.mark.parametrize("name", ["Fv@shoulder", "Fv@elbow"])
def test_friction_that_drives_a_joint_is_named_with_its_power_and_torque(name: str) -> None:
    values = true_values(BARE, **FRICTION)
    values[BARE.names.index(name)] = -2.0
    (one,) = joints(values)
    assert one.joint == name[3:] and one.where == f"friction at {one.joint}"
    v = states(BARE).v[:, BARE.robot.names.index(one.joint)]
    dry = FRICTION[f"Fc__{one.joint}"] * np.mean(v * np.tanh(v / BARE.friction_width))
    power = dry - 2.0 * np.mean(v**2)
    assert f"({power:.3g} +- " in one.what and " W)" in one.what
    assert one.torque == pytest.approx(abs(power) / np.sqrt(np.mean(v**2)))
    assert joints(values, sigma=3.0) == ()  # within three standard deviations nothing is said


def test_a_negative_coefficient_alone_may_be_possible_at_a_joint() -> None:
    """Friction that falls with speed has a negative slope, and still takes power."""
    assert joints(true_values(BARE, **{**FRICTION, "Fc__elbow": 1.5, "Fv__elbow": -0.1})) == ()


def test_negative_inertia_is_named_at_every_joint_that_has_it() -> None:
    values = true_values(BARE, **FRICTION)
    bodies = len(BARE.base.independent)
    values[:bodies] *= -1.0
    assert [one.where for one in joints(values)] == ["inertia at shoulder", "inertia at elbow"]
    assert all("kg m^2" in one.what and one.torque > 0 for one in joints(values))


def test_a_mass_matrix_may_be_impossible_though_its_diagonal_is_not() -> None:
    model = Model(arm())
    values = true_values(model)
    block = states(model)
    nearest = []
    for factor in (1.0, 40.0):  # more coupling between the links than their inertias allow
        scaled = np.array(values)
        coupled = [k for k, name in enumerate(model.names) if name in ("mx.fore", "my.fore")]
        scaled[coupled] *= factor
        found = impossible_joints(model, scaled, 1e-12 * np.eye(model.size), block, GATES)
        nearest.append([one.where for one in found])
    assert nearest == [[], ["mass matrix"]]
