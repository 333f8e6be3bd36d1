"""Effects of the session's time: drift, warming up, and one contact."""

import numpy as np
import pytest

from dynident.closed_loop import Mechanism, TrueEffect
from dynident.effects import Block, effects_of
from dynident.effects.friction.thermal_friction import ThermalFriction
from dynident.robot import Robot

SLIDER = """<robot name="axis"><link name="rail"/><link name="bob"><inertial>
  <origin xyz="0.1 0 0"/><mass value="2"/>
  <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="rail"/><child link="bob"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="3" effort="50"/></joint></robot>"""
ROBOT = Robot.from_text(SLIDER)
T = np.linspace(-2.0, 200.0, 3001)
V = np.cos(3 * T)[:, None]


def block(**changes) -> Block:
    return Block(T, np.sin(3 * T)[:, None] / 3, V, 0 * V, names=ROBOT.names, **changes)


def effect(label: str, *shape: float):
    (one,) = effects_of(label, ROBOT)
    return one.shaped(*shape).on(ROBOT) if shape else one


def test_a_drift_grows_with_the_time_of_the_session() -> None:
    np.testing.assert_array_equal(effect("torque_drift@hinge").columns(block())[:, 0, 0], T)


def test_friction_falls_to_a_share_of_e_in_one_time_constant() -> None:
    one = effect("thermal_friction@hinge", 50.0)
    columns = one.columns(block())[:, 0]
    np.testing.assert_allclose(columns[:, 0], np.exp(-T / 50.0) * V[:, 0])
    np.testing.assert_allclose(columns[:, 1], np.exp(-T / 50.0) * np.tanh(V[:, 0] / 0.01))


def test_a_recorded_temperature_takes_the_place_of_time() -> None:
    one, other = effect("thermal_friction@hinge", 50.0), effect("thermal_friction@hinge", 90.0)
    assert isinstance(one, ThermalFriction)
    recorded = block(temperature=one.temperature(T)[:, None])
    np.testing.assert_allclose(other.columns(recorded), one.columns(block()), atol=1e-12)
    assert not np.any(other.sensitivities(recorded))
    unknown = block(temperature=np.full_like(V, np.nan))
    np.testing.assert_array_equal(one.columns(unknown), one.columns(block()))


def test_a_contact_is_in_one_recording_only() -> None:
    one = effect("contact@hinge", 3, 100.0, 0.5)
    pulse = one.columns(block(number=3))[:, 0, 0]
    assert T[np.argmax(pulse)] == pytest.approx(100.0, abs=0.05)
    # The area of a Gaussian pulse of height one.
    assert np.trapezoid(pulse, T) == pytest.approx(0.5 * np.sqrt(2 * np.pi), rel=1e-3)
    assert not np.any(one.columns(block(number=2)))
    assert list(one.variants(ROBOT)) == [one]


@pytest.mark.parametrize(
    ("label", "shape"), [("thermal_friction@hinge", (50.0,)), ("contact@hinge", (3, 100.0, 0.5))]
)
def test_sensitivities_are_the_derivatives_by_the_logarithms(label, shape) -> None:
    one, step = effect(label, *shape), 1e-6
    exact = one.sensitivities(block(number=3))
    assert exact is not None
    for k in range(len(shape)):
        ends = []
        for sign in (1, -1):
            moved = list(shape)
            moved[k] *= np.exp(sign * step)
            ends.append(effect(label, *moved).columns(block(number=3)))
        found = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(exact[..., k], found, atol=1e-6 * np.abs(exact).max() + 1e-8)


def test_mechanisms_know_their_recording_where_it_matters() -> None:
    (push,) = TrueEffect.of("contact@hinge", ROBOT, [4.0], (2, 1.0, 0.1))
    mechanism = Mechanism.of(ROBOT, [push])
    t, still = np.array([1.0]), np.zeros((1, 1))
    assert mechanism.numbered(2).force(t, still, still)[0, 0] == pytest.approx(4.0)
    assert mechanism.numbered(1).force(t, still, still)[0, 0] == 0.0
    plain = Mechanism.of(ROBOT, TrueEffect.of("torque_drift@hinge", ROBOT, [0.1]))
    assert plain.numbered(2) is plain
