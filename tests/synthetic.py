"""Small robots and recordings of known truth, for tests: no simulator, exact torques."""

from __future__ import annotations

from functools import cache

import numpy as np

from dynident.model import Model
from dynident.recording import Recording
from dynident.robot import Robot

ARM = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0.01 0"/><mass value="4"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.06"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0.15 -0.01 0"/><mass value="2"/>
    <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin rpy="1.5707963267948966 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2.5" upper="2.5" velocity="6" effort="200"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-2.5" upper="2.5" velocity="6" effort="100"/></joint>
</robot>"""
"""Two links in a vertical plane."""


@cache
def arm() -> Robot:
    """The two-link arm, one for all: what is worked out of its description is kept with it."""
    return Robot.from_text(ARM)


def smooth_motion(
    n: int,
    seed: int,
    rate_hz: float,
    duration: float,
    period: float | None,
    amplitude: float = 0.5,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Sum of five sines, t (T,), q, v, a (T, n); without a period as fast as with one of 8 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration * rate_hz) + 1) / rate_hz
    orders = np.arange(1, 6) if period else np.sqrt([1, 5, 10, 17, 26])  # no common period
    k = 2 * np.pi / (period or 8.0) * orders
    s, c = rng.normal(size=(2, n, 5)) * amplitude / np.arange(1, 6)
    sin, cos = np.sin(t[:, None] * k), np.cos(t[:, None] * k)
    q = sin @ s.T + cos @ c.T
    v = (cos * k) @ s.T - (sin * k) @ c.T
    a = -(sin * k**2) @ s.T - (cos * k**2) @ c.T
    return t, q, v, a


def synthetic(
    model: Model,
    values: np.ndarray,
    seed: int = 0,
    *,
    rate_hz: float = 500.0,
    duration: float = 16.0,
    period: float | None = 8.0,
    position_std: float = 0.0,
    torque_std: float = 0.0,
    payload: bool | None = None,
) -> Recording:
    """A recording whose torque is exactly the model's at known values, plus noise."""
    rng = np.random.default_rng([seed, 1])
    n = model.robot.n
    t, q, v, a = smooth_motion(n, seed, rate_hz, duration, period)
    tau = model.torque(model.block(t, q, v, a, carries_payload=bool(payload)), values)
    return Recording(
        t,
        q + position_std * rng.normal(size=q.shape),
        tau + torque_std * rng.normal(size=tau.shape),
        model.robot.names,
        period=period,
        payload=payload,
        name=f"synthetic {seed}",
    )


def true_values(model: Model, **effects: float) -> np.ndarray:
    """Parameters of a model: the robot's own, and effects by parameter name (`Fv__elbow`)."""
    values = model.given_values()
    for name, value in effects.items():
        values[model.names.index(name.replace("__", "@"))] = value
    return values
