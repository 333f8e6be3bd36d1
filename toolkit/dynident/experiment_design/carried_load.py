"""A load on the last link, of which the mass is known and the rest is taken for usual."""

from __future__ import annotations

import numpy as np

from dynident.effects import Effect, effects_of
from dynident.inertia import from_com, to_com
from dynident.robot import Robot

_DENSITY = 2700.0  # kg/m^3, aluminium


def payload_effect(robot: Robot) -> Effect:
    """Return the effect of a payload of a robot."""
    (effect,) = effects_of("payload", robot)
    return effect.on(robot)


def usual_load(robot: Robot, mass: float) -> np.ndarray:
    """Return the inertial parameters (10,) of a load, about the origin of the last joint's frame.

    A ball of aluminium at the centre of mass of the last link.

    Parameters
    ----------
    robot : that carries it.
    mass : kg.
    """
    radius = (0.75 * mass / (np.pi * _DENSITY)) ** (1 / 3)
    link = np.asarray(robot.theta, dtype=float).reshape(robot.n, 10)[robot.tip]
    centre = to_com(link).com if link[0] > 0 else np.zeros(3)
    return from_com(mass, centre, 0.4 * mass * radius**2 * np.eye(3))
