"""Sets of robots that an estimate is to lie in, stated on the standard parameters.

What comes in is a model: `ParameterSpace.of(model)` are its standard parameters x, ten of each link
in the link's own frame and then those of the effects, with their units, bounds and sizes, and with
the matrix that makes the model's identifiable values of them. Of a robot it takes the links whose
inertia is stated or that a joint drives (`stated_links`), their extents (`link_lengths`), and a
consistent body of the size of each (`reference_bodies`), which is what "large" and "near" mean.

What goes out is convex: each set answers `on(space)` with linear constraints (`Linear`,
lower <= A x <= upper) and second-order cones (`SecondOrder`), which `dynident.nlp` puts to a conic
or a nonlinear program. That every body is consistent is no such set but a `Consistency`, which each
program has in its own way: as a matrix inequality, or by parameters that are consistent whatever
their values. `Within` is all of it together, and what `dynident.Constrained`, `dynident.project`
and `dynident.refit` are given:

>>> within = Within("full", sets=[TotalMass(20.0, 21.0), Known("m.hand", 0.73)])

A scale gives `TotalMass`; a drawing `Known`, `Bounds`, `Sum`, `CentreInBox`, `CentreInEllipsoid`
and `Symmetric`; an analysis `Vanishing`. Another set is a class with `on` (`ConstraintSet`): no
program has to know of it.
"""

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
