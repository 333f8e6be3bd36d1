"""The ten inertial parameters of a body: one order, their units and frames, and their validity."""

from dynident.inertia.margins import Margins, margins
from dynident.inertia.parameters import (
    PARAMETERS,
    UNITS,
    MassProperties,
    frame_change,
    from_com,
    inertia_matrix,
    pseudo_inertia,
    to_com,
)

__all__ = [
    "PARAMETERS",
    "UNITS",
    "Margins",
    "MassProperties",
    "frame_change",
    "from_com",
    "inertia_matrix",
    "margins",
    "pseudo_inertia",
    "to_com",
]
