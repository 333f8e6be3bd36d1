"""A link in the gap of a transmission: the recursion in time, step by step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Transmitting:
    """Physical values of a transmission; see `dynident.effects.Transmission`.

    Attributes
    ----------
    stiffness, damping, half_gap, rotor : N m/rad, N m s/rad, rad, kg m^2 (or N/m, N s/m, m, kg).
    """

    stiffness: float
    damping: float
    half_gap: float
    rotor: float

    @classmethod
    def of(cls, inertia: float, shape: tuple[float, ...], gap: float = 0.0) -> Transmitting:
        """Return what a resonance (Hz), a damping ratio and a share of the inertia stand for."""
        resonance, damping, share = shape
        link, w = (1.0 - share) * inertia, 2.0 * np.pi * resonance
        return cls(link * w**2, 2.0 * damping * link * w, gap / 2.0, share * inertia)


def through_gaps(
    m: np.ndarray,
    c: np.ndarray,
    g: np.ndarray,
    load: np.ndarray,
    gears: Sequence[Transmitting],
    step: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return deflections of a link in gaps, and the sides that it touches: -1, 0 or 1.

    Several gaps are walked through together, as a step costs the same for one and for dozens.

    Parameters
    ----------
    m, load : (S, V) inertia behind each of V transmissions, and the torque that it needs.
    c, g : (S,) damping and stiffness without a transmission.
    gears, step : V transmissions, and the time step, s.

    Returns
    -------
    d, side : (S, V) each; d is not finite where a link has run away
    """
    half = np.array([one.half_gap for one in gears])
    K, D = np.array([one.stiffness for one in gears]), np.array([one.damping for one in gears])
    inertia = 2.0 * m / step**2 - g[:, None]
    mass, free_damping = m / step**2, c[:, None] / (2.0 * step)
    touching_damping = free_damping + D / (2.0 * step)
    free, touching = 1.0 / (mass + free_damping), 1.0 / (mass + touching_damping)
    free_back, touching_back = (mass - free_damping) * free, (mass - touching_damping) * touching
    d, side = np.zeros_like(load), np.zeros_like(load)
    lean = np.where(load[:2] >= 0.0, 1.0, -1.0)
    d[:2] = (load[:2] + lean * K * half) / (g[:2, None] + K)
    if len(gears) == 1:
        walked, touched = _walk(
            d[:2, 0].tolist(),
            [x[:, 0].tolist() for x in (load, inertia)],
            [x[:, 0].tolist() for x in (free, free_back)],
            [x[:, 0].tolist() for x in (touching, touching_back)],
            float(half[0]),
            float(K[0]),
        )
        return walked[:, None], touched[:, None]
    # A link that its load outgrows falls beyond all numbers: the caller sees that it is not finite.
    with np.errstate(over="ignore", invalid="ignore"):
        _walk_together(d, load, inertia, (free, free_back), (touching, touching_back), half, K)
        beyond = d[1:-1] - np.clip(d[1:-1], -half, half)
        side[1:-1] = np.sign(beyond)
    return d, np.nan_to_num(side)


def _walk_together(
    d: np.ndarray,
    load: np.ndarray,
    inertia: np.ndarray,
    free: tuple[np.ndarray, np.ndarray],
    touching: tuple[np.ndarray, np.ndarray],
    half: np.ndarray,
    K: np.ndarray,
) -> None:
    """Fill in deflections (S, V) from their first two rows on; nothing is allocated in a step."""
    low = -half
    beyond, pushed, part = (np.empty_like(half) for _ in range(3))
    ahead, back, touches = np.empty_like(half), np.empty_like(half), np.empty(len(half), dtype=bool)
    for k in range(1, len(load) - 1):
        now = d[k]
        np.maximum(now, low, out=beyond)
        np.minimum(beyond, half, out=beyond)
        np.subtract(now, beyond, out=beyond)
        np.not_equal(beyond, 0.0, out=touches)
        np.copyto(ahead, free[0][k])
        np.copyto(ahead, touching[0][k], where=touches)
        np.copyto(back, free[1][k])
        np.copyto(back, touching[1][k], where=touches)
        np.multiply(inertia[k], now, out=pushed)
        np.add(pushed, load[k], out=pushed)
        np.multiply(K, beyond, out=part)
        np.subtract(pushed, part, out=pushed)
        np.multiply(pushed, ahead, out=pushed)
        np.multiply(back, d[k - 1], out=part)
        np.subtract(pushed, part, out=d[k + 1])


def _walk(
    start: list[float],
    driven: list[list[float]],
    free: list[list[float]],
    touching: list[list[float]],
    half: float,
    K: float,
) -> tuple[np.ndarray, np.ndarray]:
    """As `_walk_together`, of one gap: in plain numbers, which are faster than arrays of one."""
    load, inertia = driven
    d, side = [*start, *[0.0] * (len(load) - 2)], [0.0] * len(load)
    before, now = start
    for k in range(1, len(load) - 1):
        pushed = load[k] + inertia[k] * now
        if now >= half:
            after = (pushed - K * (now - half)) * touching[0][k] - touching[1][k] * before
            side[k] = 1.0
        elif now <= -half:
            after = (pushed - K * (now + half)) * touching[0][k] - touching[1][k] * before
            side[k] = -1.0
        else:
            after = pushed * free[0][k] - free[1][k] * before
        before, now = now, after
        d[k + 1] = after
    return np.array(d), np.array(side)
