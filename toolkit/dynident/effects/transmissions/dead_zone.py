"""A link in the dead zone of a transmission: the recursion in time, step by step.

Compiled from C where that can be had (`dead_zone_source`), and by NumPy elsewhere, with the same
results to the bit.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from dynident.batch import c_function
from dynident.effects.transmissions.dead_zone_source import ENTRY, LANES, SOURCE

T = TypeVar("T")

_AT_ONCE = 512
"""Steps whose factors are worked out at a time: those of a hundred links stay in the cache."""


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
    """A link behind a transmission with a dead zone, in steps of time: S, two at least.

    Attributes
    ----------
    whole, needed : (S,) inertia of all that moves with the joint, and the torque that it needs.
    a : (S,) acceleration of the motor.
    c, g : (S,) damping and stiffness without a transmission.
    gear, least : the transmission, and the least inertia behind it, kg m^2 or kg.
    step : of time, s.
    """

    whole: np.ndarray
    needed: np.ndarray
    a: np.ndarray
    c: np.ndarray
    g: np.ndarray
    gear: Transmitting
    least: float
    step: float

    @cached_property
    def m(self) -> np.ndarray:
        """Inertia behind the transmission, (S,)."""
        # In place, here and below: a search asks thousands, and memory that is new costs most.
        left = self.whole - self.gear.rotor
        return np.maximum(left, self.least, out=left)

    @cached_property
    def load(self) -> np.ndarray:
        """Torque that the link needs where nothing gives way, (S,)."""
        lost = self.gear.rotor * self.a
        return np.subtract(self.needed, lost, out=lost)

    @property
    def resting(self) -> np.ndarray:
        """The load of the first two steps, at rest, (2,)."""
        return self.needed[:2] - self.gear.rotor * self.a[:2]


@dataclass(frozen=True, eq=False)
class DeadZoneMotion:
    """Deflection d of a link in a dead zone, (S,): not finite where the link ran away."""

    d: np.ndarray
    half_gap: float

    @cached_property
    def side(self) -> np.ndarray:
        """The side that it touches, (S,): -1, 0 or 1; 0 in the first and the last step."""
        found = np.zeros_like(self.d)
        inner = self.d[1:-1]
        found[1:-1][inner > self.half_gap] = 1.0
        found[1:-1][inner < -self.half_gap] = -1.0
        return found


def through_dead_zones(links: Sequence[DeadZoneLink]) -> list[DeadZoneMotion]:
    """Return how links move in dead zones."""
    if not links:
        return []
    walk = c_function(SOURCE, ENTRY)
    if walk is None:
        return _replayed(links)
    found: dict[int, DeadZoneMotion] = {}
    # Links of about as many steps walk together: few wait for others.
    order = sorted(range(len(links)), key=lambda v: len(links[v].a))
    for some in _parts(order, LANES):
        found |= zip(some, _compiled(walk, [links[v] for v in some]), strict=True)
    return [found[v] for v in range(len(links))]


def _parts(every: Sequence[T], most: int) -> list[Sequence[T]]:
    return [every[k : k + most] for k in range(0, len(every), most)]


def _compiled(walk: Any, links: Sequence[DeadZoneLink]) -> list[DeadZoneMotion]:
    """Return how up to `LANES` links move, by the compiled function."""
    lanes = [*links, *[links[-1]] * (LANES - len(links))]
    read = [
        np.ascontiguousarray(x, dtype=float)
        for link in lanes
        for x in (link.whole, link.needed, link.a, link.c, link.g)
    ]
    values = np.array([(*astuple(link.gear), link.least, link.step) for link in lanes]).T.copy()
    moved = [DeadZoneMotion(np.empty(len(link.a)), link.gear.half_gap) for link in links]
    written = [one.d for one in (*moved, *[moved[-1]] * (LANES - len(links)))]
    walk(
        (ctypes.c_long * LANES)(*(len(link.a) for link in lanes)),
        (ctypes.c_void_p * len(read))(*(x.ctypes.data for x in read)),
        ctypes.c_void_p(values.ctypes.data),
        (ctypes.c_void_p * len(written))(*(x.ctypes.data for x in written)),
    )
    return moved


def _replayed(links: Sequence[DeadZoneLink]) -> list[DeadZoneMotion]:
    """Return how links move, by NumPy: a step costs the same for one and for dozens."""
    if len(links) == 1:
        return [_walk(links[0])]
    d = np.zeros((len(links), max(len(link.a) for link in links)))
    d[:, :2] = _starts(links)
    # A link that its load outgrows falls beyond all numbers: the caller sees that it is not finite.
    with np.errstate(over="ignore", invalid="ignore"):
        recursion = _Recursion(links, _AT_ONCE)
        for first in range(1, d.shape[1] - 1, _AT_ONCE):
            some = slice(first, min(first + _AT_ONCE, d.shape[1] - 1))
            found = _walk_together(recursion.during(some), d[:, first - 1 : first + 1].T)
            d[:, some.start + 1 : some.stop + 1] = found.T
    own = zip(links, d, strict=True)
    return [DeadZoneMotion(moved[: len(one.a)], one.gear.half_gap) for one, moved in own]


def _starts(links: Sequence[DeadZoneLink]) -> np.ndarray:
    """Deflections in the first two steps, at rest, (V, 2)."""
    load, g = (np.array(x) for x in ([link.resting for link in links], [x.g[:2] for x in links]))
    gears = [link.gear for link in links]
    K, half = np.array([(one.stiffness, one.half_gap) for one in gears]).T[..., None]
    lean = np.where(load >= 0.0, 1.0, -1.0)
    return (load + lean * K * half) / (g + K)


@dataclass(frozen=True, eq=False)
class _Factors:
    """What the recursion of V links multiplies by in each of S steps.

    Attributes
    ----------
    load : (S, V).
    drive : (S, 2, V) of a deflection, and of what of it is beyond the gap.
    free, touching : (S, 2, V) of what drives a link, and of its deflection a step back.
    half : (V,) of the gap.
    """

    load: np.ndarray
    drive: np.ndarray
    free: np.ndarray
    touching: np.ndarray
    half: np.ndarray


class _Recursion:
    """The factors of links, some steps after others in the same memory.

    Parameters
    ----------
    links : shorter ones repeat their last step.
    most : steps at a time.
    """

    def __init__(self, links: Sequence[DeadZoneLink], most: int) -> None:
        self._signals = list(zip(*((one.m, one.load, one.c, one.g) for one in links), strict=True))
        self._step = np.array([link.step for link in links])
        gears = [link.gear for link in links]
        each = np.array([(one.stiffness, one.damping, one.half_gap) for one in gears])
        self._K, self._D, self._half = each.T
        self._read = np.empty((len(self._signals), most, len(links)))
        self._made = np.empty((3, most, 2, len(links)))

    def during(self, some: slice) -> _Factors:
        """Return those of some steps, until others are asked for."""
        steps, h = some.stop - some.start, self._step
        m, load, c, g = self._read[:, :steps]
        for whole, every in zip((m, load, c, g), self._signals, strict=True):
            np.stack([_during(some, own) for own in every], axis=1, out=whole)
        drive, free, touching = self._made[:, :steps]
        m /= h**2
        c /= 2.0 * h
        np.multiply(2.0, m, out=drive[:, 0])
        drive[:, 0] -= g
        drive[:, 1] = self._K
        for factors, more in ((free, 0.0), (touching, self._D / (2.0 * h))):
            c += more
            np.add(m, c, out=factors[:, 0])
            np.divide(1.0, factors[:, 0], out=factors[:, 0])
            np.subtract(m, c, out=factors[:, 1])
            factors[:, 1] *= factors[:, 0]
        return _Factors(load, drive, free, touching, self._half)


def _during(some: slice, own: np.ndarray) -> np.ndarray:
    """Steps of a signal, of which the last goes on."""
    known = own[some]
    beyond = some.stop - some.start - len(known)
    return np.append(known, np.full(beyond, own[-1])) if beyond else known


def _walk_together(r: _Factors, first: np.ndarray) -> np.ndarray:
    """Return the next deflections (S, V) of V links after two known ones, (2, V).

    The call is what costs in a step, not its dozens of numbers: as few as can be.
    """
    both = np.empty((len(r.load) + 2, 2, len(r.half)))
    d = both[:, 0]
    d[:2] = first
    half, low, zero = r.half, -r.half, np.zeros_like(r.half)
    driven, factors = np.empty_like(both[0]), np.empty_like(both[0])
    (pushed, held), (ahead, back), touches = driven, factors, np.empty(len(half), dtype=bool)
    known = (both[1:-1], d[1:-1], both[1:-1, 1], r.drive, r.load, r.free, r.touching)
    steps = zip(*known, d[:-2], d[2:], strict=True)
    for state, now, beyond, drive, load, free, touching, before, after in steps:
        np.maximum(now, low, out=beyond)
        np.minimum(beyond, half, out=beyond)
        np.subtract(now, beyond, out=beyond)
        np.not_equal(beyond, zero, out=touches)
        np.copyto(factors, free)
        np.copyto(factors, touching, where=touches)
        np.multiply(drive, state, out=driven)
        np.add(pushed, load, out=pushed)
        np.subtract(pushed, held, out=pushed)
        np.multiply(pushed, ahead, out=pushed)
        np.multiply(back, before, out=held)
        np.subtract(pushed, held, out=after)
    return d[2:]


def _walk(link: DeadZoneLink) -> DeadZoneMotion:
    """As `_walk_together`, of one link: in plain numbers, which are faster than arrays of one."""
    inner = slice(1, len(link.a) - 1)
    r = _Recursion([link], len(link.a)).during(inner)
    load, inertia, K = r.load[:, 0].tolist(), r.drive[:, 0, 0].tolist(), float(link.gear.stiffness)
    free, free_back = r.free[:, :, 0].T.tolist()
    touching, touching_back = r.touching[:, :, 0].T.tolist()
    half = float(link.gear.half_gap)
    before, now = _starts([link])[0].tolist()
    d = [before, now]
    for k in range(len(load)):
        pushed = load[k] + inertia[k] * now
        if now > half:
            after = (pushed - K * (now - half)) * touching[k] - touching_back[k] * before
        elif now < -half:
            after = (pushed - K * (now + half)) * touching[k] - touching_back[k] * before
        else:
            after = pushed * free[k] - free_back[k] * before
        before, now = now, after
        d.append(after)
    return DeadZoneMotion(np.array(d), half)
