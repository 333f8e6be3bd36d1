"""Random motion within a robot's limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynident.robot.tree import Array, Joint

_REACH = {"revolute": np.pi, "prismatic": 1.0}
_SPEED = {"revolute": 3.0, "prismatic": 1.0}
_ACCELERATION = 10.0


def random_motion(joints: Sequence[Joint], seed: int, samples: int) -> tuple[Array, Array, Array]:
    """Return q, v, a (samples, n); see `Robot.random_motion`."""
    rng = np.random.default_rng(seed)
    spans = np.array([_span(joint) for joint in joints])
    speed = np.array([min(_SPEED[joint.kind], joint.velocity) for joint in joints])
    shape = (samples, len(joints))
    q = rng.uniform(spans[:, 0], spans[:, 1], shape)
    v = rng.uniform(-speed, speed, shape)
    a = rng.uniform(-_ACCELERATION, _ACCELERATION, shape)
    return q, v, a


def _span(joint: Joint) -> tuple[float, float]:
    """Return where the joint may go: its limits, completed where one is missing."""
    reach = _REACH[joint.kind]
    lower, upper = joint.lower, joint.upper
    if not np.isfinite(lower):
        lower = min(-reach, upper - 2.0 * reach) if np.isfinite(upper) else -reach
    if not np.isfinite(upper):
        upper = max(reach, lower + 2.0 * reach)
    return (lower, upper) if upper - lower >= 1e-3 * reach else (-reach, reach)
