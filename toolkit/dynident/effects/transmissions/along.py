"""The fitted model's rigid robot along a motion, for effects that depend on it."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np

from dynident.effects.block import Block
from dynident.errors import EffectError
from dynident.robot import Robot
from dynident.robot.dynamics import TorqueDerivatives
from dynident.robot.joint_derivatives import JointDerivatives

_POSES = 64
_RATE = 200.0
"""Hz at which the derivatives of the torque are evaluated."""


class Along:
    """The rigid robot along a motion.

    Parameters
    ----------
    robot : the fitted model's.
    block : the motion.

    Attributes
    ----------
    torque : (T, n) N m or N.
    latest : what was made of it last, and of what else; for whoever makes it to keep.
    """

    def __init__(self, robot: Robot, block: Block) -> None:
        self.torque = robot.inverse_dynamics(block.q, block.v, block.a)
        step, self._samples = float(np.mean(np.diff(block.t))), len(block.t)
        every = max(1, min(int(1.0 / (_RATE * step)), self._samples // 4))
        last = self._samples - 1
        self._rows = np.append(np.arange(0, last, every), last)
        # Copies: what is kept as long as the positions live must not keep them alive.
        motion = (x[self._rows] for x in (block.q, block.v, block.a))
        self._derivatives = JointDerivatives(robot, *motion)
        self._between: dict[int, TorqueDerivatives] = {}
        self.latest: tuple[tuple[Any, ...], Any] | None = None

    def by(self, joint: int) -> TorqueDerivatives:
        """Return the derivatives of the torque by one joint's q, v and a, (T, n) each.

        They cost most of all, and change as slowly as the motion: splines give them between
        samples.

        Parameters
        ----------
        joint : column of the joint.
        """
        found = self._derivatives.by(joint)
        if len(self._rows) == self._samples:
            return found
        if joint not in self._between:
            from scipy.interpolate import make_interp_spline

            some = np.stack([found.by_q, found.by_v, found.by_a], axis=1)
            spline = make_interp_spline(self._rows, some, k=3)
            self._between[joint] = TorqueDerivatives(
                *spline(np.arange(self._samples)).swapaxes(0, 1)
            )
        return self._between[joint]


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
    along = Along(robot, block)
    if kept is None:
        weakref.finalize(block.q, _ALONG.pop, key, None)
    _ALONG[key] = (robot, block.v, block.a, along)
    return robot, along


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
