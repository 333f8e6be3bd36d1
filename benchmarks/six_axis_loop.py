"""A six-axis arm under PD control whose accelerations are MuJoCo's, one recording at a time.

Shares no code with the package but the description of its bodies. Each recording has a motion and
noise of its own; the encoders' noise is fed back. Records begin and stop in mid-motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import mujoco as _mujoco
import numpy as np

from dynident.model import Model
from dynident.recording import Recording
from dynident.robot import Robot
from two_link_loop import torque_noise

mujoco: Any = _mujoco  # its names come from C

RATE = 1000.0
ROTOR = np.array([0.5, 0.5, 0.3, 0.06, 0.06, 0.04])
"""Of the drives, behind their gears, kg m^2."""
VISCOUS = np.array([4.0, 5.0, 3.0, 0.8, 1.0, 0.5])
COULOMB = np.array([5.0, 6.0, 4.0, 1.2, 1.5, 0.8])
WIDTH = 0.05
"""Of tanh(v / width) in the dry friction, rad/s."""

_DESCRIPTION = Path(__file__).parents[1] / "problems" / "staubli_tx40" / "tx40.urdf"
_SETTLING = 0.5  # s
_INERTIA = np.array([1.02, 1.18, 0.51, 0.064, 0.061, 0.04])  # about, for the gains, kg m^2
_BANDWIDTH, _DAMPING = 2 * np.pi * 6.0, 0.9  # of the loop: rad/s, of critical
_PERIOD = 8.0  # s, of the slowest wave


@dataclass(frozen=True, kw_only=True)
class SixAxisLab:
    """What the recordings of a case are like.

    Attributes
    ----------
    position_std : of the encoders' white noise, rad; it is fed back.
    torque_std : (6,) of the noise on the recorded torque, N m.
    colour_s : time over which that noise forgets itself; zero for white noise.
    seconds : of each recording.
    """

    position_std: float = 0.0
    torque_std: tuple[float, ...] = (2.0, 2.0, 1.5, 0.5, 0.5, 0.3)
    colour_s: float = 0.0
    seconds: float = 12.0

    def recordings(self, seeds: range) -> list[Recording]:
        """One recording for each seed."""
        return [self._recording(seed) for seed in seeds]

    def _recording(self, seed: int) -> Recording:
        rng = np.random.default_rng([seed, 66])
        t = np.arange(round((self.seconds + _SETTLING) * RATE) + 1) / RATE
        q_ref, v_ref = _references(rng, t)
        noise = rng.normal(size=q_ref.shape) * self.position_std
        begin = round(_SETTLING * RATE)
        q, tau = (x[begin:] for x in _moved(q_ref, v_ref, noise))
        wrong = torque_noise(rng, tau.shape, self.colour_s) * np.array(self.torque_std)
        return Recording(
            t[begin:] - t[begin],
            q,
            tau + wrong,
            _robot().names,
            q_ref=q_ref[begin:],
            torque="held_command",
            name=f"seed {seed}",
        )


def model() -> Model:
    """The arm with friction and with the drives that its bodies do not hide."""
    found = Model(_robot(), friction_width=WIDTH) + "viscous_friction" + "coulomb_friction"
    for joint in _robot().names[2:]:
        found = found + f"rotor_inertia@{joint}"
    return found


def truth(model: Model) -> np.ndarray:
    """Its true parameters, (p,)."""
    known = dict(zip(model.names, model.given_values(), strict=True))
    for j, joint in enumerate(model.robot.names):
        known[f"Fv@{joint}"], known[f"Fc@{joint}"] = VISCOUS[j], COULOMB[j]
        if j < 2:  # told only together with the link
            known[f"Izz.link{j + 1}"] += ROTOR[j]
        else:
            known[f"Ia@{joint}"] = ROTOR[j]
    return np.array([known[name] for name in model.names])


@cache
def _robot() -> Robot:
    return Robot.from_file(_DESCRIPTION)


@cache
def _plant() -> tuple[Any, Any]:
    plant = mujoco.MjModel.from_xml_path(str(_DESCRIPTION))
    plant.dof_armature[:] = ROTOR
    plant.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    return plant, mujoco.MjData(plant)


def _acceleration(q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
    plant, data = _plant()
    data.qpos, data.qvel = q, v
    data.qfrc_applied = tau - VISCOUS * v - COULOMB * np.tanh(v / WIDTH)
    mujoco.mj_forward(plant, data)
    return data.qacc.copy()


def _moved(
    q_ref: np.ndarray, v_ref: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Measured positions and commanded torques, (T, 6) each; a command is held for a sample."""
    h, kp, kd = 1.0 / RATE, _BANDWIDTH**2 * _INERTIA, 2 * _DAMPING * _BANDWIDTH * _INERTIA
    measured, commanded = np.empty_like(q_ref), np.empty_like(q_ref)
    q, v = q_ref[0].copy(), v_ref[0].copy()
    before = q - v * h
    for i in range(len(q_ref)):
        measured[i] = q + noise[i]
        rate, before = (measured[i] - before) / h, measured[i]
        tau = commanded[i] = kp * (q_ref[i] - measured[i]) + kd * (v_ref[i] - rate)
        middle = v + h / 2 * _acceleration(q, v, tau)
        a = _acceleration(q + h / 2 * v, middle, tau)
        q, v = q + h * middle, v + h * a
    return measured, commanded


def _references(rng: np.random.Generator, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Reference positions and velocities, (T, 6) each."""
    order = np.arange(1, 6)
    w = 2 * np.pi / _PERIOD * order
    waves = rng.normal(size=(2, 6, 5)) * 0.5 / order
    sin, cos = np.sin(t[:, None] * w), np.cos(t[:, None] * w)
    return sin @ waves[0].T + cos @ waves[1].T, (cos * w) @ waves[0].T - (sin * w) @ waves[1].T
