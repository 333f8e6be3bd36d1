"""Six-joint arms with a wrench sensor at an odd angle behind the last joint, and what it records.

Wrenches are Pinocchio's: the force that a joint has to pass on to the body behind it.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from chains import chain_text
from dynident.inertia import frame_change, from_com, to_pinocchio
from dynident.recording import COMPONENTS, Recording
from dynident.robot import Robot
from synthetic import smooth_motion

N = 6
FRAME = "ft_sensor"
_SENSOR = (
    f'<link name="{FRAME}"/><joint name="mount" type="fixed"><parent link="l5"/>'
    f'<child link="{FRAME}"/><origin xyz="0.02 -0.03 0.12" rpy="0.4 -1.1 2.0"/></joint></robot>'
)
CONSTANTS = np.array([4.0, -7.0, 12.0, 0.3, -0.5, 0.2])
NOISE = np.array([0.3, 0.3, 0.5, 0.01, 0.01, 0.008])
"""Standard deviations of a raw sample, N and N m: those of wrist sensors of 100 to 300 N."""
TOOL = from_com(1.6, [0.01, -0.02, 0.06], np.diag([0.004, 0.005, 0.003]))
CRATE = from_com(
    2.8, [-0.03, 0.05, 0.11], [[0.016, 0.002, 0], [0.002, 0.012, -0.001], [0, -0.001, 0.009]]
)


def text() -> str:
    return chain_text(N, 4).replace("</robot>", _SENSOR)


@cache
def robot() -> Robot:
    return Robot.from_text(text())


def wrenches(phi: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """What moves a body with parameters phi in the sensor's frame, (T, 6) in that frame."""
    import pinocchio

    pin: Any = pinocchio
    (link,) = (one for one in robot().links if one.name == FRAME)
    bare = robot().with_theta(np.zeros(10 * N))
    model = bare.pinocchio()
    last = model.njoints - 1
    model.inertias[last] = to_pinocchio(frame_change(link.R, link.p) @ phi, "load")
    data, placement = model.createData(), pin.SE3(np.array(link.R), np.array(link.p))
    found = np.zeros((len(q), 6))
    for row, sample in zip(found, zip(q, v, a, strict=True), strict=True):
        pin.rnea(model, data, *sample)
        row[:] = placement.actInv(data.f[last]).vector
    return found


def motion(seed: int, seconds: float = 20.0, amplitude: float = 0.7) -> tuple[np.ndarray, ...]:
    return smooth_motion(N, seed, 200.0, seconds, 10.0, amplitude)


def recorded(
    phi: np.ndarray,
    path: tuple[np.ndarray, ...],
    seed: int,
    *,
    load: str = "",
    noise: float = 1.0,
    position_std: float = 2e-5,
) -> Recording:
    """A recording as `read_wrench` makes it."""
    rng = np.random.default_rng([seed, 3])
    t, q, v, a = path
    wrench = wrenches(phi, q, v, a) + CONSTANTS
    wrench = wrench + noise * NOISE * rng.normal(size=wrench.shape)
    q = q + position_std * rng.normal(size=q.shape)
    return Recording(
        t,
        np.hstack([q, np.zeros((len(t), 6))]),
        np.hstack([np.zeros_like(q), wrench]),
        (*robot().names, *(f"wrench.{FRAME}.{one}" for one in COMPONENTS)),
        load=load,
        name=f"r{seed}",
        number=seed,
    )
