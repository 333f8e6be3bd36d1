"""A planar arm in a closed loop, measured with a noisy encoder."""

from __future__ import annotations

from functools import cache

import numpy as np

from dynident.closed_loop import Controller, Experiment, ExperimentRun, Fourier, Sensors, TrueEffect
from dynident.model import Model
from dynident.recording import Dataset, Filter
from dynident.robot import Robot

ARM = """<robot name="planar">
  <link name="base"/>
  <link name="arm"><inertial><origin xyz="0.25 0 0"/><mass value="6"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.3" iyz="0" izz="0.3"/></inertial></link>
  <link name="forearm"><inertial><origin xyz="0.2 0.01 0"/><mass value="1.2"/>
    <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.014" iyz="0" izz="0.014"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="8" effort="500"/></joint>
  <joint name="elbow" type="revolute"><parent link="arm"/><child link="forearm"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="8" effort="100"/></joint>
</robot>"""
"""Two links that turn about vertical axes."""

RATE = 200.0
FREQUENCY_HZ = (2.0, 6.0)
VISCOUS, COULOMB = (0.5, 0.1), (0.8, 0.15)


@cache
def robot() -> Robot:
    """One for all: what is worked out of its description is kept with it."""
    return Robot.from_text(ARM)


def controller(factor: float = 1.0) -> Controller:
    """PD without reference velocity, damping 1 at the largest joint inertias."""
    inertia = np.array([1.36, 0.0621]) * factor
    w = 2 * np.pi * np.array(FREQUENCY_HZ)
    kp, kd = tuple(inertia * w**2), tuple(2 * inertia * w)
    return Controller(kind="pd", rate_hz=RATE, kp=kp, kd=kd, velocity_reference=False)


def model(*, coulomb: bool) -> Model:
    found = Model(robot()) + "viscous_friction"
    return found + "coulomb_friction" if coulomb else found


def truth(model: Model) -> np.ndarray:
    values = model.given_values()
    for joint, Fv, Fc in zip(model.robot.names, VISCOUS, COULOMB, strict=True):
        values[model.names.index(f"Fv@{joint}")] = Fv
        if f"Fc@{joint}" in model.names:
            values[model.names.index(f"Fc@{joint}")] = Fc
    return values


def experiment(
    seed: int,
    position_std: float,
    *,
    coulomb: bool = False,
    seconds: float = 10.0,
    motions: int = 1,
    controller: Controller | None = None,
) -> Experiment:
    arm = robot()
    effects = []
    for j, joint in enumerate(arm.names):
        effects += TrueEffect.of(f"viscous_friction@{joint}", arm, (VISCOUS[j],))
        if coulomb:
            effects += TrueEffect.of(f"coulomb_friction@{joint}", arm, (COULOMB[j],))
    motion = Fourier.random(arm, 10.0, 3, amplitude=1.0, speed=3.0)
    runs = tuple(
        ExperimentRun(trajectory=motion, duration=seconds, file=f"run{k}.npz")
        for k in range(motions)
    )
    sensors = Sensors(position_std=position_std)
    loop = controller or LOOP
    return Experiment(
        robot=arm, controller=loop, runs=runs, effects=tuple(effects), sensors=sensors, seed=seed
    )


LOOP = controller()


def dataset(experiment: Experiment, filter: Filter | None = None) -> Dataset:
    return Dataset(experiment.run(), filter or Filter())


def inertial(values: np.ndarray, model: Model) -> np.ndarray:
    return values[: model.base.rank]
