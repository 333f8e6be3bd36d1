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

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from dynident.effects.along import along_motion, mean_inertia
from dynident.effects.bands import solve_band
from dynident.effects.block import Block
from dynident.errors import EffectError

_PHASE = 0.3
"""rad that an oscillation may turn in a step: its frequency is then wrong by 0.4 %."""
_RUNAWAY = 1e3
"""rad or m, per unit of what drives it."""
_RUNG_DOWN = np.log(100.0)
"""Decades of a start that a run-up takes away, as a logarithm."""
_LEAST = 0.05
"""Of the mean inertia: no link is lighter, or unlikely estimates would ring beyond reason."""


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
    a : (T,) acceleration of the motor.
    M, C, G : (T, n) derivatives of torques by the joint's acceleration, speed and position.
    """

    def __init__(self, block: Block, joint: int) -> None:
        robot, along = along_motion(block)
        rotor = 0.0 if block.rotor is None else float(block.rotor[joint])
        self.joint, self.a = joint, block.a[:, joint]
        self.M, self.C, self.G = (x[:, :, joint] for x in (along.by_a, along.by_v, along.by_q))
        self._whole = along.by_a[:, joint, joint] + rotor
        self._load = along.torque[:, joint] + rotor * self.a
        # What is stiff stays as stiff when a payload is taken up.
        self.inertia = max(mean_inertia(block.empty or robot, joint) + rotor, 1e-9)
        if len(block.t) < 3:
            raise EffectError("its response needs more than two samples")
        self._step = float(np.mean(np.diff(block.t)))
        self._period = 0 if block.period is None else round(block.period / self._step)

    def response(self, gear: Transmitting) -> Response:
        """Return how the link moves behind a transmission."""
        least = _LEAST * self.inertia
        m = np.maximum(self._whole - gear.rotor, least)
        moves = self._whole - gear.rotor > least
        load = self._load - gear.rotor * self.a
        fastest = np.sqrt(max(float((gear.stiffness + self.G[:, self.joint]).max()), 0.0) / m.min())
        per = max(1, int(np.ceil(fastest * self._step / _PHASE)))
        return Response(self, gear, m, moves, load, per, self._step / per)

    def run_up(self, gear: Transmitting) -> np.ndarray:
        """Return rows of the motion that came before the first, as it repeats itself.

        As many as the ringing takes that a start at rest gives rise to; none where nothing repeats.
        """
        decay = gear.damping / (2.0 * (self.inertia - gear.rotor))  # per s
        if not (self._period and decay > 0):
            return np.zeros(0, dtype=int)
        wanted = min(int(np.ceil(_RUNG_DOWN / (decay * self._step))), 2 * self._period)
        return np.arange(-wanted, 0) % self._period


class Response:
    """A deflection with its effect on the torque, and the derivatives of both.

    Parameters
    ----------
    link, gear : what is driven, and through what.
    m, moves, load : (T,) inertia behind the transmission, whether it depends on the motor's, and
        the torque that the link needs where nothing gives way.
    per, step : steps per sample, and their length in s; see also `DrivenLink.run_up`.
    """

    def __init__(
        self,
        link: DrivenLink,
        gear: Transmitting,
        m: np.ndarray,
        moves: np.ndarray,
        load: np.ndarray,
        per: int,
        step: float,
    ) -> None:
        self._link, self._gear, self._m, self._moves = link, gear, m, moves
        self._per, self._step = per, step
        before = link.run_up(gear)
        self._rows, self._first = np.concatenate([before, np.arange(len(m))]), len(before)
        j = link.joint
        smooth = (self._smooth(x) for x in (link.C[:, j], link.G[:, j], load))
        self._fine = [self._linear(m), *smooth]
        self._solve()
        self.deflection = self._samples(self._differences(self._d))
        self.torque = self._torque(self.deflection)

    def _steps(self, samples: int) -> np.ndarray:
        return np.arange((samples - 1) * self._per + 1) / self._per

    def _linear(self, x: np.ndarray) -> np.ndarray:
        """Return samples at the steps: an inertia that stays above its least."""
        x = x[self._rows]
        return x if self._per == 1 else np.interp(self._steps(len(x)), np.arange(len(x)), x)

    def _smooth(self, x: np.ndarray) -> np.ndarray:
        """Return samples at the steps without kinks, which a second derivative would show."""
        from scipy.interpolate import CubicSpline

        x = x[self._rows]
        return x if self._per == 1 else CubicSpline(np.arange(len(x)), x)(self._steps(len(x)))

    def _solve(self) -> None:
        m, c, g, load = self._fine
        gear, h = self._gear, self._step
        touches = np.ones(len(m))
        if gear.half_gap > 0:
            d, self._side = _with_gap(m, c, g, load, gear, h)
            self._d = _bounded(d)
            touches, self._rests = np.abs(self._side), _sign(load[:2])
        else:
            self._side, self._rests = np.zeros(len(m)), np.zeros(2)
        damping, stiffness = c + gear.damping * touches, g + gear.stiffness * touches
        self._touches = touches
        rest = g + gear.stiffness
        # Row k + 1 holds the equation at step k; the first two are at rest.
        ahead = m / h**2 + damping / (2.0 * h)
        back = m / h**2 - damping / (2.0 * h)
        band = np.zeros((3, len(m)))
        band[0] = np.concatenate([rest[:2], ahead[1:-1]])
        band[1, 1:-1] = stiffness[1:-1] - 2.0 * m[1:-1] / h**2
        band[2, :-2] = back[1:-1]
        self._band = band
        if not gear.half_gap > 0:
            self._d = self._banded(load[:2], load)

    def _banded(self, rest: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Solve with right sides of the two steps at rest, and of the equation at every step."""
        return _bounded(solve_band(self._band, np.concatenate([rest, right[1:-1]])))

    def _differences(self, d: np.ndarray) -> Deflection:
        """Return the deflection of every step, with the derivatives that the recursion means."""
        rate, bend, h = np.zeros_like(d), np.zeros_like(d), self._step
        rate[1:-1] = (d[2:] - d[:-2]) / (2.0 * h)
        bend[1:-1] = (d[2:] - 2.0 * d[1:-1] + d[:-2]) / h**2
        for x in (rate, bend):
            if len(d) > 2:
                x[-1] = x[-2]
        return Deflection(d, rate, bend)

    def _samples(self, moved: Deflection) -> Deflection:
        """Return a deflection at the samples of the motion, from that at all steps."""
        steps = slice(self._first * self._per, None, self._per)
        return Deflection(*(x[steps] for x in (moved.d, moved.rate, moved.bend)))

    def _torque(self, moved: Deflection) -> np.ndarray:
        """Return the change of the torque, (T, n), to first order in a deflection."""
        link, j = self._link, self._link.joint
        d, rate, bend = (x[:, None] for x in (moved.d, moved.rate, moved.bend))
        changed = link.M * bend
        changed[:, j] = self._m * moved.bend
        return -(changed + link.C * rate + link.G * d)

    def by(self, stiffness: float, damping: float, rotor: float) -> np.ndarray:
        """Return the derivative of the torque (T, n) along a change of these values."""
        lighter = -rotor * self._moves
        d, moved = self._d, self._differences(self._d)
        bent = d - self._side * self._gear.half_gap
        lost = self._smooth(rotor * self._link.a)
        right = -self._linear(lighter) * moved.bend - lost
        right -= self._touches * (stiffness * bent + damping * moved.rate)
        rest = -stiffness * (d[:2] - self._rests * self._gear.half_gap)
        rest -= lost[:2]
        change = self._torque(self._samples(self._differences(self._banded(rest, right))))
        change[:, self._link.joint] -= lighter * self.deflection.bend
        return change


def _with_gap(m, c, g, load, gear: Transmitting, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the deflection of a link in a gap, and the side that it touches: -1, 0 or 1."""
    # Plain numbers, in which the loop is several times as fast.
    half, K = float(gear.half_gap), float(gear.stiffness)
    inertia = 2.0 * m / h**2 - g
    coefficients = []
    for damping in (c, c + gear.damping):
        ahead = 1.0 / (m / h**2 + damping / (2.0 * h))
        coefficients += [ahead, (m / h**2 - damping / (2.0 * h)) * ahead]
    free, free_back, touching, touching_back = (x.tolist() for x in coefficients)
    inertia = inertia.tolist()
    d, side = [0.0] * len(load), [0.0] * len(load)
    d[:2] = ((load[:2] + _sign(load[:2]) * K * half) / (g[:2] + K)).tolist()
    before, now, load = d[0], d[1], load.tolist()
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
    return np.array(d), np.array(side)


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
