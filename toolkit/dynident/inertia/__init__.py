"""The ten inertial parameters of a body: one order, their units, other forms, validity."""

from dynident.inertia.conversions import (
    PAPER_ORDER,
    from_drake,
    from_paper,
    from_pinocchio,
    from_pseudo_inertia,
    from_spatial_inertia_matrix,
    spatial_inertia_matrix,
    to_drake,
    to_paper,
    to_pinocchio,
)
from dynident.inertia.log_cholesky import (
    LOG_CHOLESKY,
    from_log_cholesky,
    log_cholesky,
    log_cholesky_entries,
    log_cholesky_jacobian,
)
from dynident.inertia.margins import Margins, margins
from dynident.inertia.parameters import (
    LARGEST,
    PARAMETERS,
    UNITS,
    MassProperties,
    frame_change,
    from_com,
    inertia_matrix,
    pseudo_inertia,
    to_com,
)
from dynident.inertia.reference import distance_rows, reference_body
from dynident.inertia.virtual import (
    VIRTUAL,
    VirtualBody,
    from_virtual,
    virtual,
    virtual_entries,
    virtual_jacobian,
)

__all__ = [
    "LARGEST",
    "LOG_CHOLESKY",
    "PAPER_ORDER",
    "PARAMETERS",
    "UNITS",
    "VIRTUAL",
    "Margins",
    "MassProperties",
    "VirtualBody",
    "distance_rows",
    "frame_change",
    "from_com",
    "from_drake",
    "from_log_cholesky",
    "from_paper",
    "from_pinocchio",
    "from_pseudo_inertia",
    "from_spatial_inertia_matrix",
    "from_virtual",
    "inertia_matrix",
    "log_cholesky",
    "log_cholesky_entries",
    "log_cholesky_jacobian",
    "margins",
    "pseudo_inertia",
    "reference_body",
    "spatial_inertia_matrix",
    "to_com",
    "to_drake",
    "to_paper",
    "to_pinocchio",
    "virtual",
    "virtual_entries",
    "virtual_jacobian",
]
