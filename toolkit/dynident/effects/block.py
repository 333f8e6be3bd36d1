"""Samples of a recording as effects see them."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property, reduce
from operator import mul

import numpy as np

from dynident.errors import EffectError
from dynident.robot import Robot
from dynident.robot.joint_derivatives import JointDerivatives
from dynident.words import nearest

FRICTION_WIDTH = 0.01
"""Speed (rad/s, or m/s for a prismatic joint) over which dry friction changes its sign.

The one law of dry friction in this package, in regression and in simulation, is
tanh(v / FRICTION_WIDTH); a study may set another width for all of its joints at once, and a model
another one for each joint.
"""


@dataclass(frozen=True)
class Block:
    """Consecutive samples of one recording, as effects see them.

    Attributes
    ----------
    t : (T,) s, from the start of the session.
    q, v, a : (T, n) rad or m, and their derivatives.
    names : the joints, in the order of the columns of q.
    friction_width : rad/s or m/s, see `FRICTION_WIDTH`; of all joints, or (n,) of each.
    carries_payload : whether the payload under study is on the robot.
    tip : column of the joint that carries the last link, where a payload is mounted.
    rigid : (T, n, 10 n) the rigid-body regressor; None where no effect in use needs it.
    torque : (T, n) N m or N, torque that the fitted model predicts; None where none needs it.
    body : the robot with the inertias of the fitted model, and with its payload where that is on
        board; None where no effect in use needs it.
    empty : the same robot without its payload, with `body`.
    rotor : (n,) kg m^2 or kg, motor inertia that the fitted model adds to the bodies'; with
        `body`.
    period : s after which the motion repeats; None where it does not, or for a part of a recording.
    number : of the recording in its study, from 1; 0 where that does not matter.
    temperature : (T, n) degrees Celsius of the motors, NaN where it is not recorded; or None.
    memory : (T, m) internal state of the one effect that is simulated; None otherwise.
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    _: KW_ONLY
    names: tuple[str, ...]
    friction_width: float | np.ndarray = FRICTION_WIDTH
    carries_payload: bool = False
    tip: int = -1
    rigid: np.ndarray | None = None
    torque: np.ndarray | None = None
    body: Robot | None = None
    empty: Robot | None = None
    rotor: np.ndarray | None = None
    period: float | None = None
    number: int = 0
    temperature: np.ndarray | None = None
    memory: np.ndarray | None = None

    def index(self, joint: str | None) -> int:
        """Column of a joint."""
        if joint not in self.names:
            remedy = nearest(str(joint), self.names, "joints")
            raise EffectError(f"no joint '{joint}'", remedy=remedy)
        return self.names.index(joint)

    def fitted_robot(self, label: str) -> Robot:
        """The fitted model's robot; `label` names the effect that needs it.

        Raises
        ------
        EffectError
            If the block has none.
        """
        if self.body is None:
            raise EffectError("needs the fitted model's robot in the block", label)
        return self.body

    @cached_property
    def derivatives(self) -> JointDerivatives:
        """Derivatives of the torque of `body` by q, v and a; made once, for all effects."""
        robot = self.fitted_robot("the derivatives of the torque")
        return JointDerivatives(robot, self.q, self.v, self.a)

    def sign(self, speed: np.ndarray, *joints: str | None) -> np.ndarray:
        """Smoothed sign of a speed at joints, the package's one law of dry friction.

        Of several joints, whose speeds were added, the largest width counts.
        """
        return np.tanh(speed / self._width(*joints))

    def sign_slope(self, sign: np.ndarray, *joints: str | None) -> np.ndarray:
        """Return the derivative of `sign` by the speed, where that is `sign`; s/rad or s/m."""
        return (1.0 - sign * sign) / self._width(*joints)

    def _width(self, *joints: str | None) -> float:
        widths = np.broadcast_to(self.friction_width, len(self.names))
        return max(float(widths[self.index(joint)]) for joint in joints)

    def direction(self, joint: str | None) -> np.ndarray:
        """Smoothed sign of a joint's own speed, (T, 1); made once, for all that ask."""
        if joint not in self._directions:
            self._directions[joint] = self.sign(self.v[:, [self.index(joint)]], joint)
        return self._directions[joint]

    def circling(self, joint: str | None, times: int) -> np.ndarray:
        """exp(i times q) of a joint's position q, (T,), of whole numbers from 1 on.

        A product of its powers of two, which are made once, for all that ask: several times as fast
        as sine and cosine.
        """
        powers = self._circling.get(joint) or (np.exp(1j * self.q[:, self.index(joint)]),)
        while len(powers) < times.bit_length():
            powers = (*powers, powers[-1] ** 2)
        self._circling[joint] = powers
        return reduce(mul, (one for k, one in enumerate(powers) if times >> k & 1))

    @cached_property
    def _circling(self) -> dict[str | None, tuple[np.ndarray, ...]]:
        return {}

    @cached_property
    def _directions(self) -> dict[str | None, np.ndarray]:
        return {}
