"""The contract that every effect of the catalogue keeps; a new effect is tested by being there."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynident.closed_loop import Mechanism, TrueEffect
from dynident.effects import Block, Effect, Needs, catalogue, effects_of
from dynident.effects.effect import force_unit, motion_unit
from dynident.errors import EffectError
from dynident.model import Model
from dynident.robot import Robot
from synthetic import smooth_motion

CRANE = """<robot name="crane">
  <link name="rail"/>
  <link name="trolley"><inertial><origin xyz="0.05 0 0.1"/><mass value="6"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.15"/></inertial></link>
  <link name="boom"><inertial><origin xyz="0.3 0.02 -0.05"/><mass value="3"/>
    <inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.05" iyz="0" izz="0.06"/></inertial></link>
  <link name="hook"><inertial><origin xyz="0 0.01 -0.2"/><mass value="1.5"/>
    <inertia ixx="0.01" ixy="0" ixz="0.001" iyy="0.012" iyz="0" izz="0.004"/></inertial></link>
  <joint name="travel" type="prismatic"><parent link="rail"/><child link="trolley"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="1" effort="500"/></joint>
  <joint name="swing" type="revolute"><parent link="trolley"/><child link="boom"/>
    <origin xyz="0 0 0.3" rpy="0.2 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="3" effort="100"/></joint>
  <joint name="hoist" type="prismatic"><parent link="boom"/><child link="hook"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-0.5" upper="0.5" velocity="1" effort="200"/></joint>
</robot>"""
ROBOT = Robot.from_text(CRANE)
SAMPLES = 25
ARRAYS = ("t", "q", "v", "a", "rigid", "torque", "temperature")


def every_place() -> list[Effect]:
    return [one.on(ROBOT) for kind in catalogue().values() for one in kind.candidates(ROBOT)]


EVERY = pytest.mark.parametrize("effect", every_place(), ids=lambda effect: effect.label)
EACH = pytest.mark.parametrize("kind", catalogue().values(), ids=list(catalogue()))


def motion(seed: int, *, whole: bool = False) -> tuple[np.ndarray, ...]:
    """t, q, v, a; speeds from far below the width of dry friction to full.

    Whole recordings are smooth, and their clock is uniform.
    """
    if whole:
        return smooth_motion(ROBOT.n, seed, 200.0, 0.6, 2.0, amplitude=0.2)
    q, v, a = ROBOT.random_motion(seed, SAMPLES)
    rng = np.random.default_rng(seed)
    v = v * rng.choice([1e-3, 1e-2, 0.1, 1.0], (SAMPLES, 1))
    return np.sort(np.append(0.0, rng.uniform(0, 100, SAMPLES - 1))), q, v, a


def block_of(effect: Effect | type[Effect], seed: int, *, carries_payload: bool = True) -> Block:
    """Samples with everything that some effect needs of them."""
    t, q, v, a = motion(seed, whole=Needs.RECORDING in effect.needs)
    return Block(
        t,
        q,
        v,
        a,
        names=ROBOT.names,
        carries_payload=carries_payload,
        rigid=ROBOT.regressor(q, v, a),
        torque=ROBOT.inverse_dynamics(q, v, a),
        body=ROBOT,
        rotor=np.array([0.5, 0.02, 0.1]),
        number=1,
    )


def warm(block: Block) -> Block:
    """The same samples with recorded temperatures of the motors."""
    rng = np.random.default_rng(11)
    return replace(block, temperature=rng.uniform(20.0, 60.0, block.q.shape))


def simulable(effect: Effect, values) -> bool:
    """Whether its torque follows from one instant's motion alone, so that it can be compared."""
    return (
        not effect.memory
        and effect.simulated_transmission(tuple(values), ROBOT) is None
        and not np.any(effect.simulated_delay(tuple(values), ROBOT))
    )


def random_values(effect: Effect, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    parameters = effect.parameters(ROBOT)
    lower = np.array([max(one.lower, -3.0) for one in parameters])
    upper = np.array([min(one.upper, 3.0) for one in parameters])
    return rng.uniform(lower, upper)


@EVERY
def test_columns_are_finite_and_of_one_shape(effect: Effect) -> None:
    block = block_of(effect, 0)
    for samples in (block, warm(block)):
        columns = effect.columns(samples)
        assert columns.shape == (*block.q.shape, len(effect.parameters(ROBOT)))
        assert columns.dtype == np.float64
        assert np.isfinite(columns).all()


@EACH
def test_every_effect_can_be_seen_somewhere(kind: type[Effect]) -> None:
    block = block_of(kind, 0)
    assert any(np.any(one.on(ROBOT).columns(block)) for one in kind.candidates(ROBOT))


@EVERY
def test_columns_of_one_sample_are_those_of_many(effect: Effect) -> None:
    if effect.needs_recording:  # its columns depend on what went before
        return
    block = warm(block_of(effect, 1))
    one = replace(block, **{name: getattr(block, name)[7:8] for name in ARRAYS})
    np.testing.assert_allclose(effect.columns(one)[0], effect.columns(block)[7], atol=1e-13)


@EVERY
def test_columns_change_nothing_in_the_block(effect: Effect) -> None:
    block, twin = warm(block_of(effect, 2)), warm(block_of(effect, 2))
    effect.columns(block)
    effect.simulated_force(tuple(random_values(effect, 0)), block)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(block, name), getattr(twin, name))


@EVERY
def test_zero_parameters_give_zero_torque(effect: Effect) -> None:
    values = (0.0,) * len(effect.parameters(ROBOT))
    block = block_of(effect, 3)
    assert not np.any(effect.at(values).columns(block) @ np.array(values))
    assert not np.any(effect.simulated_loss(values, ROBOT))
    assert not np.any(effect.simulated_delay(values, ROBOT))
    if not simulable(effect, values):
        return
    t, q, v, a = motion(3)
    mechanism = Mechanism.of(ROBOT, [TrueEffect(effect, values)], carries_payload=True)
    rigid = ROBOT.inverse_dynamics(q, v, a)
    np.testing.assert_allclose(mechanism.command(t, q, v, a), rigid, atol=1e-10)


@EVERY
@settings(max_examples=5, derandomize=True)
@given(seed=st.integers(0, 10_000))
def test_columns_are_the_torque_that_the_simulator_needs(effect: Effect, seed: int) -> None:
    """Command for a motion, from all ways of acting, less the rigid robot's torque."""
    values = random_values(effect, seed)
    if not simulable(effect, values):
        return
    t, q, v, a = motion(seed)
    truth = TrueEffect(effect, tuple(values))
    mechanism = Mechanism.of(ROBOT, [truth], carries_payload=True).numbered(1)
    rigid = ROBOT.inverse_dynamics(q, v, a)
    needed = mechanism.command(t, q, v, a) - rigid
    found = effect.at(values.tolist()).columns(block_of(effect, seed)) @ values
    scale = np.abs(needed).max() + np.abs(rigid).max()
    np.testing.assert_allclose(found, needed, rtol=1e-9, atol=1e-11 * scale)


@EVERY
def test_chords_tend_to_the_derivative(effect: Effect) -> None:
    values = random_values(effect, 6)
    if not effect.nonlinear:
        assert effect.at(values.tolist()) is effect
        return
    if effect.simulated_transmission(tuple(values), ROBOT):  # it has no derivative at zero
        return
    block = block_of(effect, 6)
    derivative = effect.columns(block)
    limit = np.abs(derivative).max()
    # At its ends, what a recording does not hold is made up.
    inner = slice(2, -2) if effect.needs_recording else slice(None)
    for size in (0.0, 1e-9, 1e-5, 1e-4):
        chord = effect.at((size * values).tolist()).columns(block)
        room = (1e-9 + 1e3 * size) * limit
        np.testing.assert_allclose(chord[inner], derivative[inner], atol=room)


@EVERY
def test_sensitivities_are_the_derivatives_of_the_columns(effect: Effect) -> None:
    """By the logarithm of each shape parameter, against central differences."""
    block = block_of(effect, 8)
    found = effect.sensitivities(block)
    shapes = effect.shape_parameters(ROBOT)
    if found is None or effect.simulated_transmission((1e-3,), ROBOT):
        return  # what gives way changes its contacts: differences say nothing of it
    assert found.shape == (*effect.columns(block).shape, len(shapes))
    step = 1e-5
    for k in range(len(shapes)):
        sides = []
        for sign in (1.0, -1.0):
            shape = list(effect.shape)
            shape[k] *= np.exp(sign * step)
            sides.append(effect.shaped(*shape).columns(block))
        expected = (sides[0] - sides[1]) / (2 * step)
        limit = np.abs(effect.columns(block)).max() + np.abs(expected).max()
        np.testing.assert_allclose(found[..., k], expected, atol=1e-5 * limit)


@EVERY
def test_payload_acts_only_where_it_is_on_board(effect: Effect) -> None:
    without = effect.columns(block_of(effect, 4, carries_payload=False))
    if effect.is_payload:
        assert not np.any(without)
        t, q, v, a = motion(4)
        truth = TrueEffect(effect, tuple(random_values(effect, 4)))
        bare = Mechanism.of(ROBOT, [truth], carries_payload=False)
        np.testing.assert_array_equal(bare.command(t, q, v, a), ROBOT.inverse_dynamics(q, v, a))
    else:
        np.testing.assert_array_equal(without, effect.columns(block_of(effect, 4)))


@EVERY
def test_terms_of_the_simulator_are_the_simulated_force(effect: Effect) -> None:
    """For values of either sign: an estimate on its way has no bounds."""
    values = np.random.default_rng(7).normal(size=len(effect.parameters(ROBOT)))
    terms = effect.simulated_terms(tuple(values), ROBOT)
    if terms is None:  # it is evaluated in Python
        return
    block = block_of(effect, 7)
    laws = {
        "constant": lambda x, v: np.ones(len(block.t)),
        "position": lambda x, v: x,
        "speed": lambda x, v: v,
        "sign": lambda x, v: np.tanh(v / block.friction_width),
        "magnitude": lambda x, v: np.abs(v),
    }
    total = np.zeros_like(block.q)
    for term in terms:
        of = list(term.of)
        motion = block.q[:, of].sum(axis=1), block.v[:, of].sum(axis=1)
        total[:, term.at] += term.coefficient * laws[term.law](*motion)
    expected = effect.simulated_force(values.tolist(), block)
    np.testing.assert_allclose(total, expected, rtol=1e-12, atol=1e-13)


@EVERY
def test_units_are_those_of_a_torque(effect: Effect) -> None:
    """A column's unit times its parameter's is N m at a revolute joint and N at a prismatic one."""
    parameters = effect.parameters(ROBOT)
    assert parameters
    names = [one.name for one in parameters]
    assert len(set(names)) == len(names)
    for one in (*parameters, *effect.shape_parameters(ROBOT)):
        assert one.unit and one.unit == one.unit.strip()
    if effect.joint is None:
        return
    assert force_unit(ROBOT, effect.joint) == ("N m" if effect.joint == "swing" else "N")
    other = effect.source or effect.joint
    length = motion_unit(ROBOT, other)
    for one in parameters:
        force = force_unit(ROBOT, effect.joint)
        inertia = {"N m": "kg m^2", "N": "kg"}[force]
        power = r"(\^2)?"
        valid = [
            "1",
            re.escape(force),
            re.escape(force) + rf"/{length}",
            re.escape(force) + rf" s{power}/{length}{power}",
            re.escape(inertia),
            # Torques that are not linear in the parameter, or have another quantity as their unit.
            re.escape(force) + "/s",
            length,
            "s",
            {"rad": r"rad/\(N m\)", "m": "m/N"}[length],
        ]
        assert any(re.fullmatch(unit, one.unit) for unit in valid), f"{one.name}: {one.unit}"


@EVERY
def test_bounds_leave_room_and_hold_the_grid(effect: Effect) -> None:
    for parameter in effect.parameters(ROBOT):
        assert parameter.lower < parameter.upper
        assert parameter.lower <= 0 <= parameter.upper, "no effect at all must be possible"
    for shape in effect.shape_parameters(ROBOT):
        assert shape.lower < shape.upper
        assert all(shape.lower <= value <= shape.upper for value in shape.grid)
        assert list(shape.grid) == sorted(set(shape.grid))
    block = block_of(effect, 0)
    for k, shape in enumerate(effect.shape_parameters(ROBOT)):
        for value in (shape.lower, shape.upper):
            values = [*effect.shape[:k], value, *effect.shape[k + 1 :]]
            assert np.isfinite(effect.shaped(*values).on(ROBOT).columns(block)).all()


@EVERY
def test_shape_outside_its_bounds_is_refused(effect: Effect) -> None:
    wanted = effect.shape_parameters(ROBOT)
    for k, shape in enumerate(wanted):
        for value in (shape.lower - 1e-3 * shape.upper, shape.upper * 1.01, np.nan):
            values = [one.grid[0] for one in wanted]
            values[k] = value
            with pytest.raises(EffectError, match=shape.name):
                effect.shaped(*values).on(ROBOT)
    with pytest.raises(EffectError, match="shape"):
        effect.shaped(*[1.0] * (len(wanted) + 1)).on(ROBOT)


@EVERY
def test_label_and_words(effect: Effect) -> None:
    assert effects_of(effect.label, ROBOT) == (effect,)
    assert effect.label in Model(ROBOT, (effect,))
    advice = effect.advice
    assert "{" not in advice and "None" not in advice
    for joint in (effect.joint, effect.source):
        assert joint is None or (joint in advice and joint in effect.title)


@EACH
def test_what_a_class_says_of_itself(kind: type[Effect]) -> None:
    known = catalogue()
    assert known[kind.name] is kind
    assert kind.law and kind.sign_of and kind.experiment
    for other in (*kind.confounded_with, *kind.contains):
        assert other in known, f"{other} is not (yet) in the catalogue"
        assert other != kind.name
    assert isinstance(kind.needs, Needs)
    assert Needs.TORQUE in kind.needs or not kind.linear_in_torque
    assert list(kind.candidates(ROBOT)), "it can be nowhere"


@EVERY
def test_a_block_carries_no_more_than_the_effect_needs(effect: Effect) -> None:
    """What an effect does not say that it needs may be missing, and changes nothing."""
    block = warm(block_of(effect, 9))
    carried = {"rigid": Needs.REGRESSOR, "torque": Needs.TORQUE, "body": Needs.BODIES}
    spared = {name: None for name, need in carried.items() if need not in effect.needs}
    np.testing.assert_array_equal(effect.columns(replace(block, **spared)), effect.columns(block))


@EVERY
def test_traits_agree_with_the_needs(effect: Effect) -> None:
    model = Model(ROBOT, (effect,))
    assert model.needs_values == (effect.depends_on_fit or effect.nonlinear)
    assert effect.is_instantaneous == (
        not effect.needs & (Needs.TORQUE | Needs.BODIES | Needs.RECORDING)
    )
    assert effect.is_dynamic_response == (Needs.BODIES | Needs.RECORDING in effect.needs)
    assert effect.acting_columns(block_of(effect, 0)).shape[1] == len(effect.acting_at(ROBOT))
    if effect.linear_in_torque:
        block = block_of(effect, 10)
        twice = replace(block, torque=2.0 * np.asarray(block.torque))
        np.testing.assert_array_equal(effect.columns(twice), 2.0 * effect.columns(block))


@EACH
def test_contained_effects_are_combinations_of_the_columns(kind: type[Effect]) -> None:
    for effect in (one.on(ROBOT) for one in kind.candidates(ROBOT)):
        block = block_of(effect, 5)
        wide = effect.columns(block).reshape(block.q.size, -1)
        for name in kind.contains:
            (simple,) = effects_of(f"{name}@{effect.joint}", ROBOT)
            narrow = simple.columns(block).reshape(block.q.size, -1)
            rest = narrow - wide @ np.linalg.lstsq(wide, narrow, rcond=None)[0]
            assert np.abs(rest).max() < 1e-10


@EACH
def test_wrong_places_are_refused(kind: type[Effect]) -> None:
    wrong = {
        "joint": [kind(), kind("swimg"), kind("swing", "hoist")],
        "pair": [
            kind("swing"),
            kind("swing", "swing"),
            kind("swing", "hoits"),
            kind("swimg", "swing"),
        ],
        "robot": [kind("swing")],
        "joint or robot": [kind("swimg"), kind("swing", "hoist"), kind(None, "hoist")],
    }[kind.place]
    for effect in wrong:
        with pytest.raises(EffectError) as caught:
            effect.on(ROBOT)
        assert kind.name in str(caught.value)
        assert caught.value.remedy
    if kind.place != "robot":
        with pytest.raises(EffectError, match="travel, swing, hoist"):
            kind("swimg", "hoist" if kind.place == "pair" else None).on(ROBOT)


@EACH
def test_true_effects_refuse_wrong_values(kind: type[Effect]) -> None:
    effect = next(iter(kind.candidates(ROBOT))).on(ROBOT)
    parameters = effect.parameters(ROBOT)
    with pytest.raises(EffectError, match="give"):
        TrueEffect.of(effect.label, ROBOT, [1.0] * (len(parameters) + 1))
    with pytest.raises(EffectError, match="did you mean"):
        TrueEffect.of(effect.label, ROBOT, {parameters[0].name + "x": 1.0})
    for parameter in parameters:
        with pytest.raises(EffectError, match="choose it between"):
            TrueEffect.of(effect.label, ROBOT, {parameter.name: np.nan})
        if np.isfinite(parameter.lower):
            with pytest.raises(EffectError, match="choose it between"):
                TrueEffect.of(effect.label, ROBOT, {parameter.name: parameter.lower - 1.0})


def test_labels_without_a_joint_stand_for_every_place() -> None:
    assert [one.label for one in effects_of("viscous_friction", ROBOT)] == [
        "viscous_friction@travel",
        "viscous_friction@swing",
        "viscous_friction@hoist",
    ]
    assert len(effects_of("joint_coupling", ROBOT)) == 6
    assert [one.label for one in effects_of("payload", ROBOT)] == ["payload"]
    (pair,) = effects_of("joint_coupling@swing:hoist", ROBOT)
    assert (pair.joint, pair.source) == ("swing", "hoist")


@pytest.mark.parametrize("name", list(catalogue()))
def test_a_misspelt_name_is_answered_with_the_right_one(name: str) -> None:
    misspelt = name[:3] + name[4:]
    with pytest.raises(EffectError, match=f"did you mean '{name}'"):
        effects_of(misspelt, ROBOT)


def test_a_strange_name_is_answered_with_all() -> None:
    with pytest.raises(EffectError) as caught:
        effects_of("zzz", ROBOT)
    for name in catalogue():
        assert name in str(caught.value)


def test_true_effects_by_name_leave_the_rest_at_zero() -> None:
    (spring,) = TrueEffect.of("joint_spring@swing", ROBOT, {"k": 2.0})
    assert spring.values == (2.0, 0.0)
    (stribeck,) = TrueEffect.of("stribeck_friction@swing", ROBOT, {"Fs": 1.0}, {"vs": 0.1})
    assert stribeck.effect.shape == (0.1,)
    with pytest.raises(EffectError, match="did you mean 'vs'"):
        TrueEffect.of("stribeck_friction@swing", ROBOT, {"Fs": 1.0}, {"vss": 0.1})
    with pytest.raises(EffectError, match="twice"):
        Mechanism.of(ROBOT, [spring, spring])
