"""MJCF, the format of MuJoCo.

MuJoCo's own reader (`mujoco.MjSpec`) keeps broken numbers too, but refuses whatever its schema does
not know, in words that name no body, and cannot write into the given text; it weighs 31 MB.
"""

from __future__ import annotations

from dynident.robot.formats.format import Format
from dynident.robot.formats.mjcf.bodies import detach, inertial_lines, joint_dynamics, read
from dynident.robot.formats.mjcf.geoms import shapes

MJCF = Format(
    name="mjcf",
    root="mujoco",
    link="body",
    drake="xml",
    files=(".mjcf",),
    read=read,
    shapes=shapes,
    joint_dynamics=joint_dynamics,
    detach=detach,
    inertial_lines=inertial_lines,
    takes_massless=False,
)
