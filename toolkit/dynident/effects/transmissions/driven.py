"""The driven two-mass response: what a link does behind a transmission that gives way.

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

from dynident.effects.block import Block
from dynident.effects.transmissions.along import along_motion, mean_inertia
from dynident.effects.transmissions.bands import solve_band
from dynident.effects.transmissions.gaps import Driven, Transmitting, Walked, through_gaps
from dynident.errors import EffectError

_PHASE = 0.3
"""rad that an oscillation may turn in a step: its frequency is then wrong by 0.4 %."""
_SHORTEST = 4e-5
"""s: the stiffest transmission on the lightest link that is possible asks for longer steps."""
_RUNAWAY = 1e3
"""rad or m, per unit of what drives it."""
_RUNG_DOWN = np.log(100.0)
"""Decades of a start that a run-up takes away, as a logarithm."""
_LEAST = 0.05
"""Of the mean inertia: no link is lighter, or unlikely estimates would ring beyond reason."""


@dataclass(frozen=True, eq=False)
class Deflection:
    """A deflection and its derivatives, (T,) each: rad or m, per s and s^2."""

    d: np.ndarray
    rate: np.ndarray
    bend: np.ndarray


class DrivenLink:
    """The link of one joint, along the motion of a recording.

    Parameters
    ----------
    block : whole recording, with the present model's body and rotor inertias.
    joint : column of the joint.

    Attributes
    ----------
    inertia : kg m^2 or kg, of all that moves with the joint, in the mean over its poses.
    a, whole, load : (T,) acceleration of the motor, and inertia and torque of all that moves.
    step, period : s between samples; samples after which the motion repeats, 0 where it does not.
    M, C, G : (T, n) derivatives of torques by the joint's acceleration, speed and position.
    """

    def __init__(self, block: Block, joint: int) -> None:
        robot, along = along_motion(block)
        rotor = 0.0 if block.rotor is None else float(block.rotor[joint])
        self.joint, self.a = joint, block.a[:, joint]
        self.M, self.C, self.G = (x[:, :, joint] for x in (along.by_a, along.by_v, along.by_q))
        self.whole = along.by_a[:, joint, joint] + rotor
        self.load = along.torque[:, joint] + rotor * self.a
        # What is stiff stays as stiff when a payload is taken up.
        self.inertia = max(mean_inertia(block.empty or robot, joint) + rotor, 1e-9)
        if len(block.t) < 3:
            raise EffectError("its response needs more than two samples")
        self.step = float(np.mean(np.diff(block.t)))
        self.period = 0 if block.period is None else round(block.period / self.step)

    def behind(self, gear: Transmitting) -> np.ndarray:
        """Return the inertia behind a transmission, (T,): no less than a part of the mean."""
        return np.maximum(self.whole - gear.rotor, _LEAST * self.inertia)

    def steps_per_sample(self, gear: Transmitting) -> int:
        """Return how many steps of the recursion follow an oscillation well enough."""
        stiffest = max(float((gear.stiffness + self.G[:, self.joint]).max()), 0.0)
        fastest = np.sqrt(stiffest / self.behind(gear).min())
        return max(1, int(np.ceil(fastest * self.step / _PHASE)))

    def follows(self, gear: Transmitting) -> bool:
        """Return whether steps of a sensible length follow it: not where an inertia is impossible.

        A wrong estimate may leave next to no inertia at a joint, or less than none.
        """
        return self.step / self.steps_per_sample(gear) >= min(_SHORTEST, self.step)

    def run_up(self, gear: Transmitting) -> np.ndarray:
        """Return rows of the motion that came before the first, as it repeats itself.

        As many as the ringing takes that a start at rest gives rise to; none where nothing repeats.
        """
        decay = gear.damping / (2.0 * (self.inertia - gear.rotor))  # per s
        if not (self.period and decay > 0):
            return np.zeros(0, dtype=int)
        wanted = min(int(np.ceil(_RUNG_DOWN / (decay * self.step))), 2 * self.period)
        return np.arange(-wanted, 0) % self.period


@dataclass(frozen=True, eq=False)
class Fine:
    """A link's motion in the steps of a recursion, (S,) each, a run-up before it.

    Attributes
    ----------
    rows, first : (R,) samples that are run through, and where those of the motion begin in them.
    per, step : steps per sample, and their length in s.
    whole, c, g, load, a : inertia of all that moves, damping and stiffness without a transmission,
        torque where nothing gives way, and acceleration of the motor.
    """

    rows: np.ndarray
    first: int
    per: int
    step: float
    whole: np.ndarray
    c: np.ndarray
    g: np.ndarray
    load: np.ndarray
    a: np.ndarray

    @classmethod
    def of(cls, link: DrivenLink, per: int, before: np.ndarray) -> Fine:
        """Return a link's motion in `per` steps per sample, rows `before` run through first."""
        rows, j = np.concatenate([before, np.arange(len(link.a))]), link.joint
        steps = np.arange((len(rows) - 1) * per + 1) / per
        samples = np.stack([link.C[:, j], link.G[:, j], link.load, link.a], axis=1)[rows]
        whole = link.whole[rows]
        if per > 1:
            from scipy.interpolate import CubicSpline

            # Without kinks, which a second derivative would show; but an inertia stays positive.
            samples = CubicSpline(np.arange(len(rows)), samples)(steps)
            whole = np.interp(steps, np.arange(len(rows)), whole)
        return cls(rows, len(before), per, link.step / per, whole, *samples.T)


def responses(
    links: Sequence[DrivenLink], gears: Sequence[Sequence[Transmitting]]
) -> list[list[Response]]:
    """Return how each link moves behind each of its transmissions; all gaps in one walk."""
    made = []
    for link, each in zip(links, gears, strict=True):
        followed = [gear for gear in each if link.follows(gear)]
        per = max(map(link.steps_per_sample, followed), default=1)
        before = max((link.run_up(gear) for gear in followed), key=len, default=np.zeros(0, int))
        fine = Fine.of(link, per, before)
        made.append(
            [(Response if link.follows(gear) else Unmoved)(link, fine, gear) for gear in each]
        )
    gaps = [
        one
        for each in made
        for one in each
        if one.gear.half_gap > 0 and not isinstance(one, Unmoved)
    ]
    if gaps:
        for one, walked in zip(gaps, through_gaps([g.driven for g in gaps]), strict=True):
            one.walked = walked
    return made


class Response:
    """A deflection with its effect on the torque, and the derivatives of both.

    Parameters
    ----------
    link, fine, gear : what is driven, in which steps, and through what.

    Attributes
    ----------
    m, load : (S,) inertia behind the transmission, and the torque that the link needs where nothing
        gives way.
    walked : the deflection of a link in a gap, found step by step; None without a gap.
    """

    def __init__(self, link: DrivenLink, fine: Fine, gear: Transmitting) -> None:
        self.gear, self._link, self._fine = gear, link, fine
        least = _LEAST * link.inertia
        self.m = np.maximum(fine.whole - gear.rotor, least)
        self._moves = fine.whole - gear.rotor > least
        self.load = fine.load - gear.rotor * fine.a
        self.walked: Walked | None = None

    @property
    def driven(self) -> Driven:
        """The same for the recursion in time."""
        fine = self._fine
        return Driven(self.m, self.load, fine.c, fine.g, self.gear, fine.step)

    @cached_property
    def torque(self) -> np.ndarray:
        """The change of the torque of every joint, (T, n)."""
        return self._torque(self._samples(self._differences(self._d)))

    @cached_property
    def _side(self) -> np.ndarray:
        return np.zeros(len(self.m)) if self.walked is None else self.walked.side

    @cached_property
    def _touches(self) -> np.ndarray:
        return np.ones(len(self.m)) if self.walked is None else np.abs(self._side)

    @cached_property
    def _rests(self) -> np.ndarray:
        return np.zeros(2) if self.walked is None else _sign(self.load[:2])

    @cached_property
    def _d(self) -> np.ndarray:
        if self.walked is not None:
            return _bounded(self.walked.d)
        return self._banded(self.load[:2], self.load)

    @cached_property
    def _band(self) -> np.ndarray:
        """Row k + 1 holds the equation at step k; the first two are at rest."""
        m, h, gear = self.m, self._fine.step, self.gear
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

    def _samples(self, moved: Deflection) -> Deflection:
        """Return a deflection at the samples of the motion, from that at all steps."""
        steps = slice(self._fine.first * self._fine.per, None, self._fine.per)
        return Deflection(*(x[steps] for x in (moved.d, moved.rate, moved.bend)))

    def _torque(self, moved: Deflection) -> np.ndarray:
        """Return the change of the torque, (T, n), to first order in a deflection."""
        link, j = self._link, self._link.joint
        d, rate, bend = (x[:, None] for x in (moved.d, moved.rate, moved.bend))
        changed = link.M * bend
        changed[:, j] = link.behind(self.gear) * moved.bend
        return -(changed + link.C * rate + link.G * d)

    def by(
        self, stiffness: float, damping: float, rotor: float, half_gap: float = 0.0
    ) -> np.ndarray:
        """Return the derivative of the torque (T, n) along a change of these values.

        Exact while the link keeps touching where it touches.
        """
        lighter = -rotor * self._moves
        d, moved = self._d, self._differences(self._d)
        bent = d - self._side * self.gear.half_gap
        lost = rotor * self._fine.a
        right = -lighter * moved.bend - lost
        right -= self._touches * (stiffness * bent + damping * moved.rate)
        right += self._side * self.gear.stiffness * half_gap
        rest = -stiffness * (d[:2] - self._rests * self.gear.half_gap)
        rest += self._rests * self.gear.stiffness * half_gap - lost[:2]
        change = self._torque(self._samples(self._differences(self._banded(rest, right))))
        at = self._samples(Deflection(lighter, lighter, moved.bend))
        change[:, self._link.joint] -= at.d * at.bend
        return change


class Unmoved(Response):
    """The response of a link that no steps of a sensible length follow: it explains nothing."""

    @cached_property
    def torque(self) -> np.ndarray:
        return np.zeros(self._link.M.shape[:2])

    def by(
        self, stiffness: float, damping: float, rotor: float, half_gap: float = 0.0
    ) -> np.ndarray:
        return np.zeros(self._link.M.shape[:2])


def _bounded(d: np.ndarray) -> np.ndarray:
    """Return a deflection (T,); zero throughout where it has run away.

    A link of an unlikely estimate may fall instead of ring: such a transmission explains nothing.
    """
    return d if np.all(np.abs(d) < _RUNAWAY) else np.zeros_like(d)


def _sign(load: np.ndarray) -> np.ndarray:
    """Return the side on which a link at rest leans."""
    return np.where(load >= 0.0, 1.0, -1.0)


def stacked(columns: Iterable[np.ndarray]) -> np.ndarray:
    """Return derivatives (T, n) each as (T, n, 1, s)."""
    return np.stack(list(columns), axis=-1)[:, :, None, :]
