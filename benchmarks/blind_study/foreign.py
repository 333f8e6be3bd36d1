"""Laws that no catalogue has: for these the answer should be "none of these explains it"."""

from __future__ import annotations

import numpy as np

from dynident.effects import JointEffect, Parameter, ShapeParameter


class PositionDependentViscosity(JointEffect):
    """A viscosity that varies with position, as an unevenly filled gearbox has it."""

    name = "position_dependent_viscosity"
    in_catalogue = False
    law = "c v sin(3 q)"
    sign_of = "a slope against velocity that changes with position"
    experiment = "move {joint} at the same speeds in several places"

    def parameters(self, robot):
        return (Parameter("c", "N m s/rad"),)

    def at_joint(self, block):
        j = block.index(self.joint)
        return block.v[:, [j]] * np.sin(3.0 * block.q[:, [j]])


class SpeedProduct(JointEffect):
    """A torque that follows the product of two joints' speeds."""

    name = "speed_product"
    in_catalogue = False
    place = "pair"
    law = "c v v[source]"
    sign_of = "a residual where two joints move at once"
    experiment = "move {joint} and {source} together"

    def parameters(self, robot):
        return (Parameter("c", "N m s^2/rad^2"),)

    def at_joint(self, block):
        i, j = block.index(self.source), block.index(self.joint)
        return (block.v[:, i] * block.v[:, j])[:, None]


class LuGre(JointEffect):
    """Bristle friction in place of Coulomb's (Canudas de Wit, Olsson, Astrom and Lischinsky, 1995).

    z' = (v - abs(v) z / g(v)) / distance, g = 1 + rise exp(-(v / vs)^2), torque Fc z: the state is
    the deflection of the bristles in units of that at which Coulomb friction is reached.
    """

    name = "lugre_friction"
    in_catalogue = False
    law = "Fc z"
    sign_of = "loops at reversals"
    experiment = "move {joint} to and fro by very little"
    memory = 1

    def parameters(self, robot):
        return (Parameter("Fc", "N m", 0.0),)

    def shape_parameters(self, robot):
        return (
            ShapeParameter("distance", "rad", (0.01,), lower=1e-4, upper=1.0),
            ShapeParameter("rise", "1", (0.5,), lower=0.0, upper=5.0),
            ShapeParameter("vs", "rad/s", (0.1,), lower=1e-3, upper=2.0),
        )

    def at_joint(self, block):
        return block.memory if block.memory is not None else np.zeros((len(block.t), 1))

    def simulated_rate(self, values, block):
        distance, rise, vs = self.shape
        v = block.v[:, [block.index(self.joint)]]
        assert block.memory is not None
        level = 1.0 + rise * np.exp(-((v / vs) ** 2))
        return (v - np.abs(v) * block.memory / level) / distance


EFFECTS = {one.name: one for one in (PositionDependentViscosity, SpeedProduct, LuGre)}

SENSOR_ERRORS = ("cubic_sensor_error", "periodic_sensor_error")
"""Errors of the recorded position at one joint: e q^3, and e sin(2 q)."""

FOREIGN = (*EFFECTS, *SENSOR_ERRORS)

KIN = {"lugre_friction": ("presliding", "stribeck_friction")}
"""Effects of the catalogue that are the same physics in other words: also a right answer."""


def sensor_error(name: str, size: float, q: np.ndarray) -> np.ndarray:
    """What is added to a recorded position (T,) rad."""
    return size * (q**3 if name == "cubic_sensor_error" else np.sin(2.0 * q))
