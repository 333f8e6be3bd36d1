"""Robot descriptions in and out, the regressor, and base parameters."""

from dynident.robot.base_parameters import (
    BaseParameters,
    base_parameters,
    nearest_parameters,
    structural_base,
    written_out,
)
from dynident.robot.robot import Robot
from dynident.robot.tree import Description, Joint, Link

__all__ = [
    "BaseParameters",
    "Description",
    "Joint",
    "Link",
    "Robot",
    "base_parameters",
    "nearest_parameters",
    "structural_base",
    "written_out",
]
