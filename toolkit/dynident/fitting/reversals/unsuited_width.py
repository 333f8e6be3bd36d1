"""Whether dry friction reverses over another speed than the friction width that is stated.

Nothing looks wrong then in a residual: its rows around reversals are few. But friction that is made
to reverse too slowly is made up for at speed, and Coulomb and viscous friction are off by many of
their standard deviations.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from dynident.errors import FitError
from dynident.fitting.estimate import Estimate
from dynident.fitting.least_squares import LeastSquares
from dynident.fitting.uncertainty.shape_slopes import width_slope
from dynident.model import coulomb_levels, dry_joints
from dynident.recording import Dataset
from dynident.tables import listed, number

_CLEARLY = 4.0
"""Standard errors of the change of a width from which it is no chance: of healthy arms' joints 3 is
the most that was seen."""
_MATTERS = 2.0  # standard errors that a Coulomb friction is off by, from which an interval fails
_ENOUGH = 100_000  # samples that tell a width: more would double the time of a long fit


@dataclass(frozen=True)
class _Unsuited:
    """A joint whose friction width does not suit.

    Attributes
    ----------
    joint : its name.
    width : with its unit.
    change : of the logarithm of the width, in the first step towards a better one, in its sigma.
    """

    joint: str
    width: str
    change: float

    @property
    def words(self) -> str:
        """A clause."""
        side = "wider" if self.change > 0 else "narrower"
        return f"{side} than {self.width} at {self.joint} ({abs(self.change):.0f} sigma)"


def with_unsuited_width(estimate: Estimate, dataset: Dataset, method: LeastSquares) -> Estimate:
    """Return an estimate that says first where its friction widths do not suit.

    The derivative of a joint's torque by the logarithm of its width is a column more; its
    coefficient is the first step of Gauss and Newton towards the best width (Seber and Wild,
    *Nonlinear Regression*, 2003, section 2.1). That a width does not suit is said where the
    coefficient stands 4 standard errors from zero and Coulomb friction changes with it by 2 of its
    own.

    Parameters
    ----------
    estimate : whose headline is empty: what else is wrong could look like this.
    dataset : what was fitted; of a long one the first part is looked at.
    method : that it was fitted with.
    """
    model, robot = estimate.model, estimate.model.robot
    slopes = [width_slope(model, estimate.values, one) for one in dry_joints(model)]
    added = tuple(one for one in slopes if one is not None)
    keeps = dataset.filter is not None and dataset.filter.ends == "keep"
    if not added or keeps or method.errors == "independent":
        return estimate
    found, some = [], _beginning(dataset)
    with suppress(FitError):  # the first part may be too short for the model
        given = estimate if some is dataset else method.fit(model, some)
        wide = method.fit(replace(model, effects=(*model.effects, *added)), some)
        with np.errstate(divide="ignore", invalid="ignore"):
            change = wide.values / wide.sigma
            off = (wide.values[: model.size] - given.values) / given.sigma
        levels = coulomb_levels(model, off)
        for slope in added:
            at = wide.model.slices[slope.label].start
            j = robot.names.index(str(slope.joint))
            if abs(change[at]) > _CLEARLY and abs(levels[j]) > _MATTERS:
                width = f"{number(float(model.friction_widths[j]), 2)} {robot.units[j]}/s"
                found.append(_Unsuited(str(slope.joint), width, float(change[at])))
    if not found:
        return estimate
    headline = (
        "Dry friction does not reverse over the friction width that is stated, or what the model "
        f"lacks looks like that: the width seems {listed([one.words for one in found])}. "
        "Coulomb and viscous friction are then off by more than sigma says. `dynident explain` "
        "tells which it is, and the width to write."
    )
    return replace(estimate, headline=headline)


def _beginning(dataset: Dataset) -> Dataset:
    """The first recordings of a dataset, or part of one, that have samples enough."""
    some, left = [], _ENOUGH
    for recording in dataset.recordings:
        if recording.samples > left:
            if not some:
                some.append(recording.part(slice(0, left)))
            return replace(dataset, recordings=tuple(some))
        some.append(recording)
        left -= recording.samples
    return dataset
