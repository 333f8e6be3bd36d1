"""Gains of drives told apart from inertias: where something fixes the scale, and where not."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import standing_arm
from chains import chain, chain_text
from dynident.effects import effects_of
from dynident.errors import StudyError
from dynident.fitting.drive_gains import DriveGains, GainProblem, fit_drive_gains
from dynident.fitting.loads import Load
from dynident.inertia import from_com, to_com
from dynident.model import Model
from dynident.recording import Dataset, Recording, default_filter
from dynident.robot import Robot
from study_files import recording
from synthetic import arm, smooth_motion

N = 3
GAINS = np.array([11.0, -7.5, 3.2])
TOOL = from_com(2.0, [0.03, -0.05, 0.08], np.diag([0.01, 0.012, 0.007]))
BODY = from_com(1.4, [-0.06, 0.02, 0.11], [[0.006, 0.001, 0], [0.001, 0.005, 0], [0, 0, 0.004]])
PHI = {"": np.zeros(10), "tool": TOOL, "body": BODY}


def known(phi: np.ndarray, **changes) -> Load:
    found = to_com(phi)
    J = found.inertia_com
    six = (J[0, 0], J[0, 1], J[0, 2], J[1, 1], J[1, 2], J[2, 2])
    load = Load(name="tool", mass=found.mass, centre=tuple(found.com), inertia=six)
    return replace(load, **changes)


def true_model(robot: Robot) -> tuple[Model, np.ndarray]:
    model = Model(robot) + "viscous_friction" + "coulomb_friction"
    values = model.given_values()
    values[model.base.rank :] = np.tile([0.3, 0.2, 0.1], 2)
    return model, values


@lru_cache
def recordings(noise: float = 0.01) -> tuple[Model, np.ndarray, dict[str, Recording]]:
    """A model whose masses are wrong, the true parameters, and currents with each load."""
    robot = chain(N, 5)
    model, values = true_model(robot)
    carrying = model + effects_of("payload", robot)
    found, std = {}, np.zeros(N)
    for number, (name, phi) in enumerate(PHI.items(), start=1):
        t, q, v, a = smooth_motion(N, 40 + number, 200.0, 8.0, 8.0, 0.9)
        block = carrying.block(t, q, v, a, carries_payload=True)
        current = carrying.torque(block, np.append(values, phi)) / GAINS
        std = noise * np.sqrt(np.mean(current**2, axis=0)) if not name else std
        current = current + std * np.random.default_rng(number).normal(size=current.shape)
        found[name] = Recording(t, q, current, robot.names, name=f"r{number}", number=number)
    wrong = robot.with_theta(robot.theta * np.repeat([1.3, 0.8, 1.2], 10))
    return replace(model, robot=wrong), values, found


def fitted(
    carried: tuple[str, ...],
    loads: tuple[Load, ...] = (),
    gains: dict[str, float] | None = None,
    **options: float,
) -> DriveGains:
    model, _, found = recordings(**options)
    named = {load.name for load in loads}
    chosen = [found[name].replace(load=name if name in named else "") for name in carried]
    return fit_drive_gains(GainProblem(model, Dataset(tuple(chosen)), gains or {}, loads))


def test_a_known_load_tells_gains_from_inertias() -> None:
    result = fitted(("", "tool"), (known(TOOL),), noise=0.0)
    np.testing.assert_allclose(result.gains, GAINS, rtol=1e-3)
    _, values, _ = recordings(0.0)
    np.testing.assert_allclose(result.values, values, atol=5e-3 * np.abs(values).max())
    assert set(result.findings) == {"identified"}
    assert result.sentence == "Gains, torques and inertias are known in N m and kg."


@pytest.mark.parametrize("fixed_by", ["load", "gain"])
def test_an_unknown_load_is_weighed_where_something_fixes_the_scale(fixed_by: str) -> None:
    loads, gains = (Load(name="body"),), {}
    if fixed_by == "load":
        loads = (known(TOOL), *loads)
    else:
        gains = {"j1": float(GAINS[1])}
    result = fitted(("", "tool", "body") if fixed_by == "load" else ("", "body"), loads, gains)
    body = result.loads[-1]
    truth = to_com(BODY)
    assert body.values[0] == pytest.approx(truth.mass, rel=0.01)
    np.testing.assert_allclose(body.values[1:4], truth.com, atol=0.004)
    assert abs(body.values[0] - truth.mass) < 3 * body.sigma[0]
    assert body.verdict.startswith("possible")
    inside = (result.intervals[:, 0] < GAINS) & (result.intervals[:, 1] > GAINS)
    assert np.all(inside | result.given)


def test_without_a_fixed_scale_only_ratios_are_known() -> None:
    result = fitted(("", "body"), (Load(name="body"),))
    assert result.groups == (("j0", "j1", "j2"),)
    assert "up to the common scale of the drives" in result.sentence
    ratios = np.log(result.gains / GAINS)
    np.testing.assert_allclose(ratios, ratios.mean(), atol=0.02)
    # The mean of a group is what errors are relative to: their sum is none.
    n = len(result.joints)
    np.testing.assert_allclose(result.covariance[:n, :n].sum(axis=1), 0.0, atol=1e-12)
    body = result.loads[0]
    assert body.scale == result.joints
    np.testing.assert_allclose(body.values[1:4], to_com(BODY).com, atol=0.005)
    assert "common scale" in " ".join(body.table().notes)
    assert np.isnan(result.intervals).all()


def test_the_open_scale_is_the_descriptions() -> None:
    """A robot whose masses are all 1.5 times the described shows in the gains, not in masses."""
    _, _, found = recordings(0.0)
    heavy, _ = true_model(chain(N, 5))
    one = found[""]
    right = fit_drive_gains(GainProblem(heavy, Dataset((one,))))
    np.testing.assert_allclose(right.gains, GAINS, rtol=2e-3)
    scaled = replace(heavy, robot=heavy.robot.with_theta(heavy.robot.theta * 1.5))
    larger = fit_drive_gains(GainProblem(scaled, Dataset((one,))))
    np.testing.assert_allclose(larger.gains, 1.5 * GAINS, rtol=2e-3)
    mirrored = fit_drive_gains(GainProblem(heavy, Dataset((one.replace(tau=-one.tau),))))
    np.testing.assert_allclose(mirrored.gains, -GAINS, rtol=2e-3)


def test_gains_follow_the_unit_of_the_currents() -> None:
    model, _, found = recordings()
    load = (known(TOOL),)
    pair = [found[""], found["tool"].replace(load="tool")]
    percent = [one.replace(tau=one.tau * [10.0, 1.0, -20.0]) for one in pair]
    plain = fit_drive_gains(GainProblem(model, Dataset(tuple(pair)), loads=load))
    scaled = fit_drive_gains(GainProblem(model, Dataset(tuple(percent)), loads=load), unit="%")
    np.testing.assert_allclose(scaled.gains * [10.0, 1.0, -20.0], plain.gains, rtol=1e-6)
    np.testing.assert_allclose(scaled.relative_sigma, plain.relative_sigma, rtol=1e-4)
    assert scaled.units == ("N m/%",) * N


def test_joints_that_share_no_inertia_are_not_told_apart() -> None:
    """Two arms on one base: the gain of the one says nothing of the other's."""
    link = (
        '<inertial><origin xyz="0.2 0 0"/><mass value="2"/>'
        '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial>'
    )
    joint = (
        '<joint name="{0}" type="revolute"><parent link="base"/><child link="l{0}"/>'
        '<origin rpy="1.5708 0 0"/><axis xyz="0 0 1"/>'
        '<limit lower="-2" upper="2" velocity="3" effort="90"/></joint><link name="l{0}">'
        f"{link}</link>"
    )
    text = f'<robot name="two"><link name="base"/>{joint.format("a")}{joint.format("b")}</robot>'
    model = Model(Robot.from_text(text)) + "viscous_friction"
    values = model.given_values()
    t, q, v, a = smooth_motion(2, 3, 200.0, 8.0, 8.0)
    current = model.torque(model.block(t, q, v, a), values) / [5.0, 8.0]
    current += 0.01 * np.random.default_rng(0).normal(size=current.shape)
    one = Dataset((Recording(t, q, current, model.robot.names),))
    result = fit_drive_gains(GainProblem(model, one))
    assert result.findings == ("not told apart", "not told apart")
    result = fit_drive_gains(GainProblem(model, one, {"a": 5.0}))
    assert result.findings == ("given", "not told apart")
    assert "of a in N m per unit; of b not at all" in result.sentence


def test_a_load_that_every_recording_carries_is_not_told_from_the_last_link() -> None:
    result = fitted(("body", "body"), (Load(name="body"),), {"j0": float(GAINS[0])})
    assert not result.loads[0].is_whole
    assert "not judged" in result.loads[0].verdict


def test_partly_known_loads_fix_the_scale_too() -> None:
    mass_alone = known(TOOL, centre=None, inertia=None)
    result = fitted(("", "tool"), (mass_alone,))
    np.testing.assert_allclose(result.gains, GAINS, rtol=0.02)
    np.testing.assert_allclose(result.loads[0].values[1:4], to_com(TOOL).com, atol=0.005)
    assert result.loads[0].sigma[0] == 0.0


def test_a_load_may_be_stated_in_another_link_of_the_last_body() -> None:
    text = (
        '<link name="flange"/><joint name="f" type="fixed"><parent link="l2"/>'
        '<child link="flange"/><origin xyz="0.1 -0.2 0.3" rpy="0.4 1.1 -0.7"/></joint></robot>'
    )
    robot = Robot.from_text(chain_text(N, 5).replace("</robot>", text))
    flange = next(link for link in robot.links if link.name == "flange")
    _, _, found = recordings()
    model, _ = true_model(robot)
    there = Load(name="body", link="flange")
    chosen = (found[""], found["body"].replace(load="body"))
    gains = dict(zip(robot.names, GAINS.tolist(), strict=True))
    result = fit_drive_gains(GainProblem(model, Dataset(chosen), gains, (there,)))
    centre = flange.R @ result.loads[0].values[1:4] + flange.p
    np.testing.assert_allclose(centre, to_com(BODY).com, atol=0.004)
    assert result.loads[0].values[0] == pytest.approx(1.4, rel=0.01)


@pytest.mark.parametrize(
    ("gains", "loads", "carried", "what"),
    [
        ({"elbow": 2.0}, (), "", "no joint 'elbow'"),
        ({"j0": 0.0}, (), "", "not zero"),
        ({}, (Load(name="tool"),), "crate", "no load 'crate'"),
        ({}, (Load(name="tool", link="l0"),), "tool", "moves no link 'l0'"),
    ],
)
def test_what_does_not_fit_the_robot_is_refused(gains, loads, carried: str, what: str) -> None:
    model, _, found = recordings()
    one = found[""].replace(load=carried)
    with pytest.raises(StudyError, match=what):
        fit_drive_gains(GainProblem(model, Dataset((one,)), gains, loads))


def test_an_inertia_needs_its_centre() -> None:
    with pytest.raises(StudyError, match="centre"):
        Load(name="tool", mass=1.0, inertia=(1.0, 0.0, 0.0, 1.0, 0.0, 1.0))


def test_the_recorded_motor_gain_effect_is_refused() -> None:
    model, _, found = recordings()
    with pytest.raises(StudyError, match="drive_gain"):
        GainProblem(model + "drive_gain@j0", Dataset((found[""],)))


def test_a_description_that_is_all_wrong_does_not_decide_signs_or_sizes() -> None:
    model, _, found = recordings()
    upside_down = replace(model, robot=model.robot.with_theta(-0.1 * model.robot.theta))
    pair = (found[""], found["tool"].replace(load="tool"))
    load = known(TOOL, centre=None, inertia=None)
    result = fit_drive_gains(GainProblem(upside_down, Dataset(pair), loads=(load,)))
    np.testing.assert_allclose(result.gains, GAINS, rtol=0.02)


def test_what_the_model_lacks_is_said_and_widens_the_errors() -> None:
    model, _, found = recordings()
    pair = (found[""], found["tool"].replace(load="tool"))
    load = (known(TOOL),)
    whole = fit_drive_gains(GainProblem(model, Dataset(pair), loads=load))
    assert whole.doubts == ()
    lacking = fit_drive_gains(GainProblem(replace(model, effects=()), Dataset(pair), loads=load))
    assert "lacks something" in lacking.doubts[0]
    off = np.abs(np.log(lacking.gains / GAINS)) / lacking.relative_sigma
    assert np.all(lacking.relative_sigma > 2 * whole.relative_sigma) and off.max() < 10


def test_rows_around_stops_of_a_joint_that_stands_tell_no_gain() -> None:
    """There its friction is whatever the other torques ask for; every row counts if asked for."""
    gains = np.array([20.0, 10.0])
    found = []
    for ends in ("drop", "keep"):
        some = [standing_arm.record(seed, standing_arm.STOPPED) for seed in (0, 1, 2)]
        settings = replace(default_filter(standing_arm.RATE_HZ), ends=ends)
        data = Dataset(tuple(one.replace(tau=one.tau / gains) for one in some), settings)
        problem = GainProblem(standing_arm.given(), data, {"shoulder": gains[0]})
        found.append(fit_drive_gains(problem))
    without, every = found
    off = [abs(one.gains[1] / gains[1] - 1.0) for one in found]
    assert off[0] < 0.005 and off[0] < off[1] / 3
    assert off[0] < 2 * without.relative_sigma[1] < every.relative_sigma[1]
    assert without.rows < every.rows


@pytest.mark.parametrize("rotors", [(0.0, 0.0, 0.0), (0.5, 0.25, 0.1), (2.0, 1.0, 0.4)])
def test_a_right_description_fixes_the_scale_whatever_rotors_there_are(
    rotors: tuple[float, ...],
) -> None:
    """The first rotor turns as its link does: nothing tells the inertias of the two apart."""
    robot = chain(N, 5)
    model = Model(robot) + "viscous_friction" + "coulomb_friction" + "rotor_inertia"
    values = model.given_values()
    values[model.base.rank :] = [0.3, 0.2, 0.1, 0.3, 0.2, 0.1, *rotors]
    t, q, v, a = smooth_motion(N, 40, 200.0, 8.0, 8.0, 0.9)
    current = model.torque(model.block(t, q, v, a), values) / GAINS
    one = Recording(t, q, current, robot.names, name="r", number=1)
    found = fit_drive_gains(GainProblem(model, Dataset((one,))))
    assert found.is_scaled
    np.testing.assert_allclose(found.gains, GAINS, rtol=0.01)


def test_a_right_description_fixes_the_scale_of_a_robot_without_effects() -> None:
    robot = chain(N, 5)
    model = Model(robot)
    t, q, v, a = smooth_motion(N, 40, 200.0, 8.0, 8.0, 0.9)
    current = model.torque(model.block(t, q, v, a), model.given_values()) / GAINS
    one = Recording(t, q, current, robot.names, name="r", number=1)
    found = fit_drive_gains(GainProblem(model, Dataset((one,))))
    assert found.is_scaled
    np.testing.assert_allclose(found.gains, GAINS, rtol=0.01)


def test_trusted_links_fix_the_scale() -> None:
    """The last link as it truly is, the others as described: a third off."""
    model, values, found = recordings()
    true = chain(N, 5)
    robot = model.robot.with_theta(np.append(model.robot.theta[:20], true.theta[20:]))
    told = replace(model, robot=robot)
    data = Dataset((found[""],))
    open_ = fit_drive_gains(GainProblem(told, data))
    assert open_.is_scaled
    fixed = fit_drive_gains(GainProblem(told, data, trusted=("l2",)))
    assert fixed.findings == ("identified",) * N
    assert np.all(np.abs(np.log(fixed.gains / GAINS)) < 3 * fixed.relative_sigma)
    np.testing.assert_allclose(fixed.gains, GAINS, rtol=0.01)
    np.testing.assert_allclose(fixed.values, values, atol=0.02 * np.abs(values).max())
    # What is trusted stays as it is described.
    held = GainProblem(told, data, trusted=("l2",)).held
    np.testing.assert_array_equal(fixed.values[held], told.given_values()[held])
    every = fit_drive_gains(
        GainProblem(replace(model, robot=true), data, trusted=("l0", "l1", "l2"))
    )
    # Of the last joint nothing but the last link tells.
    assert np.all(every.relative_sigma[:2] < 0.5 * fixed.relative_sigma[:2])
    np.testing.assert_allclose(every.relative_sigma[2], fixed.relative_sigma[2], rtol=1e-3)


def test_trust_in_a_link_that_others_hang_on_says_nothing() -> None:
    """What the upper arm makes shows only with the mass of the forearm at its end."""
    one, theta = recording(1), np.array(arm().theta)
    theta[2] = 0.0  # its first moment across, which shows alone
    model = Model(arm().with_theta(theta))
    first, last = (link.name for link in arm().links if link.joint >= 0)
    assert GainProblem(model, Dataset((one,)), trusted=(last,)).held.any()
    with pytest.raises(StudyError, match=f"trusting {first} fixes nothing"):
        fit_drive_gains(GainProblem(model, Dataset((one,)), trusted=(first,)))
    with pytest.raises(StudyError, match="no moving link 'hand'"):
        fit_drive_gains(GainProblem(model, Dataset((one,)), trusted=("hand",)))
