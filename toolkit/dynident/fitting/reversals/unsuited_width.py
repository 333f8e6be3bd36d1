"""Whether dry friction reverses over another speed than the model's friction width.

Nothing looks wrong then in a residual: its rows around reversals are few. But friction that is made
to reverse too slowly is made up for at speed, and Coulomb and viscous friction are off by many of
their standard deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from dynident.errors import FitError, RecordingError
from dynident.fitting.estimate import Estimate
from dynident.fitting.least_squares import LeastSquares, with_bias
from dynident.fitting.uncertainty.shape_slopes import WidthSecant, WidthSlope, width_slope
from dynident.model import coulomb_levels, dry_joints
from dynident.recording import Dataset
from dynident.tables import listed, number

_CLEARLY = 4.0
"""Standard errors of the change of a width from which it is no chance: of healthy arms' joints 3 is
the most that was seen."""
_SMALLER = 3.0
"""Times that errors which hang together from row to row may make sigma smaller; they make it larger
but where quickly alternating errors cancel."""
_FAR = 0.2  # part of a secant from which a width is far off: the tangent sees what is nearer
_MATTERS = 2.0  # standard errors that a Coulomb friction is off by, from which an interval fails
_ENOUGH = 100_000  # samples that tell a width: more would double the time of a long fit


@dataclass(frozen=True)
class _Unsuited:
    """A joint whose friction width does not suit.

    Attributes
    ----------
    joint : its name.
    width : with its unit.
    change : towards a wider or a narrower one, in its sigma.
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
    *Nonlinear Regression*, 2003, section 2.1). Another is the secant to ten times the width. That a
    width does not suit is said where either coefficient stands 4 standard errors from zero and
    Coulomb friction changes with it by 2 of its own.

    Parameters
    ----------
    estimate : whose headline is empty: what else is wrong could look like this.
    dataset : what was fitted; of a long one the first part is looked at.
    method : that it was fitted with.
    """
    model = estimate.model
    slopes = [width_slope(model, estimate.values, one) for one in dry_joints(model)]
    slopes = [one for one in slopes if one is not None]
    secants = [WidthSecant(one.joint, of=one.of, values=one.values) for one in slopes]
    keeps = dataset.filter is not None and dataset.filter.ends == "keep"
    if not slopes or keeps or method.errors == "independent":
        return estimate
    found, some = [], _beginning(dataset)
    with suppress(FitError, RecordingError):  # of the first part alone, which may be too short
        given = estimate if some is dataset else method.fit(model, some)
        # One after the other: together each would take a part of what the other shows.
        for columns in (slopes, secants):
            found = found or _unsuited_by(columns, given, some, method)
    if not found:
        return estimate
    headline = (
        "Dry friction does not reverse over the model's friction width, or what the model lacks "
        f"looks like that: the width seems {listed([one.words for one in found])}. Coulomb "
        "friction is then off by more than sigma says. `dynident explain` looks into which it is, "
        "and which width to write."
    )
    return replace(estimate, headline=headline)


def _unsuited_by(
    columns: Sequence[WidthSlope], given: Estimate, dataset: Dataset, method: LeastSquares
) -> list[_Unsuited]:
    """Joints whose width does not suit by a derivative, or a secant, as a column more of each.

    Rows that hang together cost most of a fit. It is spared where sigma of rows that do not, from
    the same values, is so large that theirs could not be small enough; and so is the bias, which
    makes sigma larger, where it is too large without.
    """
    wider = replace(given.model, effects=(*given.model.effects, *columns))
    textbook = replace(method, errors="independent").fit(wider, dataset)
    if not _unsuited(given, textbook, columns, _CLEARLY / _SMALLER):
        return []
    wide, solution = method.without_bias(wider, dataset)
    if not _unsuited(given, wide, columns, _CLEARLY):
        return []
    return _unsuited(given, with_bias(wide, dataset, solution), columns, _CLEARLY)


def _unsuited(
    given: Estimate, wide: Estimate, columns: Sequence[WidthSlope], clearly: float
) -> list[_Unsuited]:
    """Joints whose width does not suit by so many sigma, by a fit with columns more."""
    model, robot, found = given.model, given.model.robot, []
    with np.errstate(divide="ignore", invalid="ignore"):
        change = wide.values / wide.sigma
        off = (wide.values[: model.size] - given.values) / given.sigma
    levels = coulomb_levels(model, off)
    for one in columns:
        joint, at = str(one.joint), wide.model.slices[one.label].start
        j, z = robot.names.index(joint), float(change[at])
        is_little = isinstance(one, WidthSecant) and abs(wide.values[at]) < _FAR
        if abs(z) > clearly and abs(levels[j]) > _MATTERS and not is_little:
            width = f"{number(float(model.friction_widths[j]), 2)} {robot.units[j]}/s"
            found.append(_Unsuited(joint, width, z))
    return found


def _beginning(dataset: Dataset) -> Dataset:
    """The first recordings of a dataset, the last of them in part, that have samples enough."""
    if sum(one.samples for one in dataset.recordings) <= _ENOUGH:
        return dataset
    some, left = [], _ENOUGH
    for recording in dataset.recordings:
        within = recording if recording.window is None else recording.cut(*recording.window)
        some.append(within.part(slice(0, left)) if within.samples > left else within)
        left -= some[-1].samples
        if left < 2:
            break
    return replace(dataset, recordings=tuple(some))
