"""Rotation matrices from the angles and quaternions that descriptions use."""

from __future__ import annotations

import numpy as np

from dynident.robot.tree import Array


def about(axis: str, angle: float) -> Array:
    """Return the (3, 3) rotation by `angle` (rad) about "x", "y" or "z"."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    R = np.eye(3)
    R[j, j] = R[k, k] = np.cos(angle)
    R[k, j] = np.sin(angle)
    R[j, k] = -R[k, j]
    return R


def from_rpy(rpy: Array) -> Array:
    """Return Rz(yaw) Ry(pitch) Rx(roll), angles in rad; identity exactly for zero angles."""
    with np.errstate(invalid="ignore"):
        R = about("z", rpy[2]) @ about("y", rpy[1]) @ about("x", rpy[0])
    return R


def from_quaternion(wxyz: Array) -> Array:
    """Return the rotation of a quaternion (w, x, y, z), normalised first."""
    w, x, y, z = wxyz / np.linalg.norm(wxyz)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def from_axis_angle(axis: Array, angle: float) -> Array:
    """Return the rotation by `angle` (rad) about an axis, normalised first."""
    half = 0.5 * angle
    return from_quaternion(np.array([np.cos(half), *(np.sin(half) * axis / np.linalg.norm(axis))]))
