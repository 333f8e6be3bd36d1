"""A gantry of two linear axes with known truth."""

from __future__ import annotations

from functools import cache

import numpy as np

from dynident.effects import Effect, effects_of
from dynident.model import Model
from dynident.recording import Dataset
from dynident.robot import Robot
from synthetic import synthetic, true_values

_LINK = """<link name="{0}"><inertial><mass value="{1}"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
_SLIDE = """<joint name="{0}" type="prismatic"><parent link="{1}"/><child link="{2}"/>
<axis xyz="{3}"/><limit lower="-2" upper="2" effort="1000" velocity="5"/></joint>"""
GANTRY = "".join(
    (
        '<robot name="gantry"><link name="base"/>',
        _LINK.format("bridge", 20),
        _LINK.format("carriage", 5),
        _SLIDE.format("x", "base", "bridge", "1 0 0"),
        _SLIDE.format("y", "bridge", "carriage", "0 1 0"),
        "</robot>",
    )
)
FRICTION = {"Fv__x": 30.0, "Fv__y": 15.0, "Fc__x": 12.0, "Fc__y": 8.0}


@cache
def gantry() -> Model:
    """The gantry with friction, which reverses over 5 mm/s."""
    model = Model(Robot.from_text(GANTRY)) + "viscous_friction" + "coulomb_friction"
    return model.with_friction_width("x", 0.005).with_friction_width("y", 0.005)


def at(label: str, *shape: float) -> Effect:
    """An effect of the gantry, with a shape where one is given."""
    (one,) = effects_of(label, gantry().robot)
    return one.shaped(*shape) if shape else one.on(gantry().robot)


def recorded(
    hidden: Effect | None = None, size: tuple[float, ...] = (), seeds: tuple[int, ...] = (0, 1)
) -> Dataset:
    """Recordings in which an effect acts that the gantry's model lacks."""
    model = gantry() if hidden is None else gantry() + hidden
    values = true_values(gantry(), **FRICTION)
    values = np.concatenate([values, size])
    return Dataset(
        tuple(
            synthetic(model, values, seed, rate_hz=250.0, position_std=2e-6, torque_std=0.5)
            for seed in seeds
        )
    )
