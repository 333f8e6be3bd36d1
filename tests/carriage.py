"""A carriage with dry friction that held commands drive, for what depends on its reversals."""

from __future__ import annotations

from functools import cache, lru_cache

import casadi
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


@cache
def _robot() -> di.Robot:
    """One for all: what is worked out of its description is kept with it."""
    return di.Robot.from_text(CARRIAGE)


def model(width: float = WIDTH) -> di.Model:
    """The model of it, with a friction width, m/s."""
    robot = _robot()
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
    t = np.arange(int(SECONDS * RATE_HZ)) / RATE_HZ
    turned = w * t[:, None, None] + phase
    there = np.sum(0.1 * amplitude * np.sin(turned) / w, axis=1)
    speed = np.sum(0.1 * amplitude * np.cos(turned), axis=1)
    given = np.stack([there, speed, COULOMB * np.tanh(speed / 0.05)])
    each = [_loop(len(t))([there[0, k], 0.0], given[:, :, k])[1] for k in range(SEEDS)]
    q, command = np.moveaxis(np.array(each), 0, -1)
    return t, q, command


@cache
def _loop(samples: int) -> casadi.Function:
    """The loop of one carriage, replayed without Python between its samples.

    From position and speed, and, a column a sample, where it is to be, how fast, and what friction
    is made up for; to positions and commands.
    """
    state, given, h = casadi.SX.sym("state", 2), casadi.SX.sym("given", 3), 1.0 / RATE_HZ / STEPS
    q, v = casadi.vertsplit(state)
    u = 800.0 * (given[0] - q) + 60.0 * (given[1] - v) + given[2]
    for _ in range(STEPS):
        v = v + h * (u - VISCOUS * v - COULOMB * casadi.tanh(v / WIDTH)) / MASS
        q = q + h * v
    told = casadi.vertcat(state[0], u)
    return casadi.Function("carriage", [state, given], [casadi.vertcat(q, v), told]).mapaccum(
        samples
    )


def recorded(hz: float, force_std: float, seed: int) -> Dataset:
    """One of them, recorded after the transient, with white noise of its force, N."""
    t, q, command = driven(hz)
    rng = np.random.default_rng([seed, 1])
    force = command[:, seed] + force_std * rng.normal(size=len(t))
    one = Recording(t, q[:, [seed]], force[:, None], ("slider",), torque="held_command")
    return Dataset((one.replace(window=(1.0, SECONDS)),), common_filter([one]))
