"""Where the joints of a robot are at a posture."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from dynident.robot.robot import Robot


def poses(robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orientation (n, 3, 3) and origin (n, 3) m of every joint frame in the world at q (n,)."""
    found: dict[int, tuple[np.ndarray, np.ndarray]] = {-1: (np.eye(3), np.zeros(3))}

    def pose(index: int) -> tuple[np.ndarray, np.ndarray]:
        if index not in found:
            joint = robot.joints[index]
            R, p = pose(joint.parent)
            p, R = p + R @ joint.p, R @ joint.R
            if joint.kind == "revolute":
                R = R @ Rotation.from_rotvec(q[index] * joint.axis).as_matrix()
            else:
                p = p + R @ joint.axis * q[index]
            found[index] = R, p
        return found[index]

    every = [pose(index) for index in range(robot.n)]
    return np.stack([R for R, _ in every]), np.stack([p for _, p in every])
