"""A base that does not stand upright."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dynident.effects.bodies.turn import turn_about
from dynident.effects.effect import Block, Forceless, Parameter
from dynident.effects.traits import Needs

_NEXT_TO_NOTHING = 1e-4  # rad: below it the series of the sinc is exact to rounding


class BaseTilt(Forceless):
    """The base is turned by a rotation vector (rx, ry, 0) in the world's axes; gravity stays.

    Turning it about the vertical changes nothing. In the base's own axes it is gravity that turns,
    the other way: with r the rotation vector, its change is -A r x g + B r x (r x g) with
    A = sin|r| / |r| and B = (1 - cos|r|) / |r|^2 (Rodrigues). Each of rx and ry has its share of
    r x in both terms, so that the columns at (rx, ry) times (rx, ry) are the exact torque.
    """

    name = "base_tilt"
    place = "robot"
    law = "Y(q, 0, 0; turned gravity) theta"
    sign_of = "a residual like the robot's own weight, but sideways"
    meaning = (
        "the robot does not stand upright, so gravity pulls in another direction than the "
        "model says"
    )
    confounded_with = ("joint_zero", "joint_spring")
    shown_by = "position range"
    experiment = (
        "move slowly through poses of all joints, the first one turned as far as it goes (an axis "
        "about which turning the base does not change the load on the joints stays untold)"
    )
    needs = Needs.BODIES
    nonlinear = True

    def parameters(self, robot):
        return tuple(
            Parameter(f"r{axis}", "rad", -1.0, 1.0, means=f"rotation of the base about {axis}")
            for axis in "xy"
        )

    def columns(self, block: Block) -> np.ndarray:
        body = block.fitted_robot(self.label)
        rx, ry = self.point or (0.0, 0.0)
        first, second = _sine_and_cosine(float(np.hypot(rx, ry)))
        r = np.array([rx, ry, 0.0])
        turned = np.cross(np.eye(3)[:2], body.gravity)
        change = -first * turned + second * np.cross(r, turned)
        still, columns = np.zeros_like(block.q), np.zeros((*block.q.shape, 2))
        # What a robot at rest takes is linear in gravity. For every other direction of it, as in
        # each round of a fit, a function of many samples would be made anew; these three are kept.
        for axis, parts in zip(np.eye(3), change.T, strict=True):
            if parts.any():
                torque = body.with_gravity(axis).inverse_dynamics(block.q, still, still)
                columns += parts * torque[:, :, None]
        return columns

    def simulated_robot(self, values, robot):
        turn = _rotation(values)
        joints = tuple(
            replace(joint, R=turn @ joint.R, p=turn @ joint.p) if joint.parent == -1 else joint
            for joint in robot.joints
        )
        links = tuple(
            replace(link, R=turn @ link.R, p=turn @ link.p) if link.joint == -1 else link
            for link in robot.links
        )
        return replace(robot, joints=joints, links=links)


def _sine_and_cosine(angle: float) -> tuple[float, float]:
    """Return sin(x) / x and (1 - cos(x)) / x^2."""
    if angle < _NEXT_TO_NOTHING:
        return 1.0 - angle**2 / 6, 0.5 - angle**2 / 24
    return float(np.sin(angle)) / angle, 2.0 * float(np.sin(angle / 2) / angle) ** 2


def _rotation(values) -> np.ndarray:
    """Rotation matrix of the rotation vector (rx, ry, 0)."""
    r = np.array([values[0], values[1], 0.0])
    angle = float(np.linalg.norm(r))
    return turn_about(r, angle) if angle > 0 else np.eye(3)
