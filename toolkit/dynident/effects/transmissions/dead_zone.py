"""A link in the dead zone of a transmission: the recursion in time, step by step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

_TOGETHER = 20_000_000
"""Steps, over all links, that are walked through at once: ten numbers each are in memory."""


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
        """Return the transmission that a shape stands for.

        Parameters
        ----------
        inertia : kg m^2 or kg, of all that moves with the joint.
        shape : resonance (Hz), damping ratio, and the motor's share of the inertia.
        gap : rad or m, whole width of the dead zone.
        """
        resonance, damping, share = shape
        link, w = (1.0 - share) * inertia, 2.0 * np.pi * resonance
        return cls(link * w**2, 2.0 * damping * link * w, gap / 2.0, share * inertia)


@dataclass(frozen=True, eq=False, kw_only=True)
class DeadZoneLink:
    """A link behind a transmission with a dead zone, in steps of time.

    Attributes
    ----------
    m, load : (S,) inertia behind the transmission, and the torque that it needs.
    c, g : (S,) damping and stiffness without a transmission.
    gear, step : the transmission, and the time step, s.
    """

    m: np.ndarray
    load: np.ndarray
    c: np.ndarray
    g: np.ndarray
    gear: Transmitting
    step: float


@dataclass(frozen=True, eq=False)
class DeadZoneMotion:
    """Deflection of a link in a dead zone (S,), and the side that it touches: -1, 0 or 1.

    The deflection is not finite where the link ran away.
    """

    d: np.ndarray
    side: np.ndarray


def through_dead_zones(links: Sequence[DeadZoneLink]) -> list[DeadZoneMotion]:
    """Return how links move in dead zones: a step costs the same for one and for dozens."""
    longest = max(len(link.m) for link in links)
    most = max(1, _TOGETHER // longest)
    if len(links) > most:
        parts = [links[k : k + most] for k in range(0, len(links), most)]
        return [one for part in parts for one in through_dead_zones(part)]
    if len(links) == 1:
        return [_walk(_Recursion.of(links[0], len(links[0].m)))]
    each = [_Recursion.of(link, longest) for link in links]
    together = _Recursion(*(np.stack(x, axis=-1) for x in zip(*map(_fields, each), strict=True)))
    # A link that its load outgrows falls beyond all numbers: the caller sees that it is not finite.
    with np.errstate(over="ignore", invalid="ignore"):
        d = _walk_together(together)
        beyond = d[1:-1] - np.clip(d[1:-1], -together.half, together.half)
        side = np.zeros_like(d)
        side[1:-1] = np.sign(beyond)
    side = np.nan_to_num(side)
    lengths = [len(link.m) for link in links]
    return [DeadZoneMotion(d[:s, v], side[:s, v]) for v, s in enumerate(lengths)]


@dataclass(frozen=True, eq=False)
class _Recursion:
    """What the recursion multiplies by in each step, (S,) or (S, V); K and half are () or (V,)."""

    start: np.ndarray
    load: np.ndarray
    inertia: np.ndarray
    free: np.ndarray
    free_back: np.ndarray
    touching: np.ndarray
    touching_back: np.ndarray
    K: np.ndarray
    half: np.ndarray

    @classmethod
    def of(cls, link: DeadZoneLink, steps: int) -> _Recursion:
        """Return it for as many steps, the last one repeated."""
        rows = np.minimum(np.arange(steps), len(link.m) - 1)
        m, load, c, g = (x[rows] for x in (link.m, link.load, link.c, link.g))
        h, gear = link.step, link.gear
        mass, damping = m / h**2, c / (2.0 * h)
        more = damping + gear.damping / (2.0 * h)
        free, touching = 1.0 / (mass + damping), 1.0 / (mass + more)
        lean = np.where(load[:2] >= 0.0, 1.0, -1.0)
        start = (load[:2] + lean * gear.stiffness * gear.half_gap) / (g[:2] + gear.stiffness)
        return cls(
            start,
            load,
            2.0 * mass - g,
            free,
            (mass - damping) * free,
            touching,
            (mass - more) * touching,
            np.array(gear.stiffness),
            np.array(gear.half_gap),
        )


def _fields(one: _Recursion) -> list[np.ndarray]:
    return [getattr(one, field.name) for field in fields(one)]


def _walk_together(r: _Recursion) -> np.ndarray:
    """Return deflections (S, V) of V links; nothing is allocated in a step."""
    d = np.zeros_like(r.load)
    d[:2] = r.start
    half, low, K = r.half, -r.half, r.K
    beyond, pushed, part = (np.empty_like(half) for _ in range(3))
    ahead, back, touches = np.empty_like(half), np.empty_like(half), np.empty(len(half), dtype=bool)
    for k in range(1, len(d) - 1):
        now = d[k]
        np.maximum(now, low, out=beyond)
        np.minimum(beyond, half, out=beyond)
        np.subtract(now, beyond, out=beyond)
        np.not_equal(beyond, 0.0, out=touches)
        np.copyto(ahead, r.free[k])
        np.copyto(ahead, r.touching[k], where=touches)
        np.copyto(back, r.free_back[k])
        np.copyto(back, r.touching_back[k], where=touches)
        np.multiply(r.inertia[k], now, out=pushed)
        np.add(pushed, r.load[k], out=pushed)
        np.multiply(K, beyond, out=part)
        np.subtract(pushed, part, out=pushed)
        np.multiply(pushed, ahead, out=pushed)
        np.multiply(back, d[k - 1], out=part)
        np.subtract(pushed, part, out=d[k + 1])
    return d


def _walk(r: _Recursion) -> DeadZoneMotion:
    """As `_walk_together`, of one link: in plain numbers, which are faster than arrays of one."""
    load, inertia = r.load.tolist(), r.inertia.tolist()
    free, free_back = r.free.tolist(), r.free_back.tolist()
    touching, touching_back = r.touching.tolist(), r.touching_back.tolist()
    K, half = float(r.K), float(r.half)
    before, now = r.start.tolist()
    d, side = [before, now, *[0.0] * (len(load) - 2)], [0.0] * len(load)
    for k in range(1, len(load) - 1):
        pushed = load[k] + inertia[k] * now
        if now >= half:
            after = (pushed - K * (now - half)) * touching[k] - touching_back[k] * before
            side[k] = 1.0
        elif now <= -half:
            after = (pushed - K * (now + half)) * touching[k] - touching_back[k] * before
            side[k] = -1.0
        else:
            after = pushed * free[k] - free_back[k] * before
        before, now = now, after
        d[k + 1] = after
    return DeadZoneMotion(np.array(d), np.array(side))
