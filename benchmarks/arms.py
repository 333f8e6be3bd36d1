"""Arms and chains of any number of links, and recordings of them."""

from __future__ import annotations

import numpy as np

from dynident.model import Model
from dynident.recording import Filter, Recording
from dynident.robot import Robot

RATE_HZ = 1000.0
TORQUE_STD = 0.1  # N m
FULL_RATE = Filter(position_cutoff_hz=None, cutoff_hz=None, rate_hz=None, edge_s=(0.01, 0.01))
"""No filter and every row."""


def arm() -> Robot:
    """Seven revolute joints, axes crossing by turns, as most light-weight arms have them."""
    parts = ['<robot name="seven"><link name="base"/>']
    parent = "base"
    for i in range(7):
        turn = (0.0, 1.57, -1.57, 1.57, -1.57, 1.57, -1.57)[i]
        parts.append(
            f'<link name="l{i}"><inertial><origin xyz="0.01 0.02 0.1"/>'
            f'<mass value="{4 - 0.4 * i}"/>'
            '<inertia ixx="0.03" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.01"/></inertial></link>'
            f'<joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="l{i}"/>'
            f'<origin xyz="0 0 0.2" rpy="{turn} 0 0"/><axis xyz="0 0 1"/>'
            '<limit lower="-3" upper="3" velocity="3" effort="100"/></joint>'
        )
        parent = f"l{i}"
    return Robot.from_text("".join(parts) + "</robot>")


def chain(n: int) -> Robot:
    """A chain of n links, neighbouring axes at right angles."""
    rng = np.random.default_rng(n)
    parts = ['<robot name="chain"><link name="base"/>']
    for k in range(n):
        x, y, z = rng.uniform(-0.05, 0.15, 3)
        moments = rng.uniform(0.01, 0.02, 3)
        entries = " ".join(f'i{a}{a}="{m}"' for a, m in zip("xyz", moments, strict=True))
        parts.append(
            f'<link name="l{k}"><inertial><origin xyz="{x} {y} {z}"/>'
            f'<mass value="{rng.uniform(1, 4)}"/><inertia {entries}/></inertial></link>'
            f'<joint name="j{k}" type="revolute">'
            f'<parent link="{f"l{k - 1}" if k else "base"}"/><child link="l{k}"/>'
            f'<origin xyz="0 0 {0.3 if k else 0}" rpy="{1.5708 * (-1) ** k} 0 0"/>'
            '<axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="3" effort="9"/></joint>'
        )
    return Robot.from_text("".join(parts) + "</robot>")


def recording(model: Model, values: np.ndarray, seed: int, samples: int) -> Recording:
    """A motion of five harmonics at 1 kHz, with the noisy torque of the base parameters."""
    rng = np.random.default_rng(seed)
    t, n = np.arange(samples) / RATE_HZ, model.robot.n
    k = 2 * np.pi / 20.0 * np.arange(1, 6)
    s = rng.normal(size=(n, 5)) * 0.5 / np.arange(1, 6)
    q, v = np.sin(t[:, None] * k) @ s.T, np.cos(t[:, None] * k) @ (s * k).T
    a = -np.sin(t[:, None] * k) @ (s * k**2).T
    theta = np.zeros(10 * n)
    theta[list(model.base.independent)] = values[: model.base.rank]
    tau = model.robot.inverse_dynamics(q, v, a, theta)
    return Recording(t, q, tau + TORQUE_STD * rng.normal(size=tau.shape), model.robot.names)
