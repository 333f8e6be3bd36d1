"""Laws of users are effects like ours: the same columns, derivatives, units and forces."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynident as di
from dynident.closed_loop import Mechanism, TrueEffect
from dynident.closed_loop.plant.point_force import can_be_traced
from dynident.effects import Block, Effect, Law, effects_of, law_effect, laws_of
from dynident.effects.laws import LawEntry
from dynident.errors import EffectError, FileError, SimulationError, StudyError
from dynident.fitting import fit
from dynident.formulas import Operation, Signal, Unknown, parse_formula, text_of
from dynident.model import Model
from dynident.recording import Dataset
from synthetic import arm, smooth_motion, synthetic, true_values

ROBOT = arm()
WAVE = Law(name="wave", torque="c*v*sin(k*q + p)", shape=(("k", 1.0, 6.0), ("p", -3.2, 3.2)))
CRANE = """<robot name="crane"><link name="rail"/>
  <link name="trolley"><inertial><mass value="6"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.15"/></inertial></link>
  <link name="boom"><inertial><origin xyz="0.3 0 0"/><mass value="3"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.06"/></inertial></link>
  <joint name="travel" type="prismatic"><parent link="rail"/><child link="trolley"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="1" effort="500"/></joint>
  <joint name="swing" type="revolute"><parent link="trolley"/><child link="boom"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="3" effort="100"/></joint></robot>"""


def block(seed: int = 0, width: float = 0.05) -> Block:
    t, q, v, a = smooth_motion(2, seed, 100.0, 4.0, 4.0)
    torque = ROBOT.inverse_dynamics(q, v, a)
    degrees = 20.0 + np.column_stack([t, 2 * t])
    made = Model(ROBOT, (), width).block(t, q, v, a, temperature=degrees)
    return replace(made, torque=torque)


def law(torque: str, **shape: tuple[float, float]) -> Effect:
    ranges = tuple((name, *limits) for name, limits in shape.items())
    return law_effect(Law(name="mine", torque=torque, shape=ranges))("elbow").on(ROBOT)


@pytest.mark.parametrize(
    ("torque", "label"),
    [
        ("c*v", "viscous_friction@elbow"),
        ("c*sign(v)", "coulomb_friction@elbow"),
        ("c*v*abs(v)", "quadratic_drag@elbow"),
        ("c", "torque_offset@elbow"),
        ("c*abs(load)*sign(v)", "load_friction@elbow"),
        ("k*q + c", "joint_spring@elbow"),
        ("s*sin(3*q) + c*cos(3*q)", "torque_ripple@elbow"),
    ],
)
def test_the_catalogue_can_be_written_as_laws(torque: str, label: str) -> None:
    (ours,) = effects_of(label, ROBOT)
    if label.startswith("torque_ripple"):
        ours = ours.shaped(3.0)
    np.testing.assert_allclose(law(torque).columns(block()), ours.columns(block()), atol=1e-12)
    units = [one.unit for one in law(torque).parameters(ROBOT)]
    assert units == [one.unit for one in ours.parameters(ROBOT)]


def test_the_stribeck_law_is_ours_at_every_shape() -> None:
    mine = law("c*sign(v)*exp(-(v/w)^2)", w=(0.01, 2.0))
    (ours,) = effects_of("stribeck_friction@elbow", ROBOT)
    for speed in (0.02, 0.3, 1.5):
        expected = ours.shaped(speed).columns(block())
        np.testing.assert_allclose(mine.shaped(speed).columns(block()), expected, atol=1e-12)


def test_signals_of_other_joints_and_of_the_session() -> None:
    b = block()
    found = law("c*v*v[shoulder] + d*t + e*(temperature - temperature[shoulder])").columns(b)
    v, degrees = b.v, np.asarray(b.temperature)
    expected = [v[:, 1] * v[:, 0], b.t, degrees[:, 1] - degrees[:, 0]]
    np.testing.assert_allclose(found[:, 1].T, expected, atol=1e-12)
    assert not np.any(found[:, 0])


@pytest.mark.parametrize(
    ("torque", "shape"),
    [
        ("c*v*sin(k*q + p)", {"k": (1.0, 6.0), "p": (-3.2, 3.2)}),
        ("c*sign(v)*exp(-(v/w)^2) + d*v/(1 + (q/u)^2)", {"w": (0.1, 2.0), "u": (0.2, 3.0)}),
        ("c*tanh((q - z)/w)*load[shoulder]", {"z": (-1.0, 1.0), "w": (0.1, 1.0)}),
        ("c*abs(q - z)*sign(v + k*v[shoulder])", {"z": (-4.0, -3.0), "k": (-2.0, 2.0)}),
    ],
)
def test_derivatives_by_coordinates_are_exact(torque: str, shape) -> None:
    effect = law(torque, **shape)
    found = effect.sensitivities(block())
    assert found is not None
    for k, one in enumerate(effect.shape_parameters(ROBOT)):
        sides = []
        for step in (1e-5, -1e-5):
            moved = list(effect.shape)
            moved[k] = one.at(one.coordinate(moved[k]) + step)
            sides.append(effect.shaped(*moved).columns(block()))
        expected = (sides[0] - sides[1]) / 2e-5
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found[..., k], expected, atol=1e-6 * scale)
        assert scale > 0


def test_its_force_in_a_simulation_is_its_columns_and_is_compiled() -> None:
    effect = law_effect(WAVE)("elbow").on(ROBOT)
    b = block()
    mechanism = Mechanism.of(ROBOT, [TrueEffect(effect, (0.4,))])
    needed = mechanism.command(b.t, b.q, b.v, b.a) - ROBOT.inverse_dynamics(b.q, b.v, b.a)
    np.testing.assert_allclose(needed, effect.columns(b)[..., 0] * 0.4, atol=1e-10)
    assert can_be_traced(mechanism)


@pytest.mark.parametrize("torque", ["c*a", "c*load*v", "c*temperature*v"])
def test_what_cannot_be_simulated_is_refused(torque: str) -> None:
    with pytest.raises(SimulationError, match="cannot be simulated") as caught:
        Mechanism.of(ROBOT, [TrueEffect(law(torque), (0.1,))])
    assert caught.value.remedy


def test_equal_laws_are_one_class_and_travel() -> None:
    again = Law(name="wave", torque="c*v*sin(k*q + p)", shape=(("k", 1.0, 6.0), ("p", -3.2, 3.2)))
    assert law_effect(again) is law_effect(WAVE)
    effect = law_effect(WAVE)("elbow").on(ROBOT)
    assert pickle.loads(pickle.dumps(effect)) == effect


def test_two_laws_may_call_a_parameter_alike() -> None:
    other = Law(name="other", torque="c*q^3")
    model = Model(ROBOT, laws=(WAVE, other)) + "law:wave@elbow" + "law:other@elbow"
    assert model.names[-2:] == ("wave.c@elbow", "other.c@elbow")
    assert model.units[-2:] == ("N m s/rad", "N m/rad^3")


def test_a_law_sits_where_its_units_make_sense() -> None:
    from dynident.robot import Robot

    crane = Robot.from_text(CRANE)
    turning = law_effect(Law(name="gravity", torque="c*cos(q)"))
    assert [one.label for one in turning.candidates(crane)] == ["law:gravity@swing"]
    with pytest.raises(EffectError, match="cos"):
        turning("travel").on(crane)
    everywhere = law_effect(Law(name="drag", torque="c*v*abs(v)"))
    units = [one.parameters(crane)[0].unit for one in everywhere.candidates(crane)]
    assert units == ["N s^2/m^2", "N m s^2/rad^2"]


def test_a_law_of_no_joint_says_why() -> None:
    nonsense = Law(name="nonsense", torque="c*sin(v)")
    assert not list(law_effect(nonsense).candidates(ROBOT))
    with pytest.raises(EffectError, match="rad/s"):
        effects_of("law:nonsense", ROBOT, [nonsense])
    with pytest.raises(EffectError, match="no joint 'wrist'"):
        effects_of("law:far", ROBOT, [Law(name="far", torque="c*v[wrist]")])


@pytest.mark.parametrize(
    ("torque", "q"),
    [("c/q", 0.0), ("c*sqrt(q)*v", -1.0), ("c*exp(q/0.001)", 1.0)],
)
def test_what_is_not_finite_is_said_with_the_place(torque: str, q: float) -> None:
    b = block()
    b.q[7, 1] = q
    model = Model(ROBOT, (law(torque),))
    with pytest.raises(EffectError, match="is not finite at q"):
        model.columns(b)


def test_misspelt_laws_are_answered_with_the_right_one() -> None:
    with pytest.raises(EffectError, match="did you mean 'law:wave'"):
        effects_of("law:wafe@elbow", ROBOT, [WAVE])
    with pytest.raises(EffectError, match="none is stated"):
        effects_of("law:wave@elbow", ROBOT)


def test_grids_are_within_their_ranges_and_not_too_many() -> None:
    wide = Law(
        name="wide",
        torque="c*sin(k*q + p)*exp(-(v/w)^2)*tanh(q/u)",
        shape=(("k", 1.0, 500.0), ("p", -3.2, 3.2), ("w", 0.01, 2.0), ("u", 0.1, 0.2)),
    )
    effect = law_effect(wide)("elbow").on(ROBOT)
    assert 50 < len(list(effect.variants(ROBOT))) <= 400
    for one in effect.shape_parameters(ROBOT):
        assert all(one.lower <= x <= one.upper for x in one.grid)
        assert list(one.grid) == sorted(set(one.grid))


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"name": "a b"}, "no name"),
        ({"name": ""}, "no name"),
        ({"shape": (("k", 2.0, 1.0), ("p", 0.0, 1.0))}, "no range"),
        ({"shape": (("k", 0.0, float("nan")), ("p", 0.0, 1.0))}, "no range"),
        ({"shape": (("k", 1.0, 2.0), ("k", 1.0, 2.0), ("p", 0.0, 1.0))}, "two ranges"),
        ({"shape": (("k", 1.0, 2.0),)}, "'p' stands inside sin"),
        ({"torque": "c*eval(q)"}, "calls 'eval'"),
        ({"torque": "c*sin(k*p)"}, "a constant has no shape"),
    ],
)
def test_wrong_laws_are_refused(wrong, says: str) -> None:
    with pytest.raises(EffectError, match=says):
        replace(WAVE, **wrong)


# --- files of laws --------------------------------------------------------------------------------


def test_laws_are_shared_by_files(tmp_path: Path) -> None:
    shared = tmp_path / "lab.toml"
    shared.write_text(
        '[laws.wave]\ntorque = "c*v*sin(k*q + p)"\nshape = { k = [1, 6], p = [-3.2, 3.2] }\n'
        '[laws.drag]\ntorque = "c*v^3"\n'
    )
    study = tmp_path / "study.toml"
    drag = Law(name="drag", torque="c*v^3")
    own, lab = LawEntry(torque="c*q^3"), LawEntry(file="lab.toml")
    assert laws_of({"lab": lab}, study) == (WAVE, drag)
    both = laws_of({"mine": own, "ours": lab}, study)
    assert both == (Law(name="mine", torque="c*q^3"), WAVE, drag)
    with pytest.raises(StudyError, match="another law"):
        laws_of({"drag": own, "ours": lab}, study)
    with pytest.raises(FileError, match=r"none\.toml"):
        laws_of({"lab": LawEntry(file="none.toml")}, study)
    shared.write_text('[laws.bad]\ntorque = "c*sin(k*q)"\n')
    with pytest.raises(StudyError, match=r"laws\.bad.*'k' stands inside sin"):
        laws_of({"lab": lab}, study)
    shared.write_text('[laws]\nmore = "other.toml"\n')
    with pytest.raises(StudyError, match="names another"):
        laws_of({"lab": lab}, study)


def test_a_law_of_another_robots_file_is_no_obstacle(tmp_path: Path) -> None:
    from dynident.errors import DynidentWarning
    from study_files import write_study

    (tmp_path / "lab.toml").write_text('[laws.far]\ntorque = "c*v*v[wrist]"\n')
    path = write_study(tmp_path)
    path.write_text('laws = "lab.toml"\n' + path.read_text())
    with pytest.warns(DynidentWarning, match="no joint 'wrist'"):
        study = di.load(path)
    assert [one.name for one in study.model.laws] == ["far"]


def test_a_shape_at_which_a_law_is_no_number_is_passed_over() -> None:
    """Of c sqrt(q + p) many p are none: the fit takes those that are."""
    root = law_effect(Law(name="root", torque="c*sqrt(q + p)*v", shape=(("p", -1.0, 5.0),)))
    true = root("elbow", shape=(3.0,)).on(ROBOT)
    model = Model(ROBOT, (true,))
    values = true_values(model)
    values[-1] = 0.4
    data = Dataset((synthetic(model, values, 2, torque_std=0.01),))
    start = Model(ROBOT, (root("elbow", shape=(2.5,)),))
    found = fit(start, data)
    assert found.shapes[0].value == pytest.approx(3.0, abs=0.2)


def test_a_root_has_a_slope_where_it_is_zero() -> None:
    half = Law(name="half", torque="c*sign(v)*exp(-sqrt(abs(v)/w))", shape=(("w", 0.01, 2.0),))
    b = block()
    b.v[3] = 0.0
    slopes = law_effect(half)("elbow").on(ROBOT).sensitivities(b)
    assert slopes is not None and np.all(np.isfinite(slopes))


@pytest.mark.parametrize("name", ['a"b', "lambda", "None", "arm^1", "left arm", "back\\slash"])
def test_any_name_of_a_joint_can_be_written(name: str) -> None:
    text = text_of(Operation("*", (Unknown("c"), Signal("q", name))))
    assert parse_formula(text) == Operation("*", (Unknown("c"), Signal("q", name)))
