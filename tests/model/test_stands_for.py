"""What a combination is said to stand for is a sum that the true parameters add up to."""

from __future__ import annotations

import re

import numpy as np

from chains import chain
from dynident.model import Model
from dynident.robot import base_parameters

_TERM = re.compile(r"(?:^| ([+-]) )(?:([0-9.e+-]+) )?([^ +-][^ ]*)")


def _added_up(words: str, truth: dict[str, float]) -> float:
    """The sum that stands in the words, of true values."""
    found = 0.0
    for sign, factor, name in _TERM.findall(words):
        found += (-1.0 if sign == "-" else 1.0) * float(factor or 1.0) * truth[name]
    return found


def test_combinations_are_written_in_standard_parameters() -> None:
    """Rotors lean on base parameters that are sums themselves, of which parts cancel."""
    model = Model(chain(4)) + "rotor_inertia" + "viscous_friction"
    rng = np.random.default_rng(3)
    theta = model.robot.theta
    effects = rng.uniform(0.2, 2.0, model.size - model.base.rank)
    values = np.concatenate([model.base.coordinates(theta), effects])
    q, v, a = model.robot.random_motion(0, 400)
    columns = model.columns(model.block(np.arange(400.0), q, v, a), values)
    basis = base_parameters(columns.reshape(-1, model.size), model.names)
    assert basis.rank < model.size, "every parameter is told apart"
    truth = dict(zip(model.base.names, theta, strict=True))
    truth |= dict(zip(model.names[model.base.rank :], effects, strict=True))
    words = model.stands_for(basis)
    heads = [basis.names[head] for head in basis.independent]
    assert any("Ia@" in one and " m." in one for one in words)
    for name, said, value in zip(heads, words, basis.coordinates(values), strict=True):
        assert np.isclose(_added_up(said or name, truth), value, rtol=1e-4, atol=1e-6), said


def test_a_parameter_alone_stands_for_itself() -> None:
    model = Model(chain(1)) + "viscous_friction"
    alone = base_parameters(np.eye(model.size), model.names)
    assert model.stands_for(alone)[-1] == ""


def test_what_no_torque_tells_makes_no_combination() -> None:
    """As a right angle written with seven digits leaves it: a load used to be "not told apart"."""
    rng = np.random.default_rng(1)
    mass, rotor, inertia = rng.normal(size=(3, 500))
    same = rotor + 1e-6 * mass
    X = np.stack([mass, inertia + 0.3 * rotor, rotor, same], axis=1)
    X = X * [2.0, 30.0, 0.1, 0.1]  # columns of unlike sizes, as parameters have
    basis = base_parameters(X, ("mass", "inertia", "rotor", "same"), 3e-5)
    assert basis.rank == 3
    alone = np.count_nonzero(basis.told, axis=1) == 1
    assert [basis.names[i] for i in np.array(basis.independent)[alone]] == ["mass", "inertia"]
    np.testing.assert_allclose(basis.told, basis.combination, atol=1e-6)


def test_a_small_share_that_is_the_whole_of_a_parameter_is_told() -> None:
    """A mass behind an offset of 4 mm makes little torque, and is part of the moment."""
    moment = np.random.default_rng(2).normal(size=500)
    basis = base_parameters(np.stack([moment, 0.004 * moment], axis=1), ("mx", "mass"), 3e-5)
    np.testing.assert_allclose(basis.told, [[1.0, 0.004]])
