"""Residuals of known composition along random smooth motions, for tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.signal import lfilter

from dynident.diagnosis.dependence.explained_shares import (
    ORDER,
    ExplainedShares,
    explained_shares,
)
from dynident.diagnosis.dependence.joint_inputs import joint_inputs
from dynident.diagnosis.dependence.motion_blocks import motion_blocks
from dynident.diagnosis.dependence.residual_record import ResidualRecord

Law = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Torque (T,) of t (T,) and q, v, a (T, n)."""

RATE_HZ = 50.0


def rough_friction(t, q, v, a):
    """Dry and viscous friction at joint 0 that depend on its position."""
    return np.sign(v[:, 0]) * (1 + 0.5 * np.sin(3 * q[:, 0])) + v[:, 0] * np.cos(2 * q[:, 0])


def bristles(t, q, v, a):
    """What Dahl friction at joint 0 adds to dry and viscous friction."""
    steps, z = np.diff(q[:, 0], prepend=q[0, 0]), np.zeros(len(t))
    reach = 0.1 * q[:, 0].std()
    for k in range(1, len(t)):
        z[k] = z[k - 1] + steps[k] - abs(steps[k]) * z[k - 1] / reach
    known = np.column_stack([np.ones_like(t), v[:, 0], np.sign(v[:, 0])])
    return z - known @ np.linalg.lstsq(known, z, rcond=None)[0]


def shared_gear(t, q, v, a):
    """Friction of joint 1 that reaches joint 0."""
    return np.tanh(v[:, 1] / 0.05) + 0.3 * v[:, 1]


def tight_cable(t, q, v, a):
    """Viscous friction at joint 0 that depends on the position of joint 1."""
    return v[:, 0] * np.sin(2 * q[:, 1])


def drift(t, q, v, a):
    """A ramp over the time, about zero."""
    return t - t.mean()


def motion(rng, samples: int, joints: int, period: float | None):
    t = np.arange(samples) / RATE_HZ
    if period is None:
        f = rng.uniform(0.05, 0.7, (6, joints))
    else:
        f = np.tile(np.arange(1, 7)[:, None] / period, (1, joints))
    size = rng.normal(size=(6, joints)) * np.sqrt(0.05 / f)
    phase = 2 * np.pi * f * t[:, None, None] + rng.uniform(0, 2 * np.pi, (6, joints))
    w = 2 * np.pi * f
    q = np.sum(size * np.sin(phase), axis=1)
    v = np.sum(size * w * np.cos(phase), axis=1)
    a = -np.sum(size * w**2 * np.sin(phase), axis=1)
    return t, q, v, a


def coloured(rng, samples: int, correlation_s: float) -> np.ndarray:
    """Noise of unit variance whose correlation falls to 1/e in a time; white for zero."""
    rho = np.exp(-1.0 / (RATE_HZ * correlation_s)) if correlation_s else 0.0
    driven = np.sqrt(1 - rho**2) * rng.normal(size=samples + 1000)
    return np.asarray(lfilter([1.0], [1.0, -rho], driven))[1000:]


def record(
    seed: int,
    laws: dict[Law, float],
    *,
    duration: float = 60.0,
    joints: int = 2,
    period: float | None = None,
    correlation_s: float = 0.0,
) -> ResidualRecord:
    """A residual at joint 0 of mean square one: shares of laws, and noise for the rest."""
    rng = np.random.default_rng(seed)
    samples = round(duration * RATE_HZ)
    t, q, v, a = motion(rng, samples, joints, period)
    power = 1.0 - sum(laws.values())
    e = np.sqrt(power) * coloured(rng, samples, correlation_s)
    for law, share in laws.items():
        torque = law(t, q, v, a)
        e = e + torque * np.sqrt(share / np.mean(torque**2))
    others = rng.normal(size=(samples, joints - 1))
    return ResidualRecord(
        source=seed,
        t=t,
        session=t,
        q=q,
        v=v,
        a=a,
        load=a + np.sin(q),
        residual=np.column_stack([e, others]),
        certain=np.ones((samples, joints), dtype=bool),
        noise_power=np.full((samples, joints), power),
        period=period,
    )


def shares_of(
    *records: ResidualRecord,
    rows: int = 500,
    noise: float = 0.0,
    order: Sequence[tuple[str, ...]] = ORDER,
) -> ExplainedShares:
    """Shares at joint 0, with so many rows; `noise` is the mean square that is taken off."""
    blocks, x = motion_blocks(records, [0]), joint_inputs(records, 0)
    e = np.concatenate([one.residual[:, 0] for one in records])
    kept = np.linspace(0, len(e) - 1, rows).round().astype(int)
    left, power = e[kept], np.full(rows, noise)
    found = explained_shares(x.rows(kept), left, power, blocks.units(kept), order)
    assert found is not None
    return found
