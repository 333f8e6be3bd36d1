"""A two-link arm whose elbow stands at its stops, as dry friction lets it."""

from __future__ import annotations

import numpy as np

from dynident.effects import effects_of
from dynident.model import Model
from dynident.recording import Recording
from synthetic import arm, smooth_motion, true_values

RATE_HZ = 500.0
COULOMB = np.array([3.0, 2.0])
"""N m"""
WIDTH = 0.02
"""rad/s"""
STOPPED = 0.08
"""rad/s that the reference moves while the elbow stands."""


def given() -> Model:
    robot, names = arm(), ("viscous_friction", "coulomb_friction")
    return Model(robot, tuple(e for name in names for e in effects_of(name, robot)), WIDTH)


def record(
    seed: int,
    stands: float,
    stribeck: float = 0.0,
    rate_hz: float = RATE_HZ,
    position_std: float = 1e-5,
) -> Recording:
    """A motion whose elbow stands while the reference is slower than `stands`, rad/s.

    While it stands, its dry friction passes from one side to the other as the reference does: it
    is no function of the elbow's speed. The shoulder's reverses over the width of the model.
    """
    model, rng = given(), np.random.default_rng([seed, 5])
    t, q, v, _ = smooth_motion(2, seed, rate_hz, 16.0, 16.0)
    reference = v[:, 1].copy()
    if stands:
        v[:, 1] -= np.clip(reference, -stands, stands)
        q[:, 1] = q[0, 1] + np.concatenate([[0.0], np.cumsum((v[1:, 1] + v[:-1, 1]) / 2)]) / rate_hz
    a = np.gradient(v, 1.0 / rate_hz, axis=0)
    values = true_values(model, Fv__shoulder=1.0, Fv__elbow=0.6, Fc__shoulder=COULOMB[0])
    tau = model.torque(model.block(t, q, v, a), values)
    share = np.clip(reference / stands, -1, 1) if stands else np.tanh(v[:, 1] / WIDTH)
    tau[:, 1] += share * (COULOMB[1] + stribeck * np.exp(-((v[:, 1] / 0.3) ** 2)))
    q = q + position_std * rng.normal(size=q.shape)
    tau = tau + 0.05 * rng.normal(size=tau.shape)
    return Recording(t, q, tau, model.robot.names, name=f"{seed}")


def resting_joint(seed: int, joint: int) -> Recording:
    """A motion of the other joint, while this one rests: its dry friction is as others ask."""
    model, rng = given(), np.random.default_rng([seed, 6])
    t, q, v, a = smooth_motion(2, seed, RATE_HZ, 16.0, 16.0)
    q[:, joint], v[:, joint], a[:, joint] = q[0, joint], 0.0, 0.0
    values = true_values(model, Fv__shoulder=1.0, Fv__elbow=0.6)
    tau = model.torque(model.block(t, q, v, a), values)
    tau[:, 1 - joint] += COULOMB[1 - joint] * np.tanh(v[:, 1 - joint] / WIDTH)
    tau[:, joint] += 0.6 * COULOMB[joint] * np.sin(0.7 * t)
    tau = tau + 0.05 * rng.normal(size=tau.shape)
    return Recording(t, q, tau, model.robot.names, name=f"resting {seed}")
