"""A filtered dynamic regressor: what a link does behind a transmission that gives way.

Encoders are on the motors, so the motion of a motor is known and that of its link is not. With the
deflection d = q_motor - q_link at joint j, to first order in d, the link obeys

    m d'' + C_jj d' + G_jj d + torque = load,    torque = K (d - clip(d, -gap/2, gap/2)) + D d'

(D where the sides touch), with m = M_jj less the motor's inertia and C, G the derivatives of the
inverse dynamics by speed and position. All joints feel it: the torque of joint i changes by
-(M_ij d'' + C_ij d' + G_ij d), with m in place of M_jj at joint j.

Central differences in time make of it a recursion; where the modes of contact are known it is a
triangular band matrix, which LAPACK solves, and so are its exact derivatives by K, D, gap and m.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dynident.effects.transmissions.bands import solve_band
from dynident.effects.transmissions.dead_zone import (
    DeadZoneLink,
    DeadZoneMotion,
    Transmitting,
    through_dead_zones,
)
from dynident.effects.transmissions.driven_link import DrivenLink, Fine

_RUNAWAY = 1e3
"""rad or m, per unit of what drives it."""


@dataclass(frozen=True, eq=False)
class Deflection:
    """A deflection and its derivatives, (T,) each: rad or m, per s and s^2."""

    d: np.ndarray
    rate: np.ndarray
    bend: np.ndarray


def response(link: DrivenLink, gear: Transmitting) -> Response:
    """Return how a link moves behind a transmission."""
    ((found,),) = responses([link], [[gear]])
    return found


def responses(
    links: Sequence[DrivenLink], gears: Sequence[Sequence[Transmitting]]
) -> list[list[Response]]:
    """Return how each link moves behind each of its transmissions; all dead zones in one walk."""
    every = []
    for link, each in zip(links, gears, strict=True):
        # Those of one length of steps after each other: not all lengths may be kept.
        apart = sorted(dict.fromkeys(each), key=link.steps_per_sample)
        every.append({gear: _behind(link, gear) for gear in apart})
    walking = [one for made in every for one in made.values() if one.walks]
    for one, walked in zip(walking, through_dead_zones([w.driven for w in walking]), strict=True):
        one.walked = walked
    return [[made[gear] for gear in each] for made, each in zip(every, gears, strict=True)]


def _behind(link: DrivenLink, gear: Transmitting) -> Response:
    return (Response if link.follows(gear) else Unmoved)(link, link.fine(gear), gear)


class Response:
    """A deflection with its effect on the torque, and the derivatives of both.

    Parameters
    ----------
    link, fine, gear : what is driven, in which steps, and through what.

    Attributes
    ----------
    driven : the link in the steps of its recursion.
    walked : the deflection of a link in a dead zone, found step by step; None without a gap.
    """

    def __init__(self, link: DrivenLink, fine: Fine, gear: Transmitting) -> None:
        self.gear, self._fine = gear, fine
        # Not the link itself, which keeps its latest response.
        self._joint, self._least = link.joint, link.least_inertia
        self._by, self._behind = (link.M, link.C, link.G), link.behind(gear)
        self.driven = DeadZoneLink(
            whole=fine.whole,
            needed=fine.load,
            a=fine.a,
            c=fine.c,
            g=fine.g,
            gear=gear,
            least=link.least_inertia,
            step=fine.step,
        )
        self.walked: DeadZoneMotion | None = None

    @property
    def walks(self) -> bool:
        """Whether its dead zone is to be walked through in time."""
        return self.gear.half_gap > 0

    @cached_property
    def torque(self) -> np.ndarray:
        """The change of the torque of every joint, (T, n)."""
        return self._torque(self._sampled(self._d))

    @cached_property
    def _side(self) -> np.ndarray:
        return np.zeros(len(self._fine.a)) if self.walked is None else self.walked.side

    @cached_property
    def _touches(self) -> np.ndarray:
        return np.ones(len(self._fine.a)) if self.walked is None else np.abs(self._side)

    @cached_property
    def _rests(self) -> np.ndarray:
        return np.zeros(2) if self.walked is None else _sign(self.driven.resting)

    @cached_property
    def _d(self) -> np.ndarray:
        if self.walked is not None:
            return _bounded(self.walked.d)
        return self._banded(self.driven.load[:2], self.driven.load)

    @cached_property
    def _band(self) -> np.ndarray:
        """Row k + 1 holds the equation at step k; the first two are at rest."""
        m, h, gear = self.driven.m, self._fine.step, self.gear
        damping = self._fine.c + gear.damping * self._touches
        stiffness = self._fine.g + gear.stiffness * self._touches
        rest = self._fine.g + gear.stiffness
        ahead = m / h**2 + damping / (2.0 * h)
        back = m / h**2 - damping / (2.0 * h)
        band = np.zeros((3, len(m)))
        band[0] = np.concatenate([rest[:2], ahead[1:-1]])
        band[1, 1:-1] = stiffness[1:-1] - 2.0 * m[1:-1] / h**2
        band[2, :-2] = back[1:-1]
        return band

    def _banded(self, rest: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Solve with right sides of the two steps at rest, and of the equation at every step."""
        return _bounded(solve_band(self._band, np.concatenate([rest, right[1:-1]])))

    def _differences(self, d: np.ndarray) -> Deflection:
        """Return the deflection of every step, with the derivatives that the recursion means."""
        rate, bend, h = np.zeros_like(d), np.zeros_like(d), self._fine.step
        rate[1:-1] = (d[2:] - d[:-2]) / (2.0 * h)
        bend[1:-1] = (d[2:] - 2.0 * d[1:-1] + d[:-2]) / h**2
        for x in (rate, bend):
            if len(d) > 2:
                x[-1] = x[-2]
        return Deflection(d, rate, bend)

    def _sampled(self, d: np.ndarray) -> Deflection:
        """Return the deflection of every step as `_differences`, at the samples of the motion."""
        first, per, h = self._fine.first * self._fine.per, self._fine.per, self._fine.step
        sampled = d[first::per]
        rate, bend = np.zeros((2, len(sampled)))
        if len(d) > 2:
            # Each sample's step but the very first one, and the last but one for the last.
            begun = 0 if first else 1
            start = first + begun * per
            inner = slice(begun, len(sampled) - 1)
            before, now, after = (d[start + k : len(d) - 1 + k : per] for k in (-1, 0, 1))
            np.subtract(after, before, out=rate[inner])
            bend[inner] = after - 2.0 * now + before
            rate[-1], bend[-1] = d[-1] - d[-3], d[-1] - 2.0 * d[-2] + d[-3]
            rate /= 2.0 * h
            bend /= h**2
        return Deflection(sampled, rate, bend)

    @property
    def _samples(self) -> slice:
        """Steps at which the samples of the motion are."""
        return slice(self._fine.first * self._fine.per, None, self._fine.per)

    def _torque(self, moved: Deflection) -> np.ndarray:
        """Return the change of the torque, (T, n), to first order in a deflection."""
        (M, C, G), j = self._by, self._joint
        d, rate, bend = (x[:, None] for x in (moved.d, moved.rate, moved.bend))
        changed = M * bend
        changed[:, j] = self._behind * moved.bend
        changed += C * rate
        changed += G * d
        return np.negative(changed, out=changed)

    def by(
        self, stiffness: float, damping: float, rotor: float, half_gap: float = 0.0
    ) -> np.ndarray:
        """Return the derivative of the torque along a change of the transmission's values.

        Parameters
        ----------
        stiffness, damping, rotor, half_gap : the change, in the units of `Transmitting`.

        Returns
        -------
        (T, n), exact while the link keeps touching where it touches.
        """
        lighter = -rotor * (self._fine.whole - self.gear.rotor > self._least)
        d, moved = self._d, self._differences(self._d)
        bent = d - self._side * self.gear.half_gap
        lost = rotor * self._fine.a
        right = -lighter * moved.bend - lost
        right -= self._touches * (stiffness * bent + damping * moved.rate)
        right += self._side * self.gear.stiffness * half_gap
        rest = -stiffness * (d[:2] - self._rests * self.gear.half_gap)
        rest += self._rests * self.gear.stiffness * half_gap - lost[:2]
        change = self._torque(self._sampled(self._banded(rest, right)))
        change[:, self._joint] -= (lighter * moved.bend)[self._samples]
        return change


class Unmoved(Response):
    """The response of a link that no steps of a sensible length follow: it explains nothing."""

    @property
    def walks(self) -> bool:
        return False

    @cached_property
    def torque(self) -> np.ndarray:
        return np.zeros(self._by[0].shape)

    def by(
        self, stiffness: float, damping: float, rotor: float, half_gap: float = 0.0
    ) -> np.ndarray:
        return np.zeros(self._by[0].shape)


def _bounded(d: np.ndarray) -> np.ndarray:
    """Return a deflection (T,); zero throughout where it has run away.

    A link of an unlikely estimate may fall instead of ring: such a transmission explains nothing.
    """
    return d if d.min() > -_RUNAWAY and d.max() < _RUNAWAY else np.zeros_like(d)


def _sign(load: np.ndarray) -> np.ndarray:
    """Return the side on which a link at rest leans."""
    return np.where(load >= 0.0, 1.0, -1.0)


def stacked(columns: Iterable[np.ndarray]) -> np.ndarray:
    """Return derivatives (T, n) each as (T, n, 1, s), the samples side by side."""
    return np.stack([one.T for one in columns]).T[:, :, None, :]
