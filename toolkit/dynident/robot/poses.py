"""Where the joints of a robot are at a posture, or at many."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from dynident.robot.robot import Robot


def poses(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orientation (..., n, 3, 3) and origin (..., n, 3) m of every joint frame in the world.

    Parameters
    ----------
    robot : as it is described.
    q : (..., n) rad or m.
    """
    postures = q.shape[:-1]
    base = np.broadcast_to(np.eye(3), (*postures, 3, 3)), np.zeros((*postures, 3))
    found: dict[int, tuple[np.ndarray, np.ndarray]] = {-1: base}

    def pose(index: int) -> tuple[np.ndarray, np.ndarray]:
        if index not in found:
            joint = robot.joints[index]
            R, p = pose(joint.parent)
            p, R = p + R @ joint.p, R @ joint.R
            if joint.kind == "revolute":
                turned = Rotation.from_rotvec(q[..., index, None] * joint.axis)
                R = R @ turned.as_matrix()
            else:
                p = p + R @ joint.axis * q[..., index, None]
            found[index] = R, p
        return found[index]

    every = [pose(index) for index in range(robot.n)]
    return np.stack([R for R, _ in every], axis=-3), np.stack([p for _, p in every], axis=-2)
