"""A two-link arm in a vertical plane under PD control, many recordings at a time.

Shares no code with the package: own equations of motion, own integrator. Each recording has a
motion and noise of its own; the encoders' noise is fed back. Records begin and stop in mid-motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from math import ceil

import casadi
import numpy as np
import scipy.signal

from dynident.closed_loop import Controller
from dynident.model import Model
from dynident.recording import Recording
from dynident.robot import Robot

ARM = """<robot name="two_link">
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
RATE = 1000.0
PERIOD = 6.0
KP, KD = np.array([900.0, 250.0]), np.array([60.0, 14.0])
VISCOUS, COULOMB = np.array([1.5, 0.6]), np.array([2.5, 0.9])
WIDTH = 0.05
"""Of tanh(v / width) in the dry friction, rad/s, where none is said."""

_SETTLING = 0.5  # s
_STEP = 1e-4
"""s, of the integrator at most where friction reverses more sharply than `WIDTH`."""
_LENGTH, _G = 0.4, 9.81
_M1, _X1, _Y1, _J1 = 4.0, 4 * 0.2, 4 * 0.01, 0.06 + 4 * (0.2**2 + 0.01**2)
_M2, _X2, _Y2, _J2 = 2.0, 2 * 0.15, -2 * 0.01, 0.02 + 2 * (0.15**2 + 0.01**2)


@dataclass(frozen=True, kw_only=True)
class Lab:
    """What the recordings of a case are like.

    Attributes
    ----------
    position_std : of the encoders' white noise, rad; it is fed back.
    torque_std : (2,) of the noise on the recorded torque, N m.
    colour_s : time over which that noise forgets itself; zero for white noise.
    stribeck : share of the Coulomb level that friction rises by at rest.
    offset : N m, of the elbow's torque.
    spring : N m/rad, at the elbow about its zero.
    drag : N m s^2/rad^2, of the elbow, with the square of its speed.
    asymmetry : N m s/rad, half of what the elbow's viscous friction differs between its directions.
    rotor : kg m^2, of the elbow's drive.
    width : rad/s, over which dry friction reverses.
    rate_hz : of the samples and of the loop.
    gain : of the loop, over `KP` and `KD`: a slow loop bears less.
    waves_s : period of the slowest wave of the motion; by default that of the whole, 8 at most.
    seconds : of each recording.
    period : whether the motion repeats with `PERIOD` and the recording says so.
    """

    position_std: float = 0.0
    torque_std: tuple[float, float] = (0.0, 0.0)
    colour_s: float = 0.0
    stribeck: float = 0.0
    offset: float = 0.0
    spring: float = 0.0
    drag: float = 0.0
    asymmetry: float = 0.0
    rotor: float = 0.0
    width: float = WIDTH
    rate_hz: float = RATE
    gain: float = 1.0
    waves_s: float | None = None
    seconds: float = 12.0
    period: bool = False

    def recordings(self, seeds: range) -> list[Recording]:
        """One recording for each seed."""
        # The loop settles before the record begins.
        count = round((self.seconds + _SETTLING) * self.rate_hz) + 1
        rngs = [np.random.default_rng([seed, 15]) for seed in seeds]
        waves = np.stack([rng.normal(size=(2, 2, 5)) for rng in rngs])
        noise = np.stack([rng.normal(size=(count, 2)) for rng in rngs]) * self.position_std
        t = np.arange(count) / self.rate_hz
        slowest = self.waves_s or min(PERIOD if self.period else self.seconds, 8.0)
        q_ref, v_ref = _references(waves, t, slowest)
        begin = round(_SETTLING * self.rate_hz)
        q, tau = (x[:, begin:] for x in self._moved(q_ref, v_ref, noise))
        t, q_ref = t[begin:] - t[begin], q_ref[:, begin:]
        std = np.array(self.torque_std)
        return [
            Recording(
                t,
                q[i],
                tau[i] + std * torque_noise(rng, tau[i].shape, self.colour_s, self.rate_hz),
                ("shoulder", "elbow"),
                q_ref=q_ref[i],
                torque="held_command",
                period=PERIOD if self.period else None,
                name=f"seed {seed}",
            )
            for i, (seed, rng) in enumerate(zip(seeds, rngs, strict=True))
        ]

    def _moved(
        self, q_ref: np.ndarray, v_ref: np.ndarray, noise: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Measured positions and commanded torques, (S, T, 2) each."""
        S, T, _ = q_ref.shape
        finest = 1.0 / self.rate_hz if self.width >= WIDTH else _STEP
        found = np.empty((S, T, 4))
        laws = (
            self.stribeck,
            self.offset,
            self.spring,
            self.drag,
            self.asymmetry,
            self.rotor,
            self.width,
        )
        loop = _loop(T, self.rate_hz, self.gain, ceil(1.0 / self.rate_hz / finest), laws)
        for i in range(S):
            start = [*q_ref[i, 0], *v_ref[i, 0], *(q_ref[i, 0] - v_ref[i, 0] / self.rate_hz)]
            _, out = loop(start, np.hstack([q_ref[i], v_ref[i], noise[i]]).T)
            found[i] = np.asarray(out).T
        return found[..., :2], found[..., 2:]


@lru_cache(maxsize=16)
def _loop(
    samples: int, rate_hz: float, gain: float, steps: int, laws: tuple[float, ...]
) -> casadi.Function:
    """The sampled loop, replayed without Python between its samples.

    From positions, velocities and the positions measured before, and, a column a sample,
    references and noise; to what is measured and commanded. A command is held for some steps of the
    classical Runge-Kutta method. What is hidden (as in `Lab`) are constants: of laws that a robot
    has not nothing is left to be evaluated.
    """
    x, before = casadi.SX.sym("x", 4), casadi.SX.sym("before", 2)
    q_ref, v_ref, noise = (casadi.SX.sym(name, 2) for name in ("q_ref", "v_ref", "noise"))
    h = 1.0 / rate_hz / steps
    y = x[:2] + noise
    tau = casadi.DM(gain * KP) * (q_ref - y) + casadi.DM(gain * KD) * (
        v_ref - (y - before) * rate_hz
    )
    moved = x
    for _ in range(steps):
        k1 = _rate(moved, tau, laws)
        k2 = _rate(moved + h / 2 * k1, tau, laws)
        k3 = _rate(moved + h / 2 * k2, tau, laws)
        k4 = _rate(moved + h * k3, tau, laws)
        moved = moved + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    after = casadi.vertcat(moved, y)
    given = casadi.vertcat(q_ref, v_ref, noise)
    states, told = casadi.vertcat(x, before), casadi.vertcat(y, tau)
    return casadi.Function("sample", [states, given], [after, told]).mapaccum(samples)


def _rate(x: casadi.SX, tau: casadi.SX, laws: tuple[float, ...]) -> casadi.SX:
    """Derivative of positions and velocities, (4,)."""
    q1, q2, v1, v2 = casadi.vertsplit(x)
    share, offset, spring, drag, asymmetry, rotor, width = laws
    s2, c2 = casadi.sin(q2), casadi.cos(q2)
    across = _LENGTH * (_X2 * c2 - _Y2 * s2)
    slope = -_LENGTH * (_X2 * s2 + _Y2 * c2)
    m11 = _J1 + _M2 * _LENGTH**2 + _J2 + 2 * across
    m12, m22 = _J2 + across, _J2 + rotor
    fore = _G * (_X2 * casadi.cos(q1 + q2) - _Y2 * casadi.sin(q1 + q2))
    upper = _G * ((_X1 + _M2 * _LENGTH) * casadi.cos(q1) - _Y1 * casadi.sin(q1))
    v = x[2:]
    dry = casadi.tanh(v / width) * (1.0 + share * casadi.exp(-((v / (4 * width)) ** 2)))
    left = tau - casadi.DM(VISCOUS) * v - casadi.DM(COULOMB) * dry
    b1 = left[0] - slope * (2 * v1 * v2 + v2**2) - upper - fore
    elbow = offset + spring * q2 + (drag * v2 + asymmetry) * casadi.fabs(v2)
    b2 = left[1] + slope * v1**2 - fore - elbow
    det = m11 * m22 - m12**2
    return casadi.vertcat(v1, v2, (m22 * b1 - m12 * b2) / det, (m11 * b2 - m12 * b1) / det)


def torque_noise(
    rng: np.random.Generator, shape: tuple[int, ...], colour_s: float, rate_hz: float = RATE
) -> np.ndarray:
    """Noise of unit variance, (T, n), that forgets itself over a time (s); white if that is 0."""
    white = rng.normal(size=shape)
    if not colour_s:
        return white
    kept = np.exp(-1.0 / (rate_hz * colour_s))
    return np.asarray(scipy.signal.lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], white, axis=0))


def controller() -> Controller:
    """The loop's control law, as the package states it."""
    return Controller(kind="pd", rate_hz=RATE, kp=tuple(KP), kd=tuple(KD))


@cache
def _robot() -> Robot:
    return Robot.from_text(ARM)


def model(width: float = WIDTH) -> Model:
    """The arm with viscous friction, and dry friction that reverses over so many rad/s."""
    bodies = Model(_robot(), friction_width=width)
    return bodies + "viscous_friction" + "coulomb_friction"


def truth(model: Model) -> np.ndarray:
    """Its true parameters, (p,)."""
    values = model.given_values()
    for j, joint in enumerate(model.robot.names):
        values[model.names.index(f"Fv@{joint}")] = VISCOUS[j]
        values[model.names.index(f"Fc@{joint}")] = COULOMB[j]
    return values


def _references(waves: np.ndarray, t: np.ndarray, slowest: float) -> tuple[np.ndarray, np.ndarray]:
    """Reference positions and velocities, (S, T, 2) each, of five waves."""
    order = np.arange(1, 6)
    w = 2 * np.pi / slowest * order
    waves = waves * 0.5 / order
    sin, cos = np.sin(t * w[:, None]), np.cos(t * w[:, None])
    q = waves[:, 0] @ sin + waves[:, 1] @ cos
    v = waves[:, 0] @ (cos * w[:, None]) - waves[:, 1] @ (sin * w[:, None])
    return np.swapaxes(q, 1, 2), np.swapaxes(v, 1, 2)
