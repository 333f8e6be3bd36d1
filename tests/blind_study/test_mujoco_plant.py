"""MuJoCo as the blind study's second plant: its physics against laws that need no simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import special

from blind_study.circumstances import Circumstances
from blind_study.foreign import EFFECTS
from blind_study.mujoco_lab import MujocoLaboratory, MujocoRun
from blind_study.mujoco_machine import bare, build
from blind_study.mujoco_plant import Loop, Plant, needed
from blind_study.robots import specimen
from blind_study.strengths import KNOWN, start
from dynident.closed_loop import Fourier, TrueEffect
from dynident.effects import catalogue
from dynident.fitting import fit
from dynident.model import Model
from dynident.recording import Dataset
from dynident.robot import Robot

SMOOTH = Circumstances(
    friction="tanh",
    time_constant=1e-3,
    rate_hz=500.0,
    repetition="stated",
    jitter=0.0,
    feedforward="nominal",
)
TIGHT = replace(SMOOTH, friction="constraint")
WIDTH = 0.02


def still(samples: int, n: int, push: np.ndarray) -> Loop:
    """A loop without gains that pushes with constant torques, from rest."""
    none = np.zeros((samples, n))
    return Loop(
        t=np.arange(samples) / 500.0,
        q_ref=none,
        v_ref=none,
        ahead=none + push,
        kp=np.zeros(n),
        kd=np.zeros(n),
        cutoff_hz=80.0,
        rate_hz=500.0,
        noise=none,
        resolution=np.zeros(n),
        wrong=None,
    )


def test_inverse_dynamics_is_that_of_the_regressor() -> None:
    robot = specimen(3, 500.0, np.random.default_rng(2)).robot
    q, v, a = robot.random_motion(5, 40)
    ours = robot.regressor(q, v, a) @ robot.theta
    np.testing.assert_allclose(needed(robot, q, v, a), ours, atol=1e-6)


PENDULUM = """<robot name="pendulum"><link name="base"/><link name="bob"><inertial>
  <origin xyz="0.3 0 0"/><mass value="2"/>
  <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial></link>
  <joint name="pivot" type="continuous"><parent link="base"/><child link="bob"/>
  <axis xyz="0 1 0"/></joint></robot>"""


def test_a_pendulum_keeps_its_energy_and_its_exact_period() -> None:
    plant = Plant(bare(Robot.from_text(PENDULUM)), 0.0)
    inertia, weight = 0.05 + 2.0 * 0.3**2, 2.0 * 9.81 * 0.3
    # Let go at the horizontal: a quarter turn from where it hangs.
    period = 4.0 * special.ellipk(np.sin(np.pi / 4) ** 2) * np.sqrt(inertia / weight)
    loop = still(round(500 * 3 * period) + 20, 1, np.zeros(1))
    q, _ = plant.run(loop, "swings")
    t, angle = loop.t, q[:, 0]
    v = np.gradient(angle, t)
    energy = inertia * v**2 / 2 - weight * np.sin(angle)
    assert np.abs(angle).max() == pytest.approx(np.pi, abs=2e-3)
    assert np.abs(energy[2:-2]).max() < 2e-3 * weight
    turns = np.flatnonzero((v[:-1] < 0) & (v[1:] >= 0))
    assert t[turns[-1]] / len(turns) == pytest.approx(period, rel=2e-3)


def test_dry_friction_of_the_constraint_holds_below_its_level_and_slides_above() -> None:
    made = specimen(2, 500.0, np.random.default_rng(3))
    level = TrueEffect(catalogue()["coulomb_friction"](made.robot.names[0]).on(made.robot), (2.0,))
    # Without weight only the push and the friction act.
    weightless = made.robot.with_gravity(np.zeros(3))
    plant = Plant(build(weightless, [level], TIGHT, 1, carries_payload=False), 0.0)
    q, _ = plant.run(still(500, 2, np.array([1.8, 0.0])), "held")
    assert np.abs(q[-1, 0]) < 3e-3
    q, _ = plant.run(still(500, 2, np.array([2.4, 0.0])), "slides")
    assert q[-1, 0] > 0.05


def test_springs_tilt_payload_and_gain_are_what_they_say() -> None:
    made = specimen(3, 500.0, np.random.default_rng(4))
    robot, names = made.robot, made.robot.names
    spring = TrueEffect(catalogue()["joint_spring"](names[1]).on(robot), (3.0, 0.6))
    gain = TrueEffect(catalogue()["drive_gain"](names[2]).on(robot), (0.25,))
    machine = build(robot, [spring, gain], SMOOTH, 1, carries_payload=False).machine
    assert machine.stiffness[1] * (0.4 - machine.rest[1]) == pytest.approx(3.0 * 0.4 + 0.6)
    assert machine.drive[2] == pytest.approx(0.8)
    tilt = TrueEffect(catalogue()["base_tilt"]().on(robot), (0.05, -0.02))
    gravity = build(robot, [tilt], SMOOTH, 1, carries_payload=False).machine.gravity
    assert np.linalg.norm(gravity) == pytest.approx(9.81)
    # In the axes of a base that is turned by r, gravity is turned by -r.
    turned = -np.cross([0.05, -0.02, 0.0], robot.gravity)
    np.testing.assert_allclose(gravity[:2], turned[:2], atol=1e-2)


def test_a_gap_lets_the_link_move_by_its_width() -> None:
    made = specimen(2, 500.0, np.random.default_rng(5))
    name = made.robot.names[1]
    rotor = TrueEffect(catalogue()["rotor_inertia"](name).on(made.robot), (0.08,))
    effect = catalogue()["backlash"](name, None, (30.0, 0.2, 0.3)).on(made.robot)
    built = build(made.robot, [rotor, TrueEffect(effect, (0.02,))], TIGHT, 1, carries_payload=False)
    plant = Plant(built, 0.0)
    loop = still(500, 2, np.zeros(2))
    stiff = replace(loop, kp=np.array([2e3, 500.0]), kd=np.array([80.0, 10.0]))
    plant.run(stiff, "held")
    bent = float(plant.data.joint("gear1").qpos[0])
    assert 0.01 <= abs(bent) < 0.013  # on one side, and a little into it


def _recordings(effects: list[TrueEffect], made) -> Dataset:
    runs = tuple(
        MujocoRun(
            trajectory=Fourier.random(
                made.robot, 8.0, [1, r], amplitude=made.amplitude, speed=made.speed
            ),
            duration=6.0,
            file=f"run{r}.npz",
            start=120.0 * r,
            payload=bool(r),
            phase=2.0,
        )
        for r in range(2)
    )
    laboratory = MujocoLaboratory(
        robot=made.robot,
        controller=replace(made.controller, feedforward=True),
        runs=runs,
        effects=tuple(effects),
        friction_width=WIDTH,
        nominal=made.nominal,
        says_payload=True,
        circumstances=SMOOTH,
        width=WIDTH,
    )
    return Dataset(laboratory.run())


LAWS = (
    {
        "torque_drift": (0.01,),
        "asymmetric_friction": (1.0, 0.35),
        "quadratic_drag": (1.0,),
        "base_tilt": (-0.04, 0.03),
    },
    {"drive_gain": (0.09,), "load_friction": (0.09,), "joint_spring": (1.0, 0.2)},
    {"torque_delay": (0.006,), "thermal_friction": (2.0, 0.7), "torque_offset": (0.7,)},
)
"""Laws that one robot has at once, each at a joint of its own: most of the time is its motion's."""


@pytest.mark.slow
@pytest.mark.parametrize("laws", LAWS, ids=" ".join)
def test_what_is_put_into_mujoco_comes_out_of_a_fit(laws: dict[str, tuple[float, ...]]) -> None:
    made = specimen(3, 500.0, np.random.default_rng(4))
    robot = made.robot
    sizes = {
        "viscous_friction": made.viscous,
        "coulomb_friction": made.dry,
        "rotor_inertia": made.rotor,
    }
    known = [
        TrueEffect(catalogue()[one](joint).on(robot), (float(values[j]),))
        for one, values in sizes.items()
        for j, joint in enumerate(robot.names)
    ]
    hidden = []
    for j, (name, values) in enumerate(laws.items()):
        kind = catalogue()[name]
        effect = kind(None if kind.place == "robot" else robot.names[j]).on(robot)
        hidden.append(TrueEffect(effect, values, hidden=True))
    data = _recordings([*known, *hidden], made)
    effects = (*(one.effect for one in known), *(one.effect.at(one.values) for one in hidden))
    model = Model(made.nominal, effects, WIDTH)
    values = fit(model, data).values
    for one in hidden:
        found = values[model.slices[one.effect.label]]
        np.testing.assert_allclose(found, one.values, rtol=0.03, err_msg=one.effect.label)


SIDE_OF_THE_RECORD = ("torque_delay",)
"""Effects that change what is recorded, not how the robot moves."""


@pytest.mark.parametrize("circumstances", [SMOOTH, TIGHT], ids=["tanh", "constraint"])
@pytest.mark.parametrize("name", sorted((*KNOWN, *EFFECTS)))
@pytest.mark.slow
def test_every_effect_is_felt(name: str, circumstances: Circumstances) -> None:
    made = specimen(4, 500.0, np.random.default_rng(6))
    robot = made.robot
    kind = {**catalogue(), **EFFECTS}[name]
    begin = start(name, made, 1, 2, np.random.default_rng(1), WIDTH)
    shape = (1.0, 0.1, 0.05) if name == "contact" else begin.shape
    joint = None if kind.place == "robot" else robot.names[1]
    effect = kind(joint, robot.names[2] if kind.place == "pair" else None, shape).on(robot)
    sizes = {"coulomb_friction": made.dry, "rotor_inertia": made.rotor}
    known = [
        TrueEffect(catalogue()[one](other).on(robot), (float(sizes[one][k]),))
        for one in sizes
        for k, other in enumerate(robot.names)
        if (one, other) != (name, robot.names[1])
    ]
    trajectory = Fourier.random(
        robot, 8.0, [3], amplitude=list(made.amplitude), speed=list(made.speed)
    )
    t = np.arange(150) / 500.0
    q_ref, v_ref, _ = trajectory.at(t + 1.0)
    loop = replace(
        still(150, 4, np.zeros(4)),
        q_ref=q_ref,
        v_ref=v_ref,
        ahead=np.zeros_like(q_ref),
        noise=np.zeros_like(q_ref),
        kp=np.array(made.controller.kp),
        kd=np.array(made.controller.kd),
    )

    def commands(effects: list[TrueEffect]) -> tuple[np.ndarray, np.ndarray]:
        built = build(robot, effects, circumstances, 1, carries_payload=True)
        width = WIDTH if circumstances is SMOOTH else 0.0
        return Plant(built, width).run(loop, name)[1], built.delay

    without, _ = commands(known)
    with_it, delay = commands([*known, TrueEffect(effect, begin.values, hidden=True)])
    assert np.isfinite(with_it).all()
    if name in SIDE_OF_THE_RECORD:
        assert delay[1] > 0
    else:
        assert np.abs(with_it - without).max() > 1e-4
