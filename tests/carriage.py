"""A carriage with dry friction that held commands drive, for what depends on its reversals."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

import dynident as di
from dynident.recording import Dataset, Recording, common_filter

CARRIAGE = """<robot name="carriage"><link name="rail"/><link name="carriage"><inertial>
<mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
</inertial></link>
<joint name="slider" type="prismatic"><parent link="rail"/><child link="carriage"/>
<axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="100" velocity="10"/></joint></robot>"""
MASS, VISCOUS, COULOMB, WIDTH = 2.0, 1.0, 3.0, 0.01
RATE_HZ, STEPS, SECONDS, SEEDS = 200.0, 40, 24.0, 24


def model(width: float = WIDTH) -> di.Model:
    """The model of it, with a friction width, m/s."""
    robot = di.Robot.from_text(CARRIAGE)
    kinds = ("viscous_friction", "coulomb_friction")
    effects = tuple(effect for kind in kinds for effect in di.effects_of(kind, robot))
    return di.Model(robot, effects, friction_width=width)


@lru_cache
def driven(hz: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Carriages that held commands drive after a reference, integrated in steps of 125 us.

    Parameters
    ----------
    hz : of the slowest of three waves.

    Returns
    -------
    t (T,) s, q (T, seeds) m, command (T, seeds) N, without noise.
    """
    rng = np.random.default_rng(0)
    amplitude, phase = rng.uniform(0.5, 1.0, (3, SEEDS)), rng.uniform(0.0, 2 * np.pi, (3, SEEDS))
    w = 2.0 * np.pi * hz * np.arange(1.0, 4.0)[:, None]
    t, h = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ, 1.0 / RATE_HZ / STEPS
    q = np.sum(0.1 * amplitude * np.sin(phase) / w, axis=0)
    v = np.zeros(SEEDS)
    positions, commands = np.zeros((len(t), SEEDS)), np.zeros((len(t), SEEDS))
    for k, now in enumerate(t):
        there = np.sum(0.1 * amplitude * np.sin(w * now + phase) / w, axis=0)
        speed = np.sum(0.1 * amplitude * np.cos(w * now + phase), axis=0)
        u = 800.0 * (there - q) + 60.0 * (speed - v) + COULOMB * np.tanh(speed / 0.05)
        positions[k], commands[k] = q, u
        for _ in range(STEPS):
            a = (u - VISCOUS * v - COULOMB * np.tanh(v / WIDTH)) / MASS
            v = v + h * a
            q = q + h * v
    return t, positions, commands


def recorded(hz: float, force_std: float, seed: int) -> Dataset:
    """One of them, recorded after the transient, with white noise of its force, N."""
    t, q, command = driven(hz)
    rng = np.random.default_rng([seed, 1])
    force = command[:, seed] + force_std * rng.normal(size=len(t))
    one = Recording(t, q[:, [seed]], force[:, None], ("slider",), torque="held_command")
    return Dataset((one.replace(window=(1.0, SECONDS)),), common_filter([one]))
