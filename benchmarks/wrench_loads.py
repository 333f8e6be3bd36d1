"""Weigh unknown loads with a wrench sensor at the wrist of six-joint arms.

    python benchmarks/wrench_loads.py --robots 20 [--first 500]

Arm, place of the sensor, its constants, a tool and a load (1 to 3 kg) are drawn at random; the
motion has five harmonics. The wrench is the body's own equation of motion, f = m (a - g) and
n = dL/dt about the sensor's origin, worked out here from poses alone, with noise as sensors of 100
to 300 N have it, and encoders of 2e-5 rad. Recorded are the tool, and the tool with the load. The
table says how far mass and centre of the load are off, how often 95 % intervals hold the truth, and
how many of the loads are said to be possible.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np

import dynident as di
from arms import chain
from drive_gains import INERTIA_PLACES, JOINTS, drawn_body
from dynident.fitting.loads import Load
from dynident.fitting.wrench_sensor import WrenchProblem, fit_wrench
from dynident.inertia import to_com
from dynident.recording import COMPONENTS, Dataset, Recording
from dynident.robot import Robot

RATE_HZ, SECONDS = 200.0, 20.0
FRAME = "ft_sensor"
NOISE = np.array([0.3, 0.3, 0.5, 0.01, 0.01, 0.008])
"""Standard deviations of a raw sample, N and N m."""
POSITION_STD = 2e-5  # rad
GRAVITY = np.array([0.0, 0.0, -9.81])
_Z = 1.959964
_STEP = 1e-4  # s, of the differences that make speeds and accelerations of poses


@dataclass(frozen=True, eq=False)
class SensorArm:
    """An arm with a sensor, and the pose of the last joint's frame.

    Attributes
    ----------
    robot : with the sensor's frame as a link.
    R, p : of the sensor in the last link.
    placements : (6, 4, 4) of each joint before it turns about its z axis.
    constants : (6,) that the sensor adds, N and N m.
    """

    robot: Robot
    R: np.ndarray
    p: np.ndarray
    placements: np.ndarray
    constants: np.ndarray

    def pose(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Axes (T, 3, 3) and origin (T, 3) of the sensor in the base for positions (T, 6)."""
        R, p = np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3))
        for placed, angle in zip(self.placements, q.T, strict=True):
            p = p + R @ placed[:3, 3]
            R = R @ placed[:3, :3] @ _about_z(angle)
        return R @ self.R, p + R @ self.p


def _about_z(angle: np.ndarray) -> np.ndarray:
    found = np.zeros((len(angle), 3, 3))
    found[:, 0, 0] = found[:, 1, 1] = np.cos(angle)
    found[:, 1, 0], found[:, 0, 1] = np.sin(angle), -np.sin(angle)
    found[:, 2, 2] = 1.0
    return found


def _turned(rpy: np.ndarray) -> np.ndarray:
    """Rotation of a description's roll, pitch and yaw."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ pitch @ roll


def sensor_arm(rng: np.random.Generator) -> SensorArm:
    """The chain of the benchmarks with a sensor at an odd angle behind its last joint."""
    p, rpy = rng.uniform(-0.1, 0.15, 3), rng.uniform(-2, 2, 3)
    xyz, turns = (" ".join(repr(float(x)) for x in one) for one in (p, rpy))
    plain = chain(JOINTS).description
    assert plain is not None
    text = plain.text.replace(
        "</robot>",
        f'<link name="{FRAME}"/><joint name="mount" type="fixed"><parent link="l5"/>'
        f'<child link="{FRAME}"/><origin xyz="{xyz}" rpy="{turns}"/></joint></robot>',
    )
    placements = np.tile(np.eye(4), (JOINTS, 1, 1))
    for k, placed in enumerate(placements):
        placed[:3, :3] = _turned(np.array([1.5708 * (-1) ** k, 0, 0]))
        placed[2, 3] = 0.3 if k else 0.0
    constants = rng.normal(size=6) * np.array([8, 8, 8, 0.4, 0.4, 0.4])
    return SensorArm(Robot.from_text(text), _turned(rpy), p, placements, constants)


class Motion:
    """Joints that follow five harmonics."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.sin, self.cos = 0.7 * rng.normal(size=(2, JOINTS, 5)) / np.arange(1, 6)
        self.k = 2 * np.pi / SECONDS * np.arange(1, 6) * 2

    def at(self, t: np.ndarray) -> np.ndarray:
        """Positions (T, 6) rad."""
        return np.sin(t[:, None] * self.k) @ self.sin.T + np.cos(t[:, None] * self.k) @ self.cos.T


def wrench(arm: SensorArm, motion: Motion, t: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """What moves a body with parameters phi in the sensor's frame, (T, 6), about its origin."""
    load = to_com(phi)
    poses = [arm.pose(motion.at(t + k * _STEP)) for k in (-2, -1, 0, 1, 2)]
    centres = [p + R @ load.com for R, p in poses]
    (R, p), centre = poses[2], centres[2]
    acceleration = (centres[1] - 2 * centre + centres[3]) / _STEP**2
    force = load.mass * (acceleration - GRAVITY)

    def momentum(before: int, at: int, after: int) -> np.ndarray:
        """Of the turning body about its centre."""
        own, rate = poses[at][0], (poses[after][0] - poses[before][0]) / (2 * _STEP)
        spin = rate @ own.transpose(0, 2, 1)
        speed = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        inertia = own @ load.inertia_com @ own.transpose(0, 2, 1)
        return np.einsum("tij,tj->ti", inertia, speed)

    moment = (momentum(2, 3, 4) - momentum(0, 1, 2)) / (2 * _STEP) + np.cross(centre - p, force)
    own = R.transpose(0, 2, 1)
    return np.hstack([np.einsum("tij,tj->ti", own, one) for one in (force, moment)])


def recording(arm: SensorArm, phi: np.ndarray, load: str, rng: np.random.Generator) -> Recording:
    """Positions and wrenches as a sensor with constants, and encoders, report them."""
    t, motion = np.arange(round(SECONDS * RATE_HZ) + 1) / RATE_HZ, Motion(rng)
    seen = wrench(arm, motion, t, phi) + arm.constants
    seen = seen + NOISE * rng.normal(size=seen.shape)
    q = motion.at(t)
    q = q + POSITION_STD * rng.normal(size=q.shape)
    return Recording(
        t,
        np.hstack([q, np.zeros((len(t), 6))]),
        np.hstack([np.zeros_like(q), seen]),
        (*arm.robot.names, *(f"wrench.{FRAME}.{one}" for one in COMPONENTS)),
        load=load,
        name=load or "empty",
        number=1 + bool(load),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--first", type=int, default=500, help="seed to begin with")
    said = parser.parse_args()
    masses, centres, inertias, scores, possible = [], [], [], [], 0
    for seed in range(said.first, said.first + said.robots):
        rng = np.random.default_rng([seed, 31])
        arm = sensor_arm(rng)
        tool, phi = drawn_body(rng), drawn_body(rng)
        data = Dataset(
            (recording(arm, tool, "", rng), recording(arm, tool + phi, "crate", rng)),
        )
        found = fit_wrench(WrenchProblem(arm.robot, FRAME, data, (Load(name="crate"),)))
        crate, truth = found.loads[-1], to_com(phi)
        inertia = [truth.inertia_com[place] for place in INERTIA_PLACES]
        masses.append(abs(crate.values[0] / truth.mass - 1))
        centres.append(float(np.linalg.norm(crate.values[1:4] - truth.com)))
        off = np.linalg.norm(crate.values[4:] - inertia) / np.linalg.norm(inertia)
        inertias.append(float(off))
        scores += list((crate.values - [truth.mass, *truth.com, *inertia]) / crate.sigma)
        possible += crate.is_consistent
    inside = np.mean(np.abs(scores) < _Z)
    print(f"dynident {di.__version__}, {said.robots} arms from seed {said.first}")
    print(f"mass off: {100 * np.median(masses):.2f} % (median), {100 * max(masses):.2f} % at worst")
    print(f"centre off: {1e3 * np.median(centres):.2f} mm, {1e3 * max(centres):.2f} mm at worst")
    print(f"inertia off: {100 * np.median(inertias):.0f} %, {100 * max(inertias):.0f} % at worst")
    print(
        f"95 % intervals of mass, centre and inertia hold the truth: {inside:.3f} ({len(scores)})"
    )
    print(f"said to be possible: {possible} of {said.robots}")


if __name__ == "__main__":
    main()
