"""Sets of robots that an estimate may have to lie in, stated on the standard parameters."""

from dynident.constraints.sets import (
    Bounds,
    CentreInBox,
    CentreInEllipsoid,
    Consistency,
    ConstraintSet,
    Known,
    Linear,
    SecondOrder,
    Sum,
    Symmetric,
    TotalMass,
    Vanishing,
    Within,
)
from dynident.constraints.space import (
    ParameterSpace,
    body_scale,
    link_lengths,
    reference_bodies,
    stated_links,
)

__all__ = [
    "Bounds",
    "CentreInBox",
    "CentreInEllipsoid",
    "Consistency",
    "ConstraintSet",
    "Known",
    "Linear",
    "ParameterSpace",
    "SecondOrder",
    "Sum",
    "Symmetric",
    "TotalMass",
    "Vanishing",
    "Within",
    "body_scale",
    "link_lengths",
    "reference_bodies",
    "stated_links",
]
