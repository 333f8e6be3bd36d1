"""The same tree as a Drake plant.

Drake never sees the description's inertias: each moving body gets the merged parameters that
we set, non-physical ones included, as long as the mass matrix stays positive definite.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dynident.inertia import to_drake
from dynident.robot.robot import Robot
from dynident.robot.tree import Array

if TYPE_CHECKING:
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import (
        Joint,
        JointActuator,
        ModelInstanceIndex,
        RigidBody,
    )


@dataclass(frozen=True, eq=False)
class DrakeRobot:
    """A robot inside a plant.

    Attributes
    ----------
    instance : ModelInstanceIndex
    bodies : tuple of RigidBody
        One per moving body; its frame is our joint frame, so `theta` is about its origin.
    joints : tuple of Joint
    actuators : tuple of JointActuator
        Bodies, joints and actuators are in the order of `Robot.joints`. The plant's own vectors
        may be ordered otherwise: use the indices.
    """

    instance: ModelInstanceIndex
    bodies: tuple[RigidBody, ...]
    joints: tuple[Joint, ...]
    actuators: tuple[JointActuator, ...]

    def position_indices(self) -> np.ndarray:
        """Return where each joint's q stands in the plant's positions (n,); after Finalize."""
        return np.array([joint.position_start() for joint in self.joints])

    def velocity_indices(self) -> np.ndarray:
        """Return where each joint's v stands in the plant's velocities (n,); after Finalize."""
        return np.array([joint.velocity_start() for joint in self.joints])

    def input_indices(self) -> np.ndarray:
        """Return where each actuator stands in the plant's actuation (n,); after Finalize."""
        return np.array([actuator.input_start() for actuator in self.actuators])


def add_to_plant(robot: Robot, plant: MultibodyPlant) -> DrakeRobot:
    """Add a robot to a plant that is not finalized yet, and set the plant's gravity to its own.

    Joints carry no limits, damping or effort limits: what the plant does is the rigid body
    alone, and everything else is an effect.

    Parameters
    ----------
    robot : Robot
        Its `theta` and gravity are what the plant gets.
    plant : pydrake.multibody.plant.MultibodyPlant
        Not finalized yet.

    Raises
    ------
    RobotError
        If a moving body's parameters are not finite, or have a first moment without mass.
    """
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.multibody.tree import FixedOffsetFrame, PrismaticJoint, RevoluteJoint

    inertias = [
        to_drake(phi, f"body '{body}'")
        for body, phi in zip(robot.bodies, robot.theta.reshape(-1, 10), strict=True)
    ]
    instance = plant.AddModelInstance(robot.name)
    bodies = tuple(
        plant.AddRigidBody(name, instance, inertia)
        for name, inertia in zip(robot.bodies, inertias, strict=True)
    )
    joints, actuators = [], []
    for joint, body in zip(robot.joints, bodies, strict=True):
        base = plant.world_frame() if joint.parent < 0 else bodies[joint.parent].body_frame()
        # Rotations from a file are orthogonal up to its digits; Drake wants them exactly so.
        X = RigidTransform(RotationMatrix.ProjectToRotationMatrix(_own(joint.R)), _own(joint.p))
        frame = plant.AddFrame(FixedOffsetFrame(f"{joint.name}_parent", base, X, instance))
        kind = RevoluteJoint if joint.kind == "revolute" else PrismaticJoint
        added = plant.AddJoint(
            kind(joint.name, frame, body.body_frame(), _own(joint.axis), damping=0.0)
        )
        joints.append(added)
        actuators.append(plant.AddJointActuator(joint.name, added))
    plant.mutable_gravity_field().set_gravity_vector(_own(robot.gravity))
    return DrakeRobot(instance, bodies, tuple(joints), tuple(actuators))


def _own(array: Array) -> Any:
    """A writable copy: the bindings take no read-only arrays, and their types fit no shape."""
    return np.array(array)
