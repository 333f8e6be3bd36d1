"""A model: a robot and the physical effects that it is said to have.

In: a robot and effects. Out: the parameters in which the torque is linear (`parametrised_robot`),
the robot that their values describe, and the columns of the regression (`torque_model`). This is
the one place that knows in which order columns can be evaluated: those of effects that make the
torque, along the bodies that the values describe, then those of effects that depend on the
torque; and of a whole recording once. Whether values are possible together say
`possible_values` and `friction_levels`, which knows the Coulomb friction of each joint;
`InertiaMatrices` are the joint-space inertia that they describe.
"""

from dynident.model.friction_levels import coulomb_levels, dry_joints, levels_not_met, not_met
from dynident.model.inertia_matrices import InertiaMatrices
from dynident.model.possible_values import Impossible, beyond_bounds, impossible_joints
from dynident.model.torque_model import Model

__all__ = [
    "Impossible",
    "InertiaMatrices",
    "Model",
    "beyond_bounds",
    "coulomb_levels",
    "dry_joints",
    "impossible_joints",
    "levels_not_met",
    "not_met",
]
