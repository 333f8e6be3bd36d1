"""A closed loop in MuJoCo, sample by sample, and the recordings cut out of it.

Integrator: `implicitfast` in steps of at most 0.2 ms. A step takes the forces at its start to the
velocity at its end, so that positions follow a leapfrog scheme; the command that begins to act at a
sample is therefore averaged with the one before it over the first step, which makes the hold exact
to second order. Controller and encoder are written here, as drives have them: proportional and
derivative gains on the measured position, its filtered difference, and a feed-forward.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mujoco as _mujoco
import numpy as np

from blind_study.mujoco_laws import Laws
from blind_study.mujoco_machine import Built, bare
from blind_study.mujoco_model import mjcf
from dynident.errors import SimulationError
from dynident.robot import Robot

# Its names come out of compiled modules, which have no types.
mujoco: Any = _mujoco

LONGEST_STEP = 2e-4
"""s"""
_RUNAWAY = 50.0
"""rad/s, of all joints together; nothing in the study comes near it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Loop:
    """What a controller follows and sees, at T samples of n joints.

    Attributes
    ----------
    t : (T,) s, in the session.
    q_ref, v_ref : (T, n) reference.
    ahead : (T, n) N m, of a feed-forward.
    kp, kd : (n,) gains.
    cutoff_hz, rate_hz : of the low-pass of its velocity, and its nominal samples per second.
    noise : (T, n) rad, of the encoder; before it is rounded.
    resolution : (n,) rad, of the encoder; 0 for none.
    wrong : error of the encoder at positions q (n,), (n,) rad.
    """

    t: np.ndarray
    q_ref: np.ndarray
    v_ref: np.ndarray
    ahead: np.ndarray
    kp: np.ndarray
    kd: np.ndarray
    cutoff_hz: float
    rate_hz: float
    noise: np.ndarray
    resolution: np.ndarray
    wrong: Any


class Plant:
    """A robot in MuJoCo under friction of one kind.

    Parameters
    ----------
    built : the robot with its effects.
    width : rad/s over which smooth dry friction changes its sign; not used by the constraint's.
    """

    def __init__(self, built: Built, width: float) -> None:
        self.model = mujoco.MjModel.from_xml_string(mjcf(built.machine))
        self.data = mujoco.MjData(self.model)
        self._built, self._width = built, width
        self._zero = built.zero.tolist()
        self._levels = (built.dry if width else built.machine.friction).tolist()
        n = built.machine.robot.n
        joints = [self.model.joint(f"joint{j}") for j in range(n)]
        # Every joint is of one degree of freedom: a position and a speed stand at the same place.
        self.places = [int(one.dofadr[0]) for one in joints]

    @cached_property
    def _is_plain(self) -> bool:
        """Whether MuJoCo's own laws are all there are."""
        laws = self._built.laws
        more = laws.torques or laws.levels or laws.dampings or laws.bristles or laws.both
        more = more or laws.drawn
        return not (more or np.any(self._built.dry))

    def run(self, loop: Loop, where: str) -> tuple[np.ndarray, np.ndarray]:
        """Start on the reference and follow it.

        Returns
        -------
        (T, n) measured positions before rounding to what is recorded, and (T, n) commands.

        Raises
        ------
        SimulationError
            If the loop diverges.
        """
        data, places, zero = self.data, self.places, self._built.zero
        mujoco.mj_resetData(self.model, data)
        position, velocity = data.qpos, data.qvel  # views: they follow the data
        position[places] = loop.q_ref[0] + zero
        velocity[places] = loop.v_ref[0]
        measured, commands = np.empty_like(loop.q_ref), np.empty_like(loop.q_ref)
        rounding = loop.resolution > 0
        is_rounded = bool(rounding.any())
        unit = np.where(rounding, loop.resolution, 1.0)
        blend = -math.expm1(-2 * math.pi * loop.cutoff_hz / loop.rate_hz)
        ahead = loop.ahead + loop.kp * loop.q_ref + loop.kd * loop.v_ref
        steps = np.append(np.diff(loop.t), 1.0 / loop.rate_hz)
        usual = max(1, math.ceil(1.0 / (loop.rate_hz * LONGEST_STEP) - 1e-9))
        before, speed, last = None, loop.v_ref[0], None
        for k in range(len(loop.t)):
            true = position[places] - zero
            q = true + loop.noise[k]
            if loop.wrong is not None:
                q = q + loop.wrong(true)
            if is_rounded:
                q = np.where(rounding, np.rint(q / unit) * unit, q)
            if before is not None:
                speed = speed + blend * ((q - before) * loop.rate_hz - speed)
            before = q
            u = ahead[k] - loop.kp * q - loop.kd * speed
            measured[k], commands[k] = q, u
            self._advance(float(loop.t[k]), float(steps[k]), usual, u if last is None else last, u)
            last = u
            if not velocity.dot(velocity) < _RUNAWAY**2:  # true of NaN too
                remedy = "lower the controller's gains, or raise its rate_hz"
                raise SimulationError("the loop diverges", where, remedy, reason="unstable")
        return measured, commands

    def _advance(self, t: float, step: float, count: int, last: np.ndarray, u: np.ndarray) -> None:
        """Go from one sample to the next: the old command's half of the first step, then `u`."""
        model, data = self.model, self.data
        model.opt.timestep = step / count
        data.ctrl[:] = (last + u) / 2
        if self._is_plain:
            mujoco.mj_step(model, data)
            if count > 1:
                data.ctrl[:] = u
                mujoco.mj_step(model, data, nstep=count - 1)
            return
        command = u.tolist()
        for k in range(count):
            if k == 1:
                data.ctrl[:] = u
            self._apply(t + k * step / count, step / count, command)
            mujoco.mj_step(model, data)

    def _apply(self, t: float, step: float, command: list[float]) -> None:
        """Apply the laws that MuJoCo has not, at the start of a step."""
        built, data, width = self._built, self.data, self._width
        laws: Laws = built.laws
        # Velocities stand half a step behind positions: bring them up.
        everything, speeds = data.qpos.tolist(), (data.qvel + step / 2 * data.qacc).tolist()
        q = [everything[k] - z for k, z in zip(self.places, self._zero, strict=True)]
        v = [speeds[k] for k in self.places]
        force = [0.0] * len(q)
        for j, torque in laws.torques:
            force[j] += torque(t, q, v)
        for one in laws.drawn:
            force[one.law.joint] -= one.torque(step, q, v, command)
        for bristle in laws.bristles:
            bristle.advance(step, v[bristle.joint])
        levels = list(self._levels)
        tight = width == 0.0
        for j, level in laws.levels:
            levels[j] += level(t, v, command)
        if tight:
            if laws.levels:
                self.model.dof_frictionloss[self.places] = np.maximum(levels, 0.0)
        else:
            for j, level in enumerate(levels):
                force[j] -= level * math.tanh(v[j] / width)
            for j, i, level in laws.both:
                dry = level * math.tanh((v[j] + v[i]) / width)
                force[j] -= dry
                force[i] -= dry
        for j, damping in laws.dampings:
            dof = self.places[j]
            self.model.dof_damping[dof] = built.machine.damping[j] + damping(t)
        data.qfrc_applied[self.places] = force


def needed(robot: Robot, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Return the torques (T, n) that rigid bodies alone take, by MuJoCo's inverse dynamics."""
    plant = Plant(bare(robot), 0.0)
    model, data = plant.model, plant.data
    found = np.empty_like(q)
    for k in range(len(q)):
        data.qpos[plant.places], data.qvel[plant.places] = q[k], v[k]
        data.qacc[plant.places] = a[k]
        mujoco.mj_inverse(model, data)
        found[k] = data.qfrc_inverse[plant.places]
    return found
