"""The fitted model's rigid robot along a motion, for effects that depend on it."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np

from dynident.effects.block import Block
from dynident.errors import EffectError
from dynident.robot import Robot

_POSES = 64
_RATE = 200.0
"""Hz at which the derivatives of the torque are evaluated."""


@dataclass(frozen=True, eq=False)
class Along:
    """The rigid robot along a motion: torque (T, n) and its derivatives (T, n, n)."""

    torque: np.ndarray
    by_q: np.ndarray
    by_v: np.ndarray
    by_a: np.ndarray


_ALONG: dict[int, tuple[Robot, np.ndarray, np.ndarray, Along]] = {}
"""By the identity of a motion's positions, for as long as these are alive."""
_MEAN: weakref.WeakKeyDictionary[Robot, np.ndarray] = weakref.WeakKeyDictionary()


def along_motion(block: Block) -> tuple[Robot, Along]:
    """Return the fitted model's robot, and what it does along a motion."""
    if block.body is None:
        raise EffectError("needs the fitted model's bodies", remedy="give the block a body")
    robot, key = block.body, id(block.q)
    kept = _ALONG.get(key)
    if kept is not None and kept[1] is block.v and kept[2] is block.a:
        same = kept[0] is robot or np.array_equal(kept[0].theta, robot.theta)
        if same and kept[0].names == robot.names:
            return robot, kept[3]
    along = Along(robot.inverse_dynamics(block.q, block.v, block.a), *_derivatives(robot, block))
    if kept is None:
        weakref.finalize(block.q, _ALONG.pop, key, None)
    _ALONG[key] = (robot, block.v, block.a, along)
    return robot, along


def _derivatives(robot: Robot, block: Block) -> tuple[np.ndarray, ...]:
    """Derivatives of the torque by q, v and a, (T, n, n) each.

    They cost most of all, and change as slowly as the motion: splines give them between samples.
    """
    step = float(np.mean(np.diff(block.t)))
    every = max(1, min(int(1.0 / (_RATE * step)), len(block.t) // 4))
    rows = np.unique(np.append(np.arange(0, len(block.t), every), len(block.t) - 1))
    by = robot.torque_derivatives(block.q[rows], block.v[rows], block.a[rows])
    if every == 1:
        return by.by_q, by.by_v, by.by_a
    from scipy.interpolate import make_interp_spline

    every = np.stack([by.by_q, by.by_v, by.by_a], axis=1)
    return tuple(make_interp_spline(rows, every, k=3)(np.arange(len(block.t))).swapaxes(0, 1))


def mean_inertia(robot: Robot, joint: int) -> float:
    """Return the joint-space inertia of a joint in the mean over the poses that it can take."""
    if robot not in _MEAN:
        q, _, _ = robot.random_motion(0, _POSES)
        still = np.zeros_like(q)
        mass = robot.torque_derivatives(q, still, still).by_a
        _MEAN[robot] = np.diagonal(mass, axis1=1, axis2=2).mean(axis=0)
    return float(_MEAN[robot][joint])


def share_of_rotor(block: Block, joint: int) -> float | None:
    """Return the motor's share of a joint's inertia in the fitted model; None if unknown."""
    if block.body is None or block.rotor is None or not block.rotor[joint] > 0:
        return None
    rotor = float(block.rotor[joint])
    link = mean_inertia(block.empty or block.body, joint)
    return float(np.clip(rotor / (rotor + link), 0.02, 0.9)) if link > 0 else None
