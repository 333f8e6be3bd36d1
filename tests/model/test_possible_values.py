"""Values that no robot can have, alone or together, at the states that were recorded."""

from __future__ import annotations

import numpy as np
import pytest

from dynident.effects import Block
from dynident.model import Model, impossible_at
from synthetic import arm, smooth_motion, true_values

BARE = Model(arm()) + "viscous_friction" + "coulomb_friction"


def states(model: Model, session: float = 7.0) -> Block:
    t, q, v, a = smooth_motion(2, 0, 20.0, 8.0, 8.0)
    return model.block(t * session / 8.0, q, v, a)


def found(model: Model, changes: dict[str, float], sigma: float = 1e-3) -> list[str]:
    values = true_values(model, Fv__shoulder=1.0, Fv__elbow=0.5, Fc__shoulder=0.4, Fc__elbow=0.3)
    for name, value in changes.items():
        values[model.names.index(name)] = value
    covariance = sigma**2 * np.eye(model.size)
    return [one.where for one in impossible_at(model, values, covariance, states(model), 3.0)]


def test_a_robot_as_it_is_can_be() -> None:
    assert found(BARE, {}) == []
    assert found(BARE + "stribeck_friction@elbow", {"Fs@elbow": 0.2}) == []


@pytest.mark.parametrize(
    ("effects", "changes", "where"),
    [
        ((), {"Fv@elbow": -0.1}, "Fv of viscous_friction@elbow"),
        (("drive_gain@elbow",), {"e@elbow": 8330.0}, "e of drive_gain@elbow"),
        (("thermal_friction@elbow",), {"Fvt@elbow": -2.0}, "friction at elbow"),
        (("rotor_inertia@elbow",), {"Ia@elbow": -3.0}, "mass matrix"),
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
