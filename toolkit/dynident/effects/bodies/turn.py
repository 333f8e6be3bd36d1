"""Turns of a joint or of the base."""

from __future__ import annotations

import numpy as np


def turn_about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the rotation (3, 3) by `angle` (rad) about an axis (3,) of any length but zero.

    The identity and a change, by half the angle: a coordinate axis stays where it is to the last
    bit when the body turns about it, and a small turn is rounded less than by SciPy's rotations.
    That matters where a dead zone follows, whose response amplifies rounding errors.
    """
    half = 0.5 * angle
    turn = np.array([np.cos(half), *(np.sin(half) * axis / np.linalg.norm(axis))])
    w, x, y, z = turn / np.linalg.norm(turn)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
