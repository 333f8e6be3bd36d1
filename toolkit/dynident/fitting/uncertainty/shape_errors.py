"""How well the data tell the parameters inside effects, and what they cost the others.

At the shapes that fit best, the torque is linear in small changes of them: their derivatives are
columns more. The covariance of the fit with these columns is that of all parameters together
(Gauss-Newton; Seber and Wild, *Nonlinear Regression*, 2003, section 2.1); without them the linear
parameters would be as certain as if the shapes were known.

That holds as far as the torque is straight in a shape over the interval that comes out. Where this
takes an effect that is surely there down to nothing, or a change of the shape is just what other
sizes make, then the size is not determined: it and the shape trade off. No number is said of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dynident.fitting.estimate import Estimate, ShapeValue
from dynident.fitting.row_objective import shaped_effects
from dynident.fitting.uncertainty.shape_slopes import ShapeSlope, width_slope
from dynident.model import Model
from dynident.tables import listed

_KNOWN = (
    " The parameters inside {} count as known in it, which they are not: what {} has beside them "
    "may be off by several sigma."
)
_QUANTILE = 1.959964
"""Standard errors to each side of a 95 % interval."""
_AT_BOUND = "{} = {:.4g} {} is at the end of where it is sought: the best may lie beyond."
_TO_BOUND = 0.01
"""Coordinate (relative, for a positive shape) from its bound within which a shape is at it."""
_MADE_OF = 0.1
"""Share (in norm) of a shape's derivative from which the column of a parameter makes it."""


def with_shape_errors(
    estimate: Estimate, fit: Callable[[Model], Estimate] | None, widths: Sequence[str] = ()
) -> Estimate:
    """Return an estimate whose sigma holds that shapes are estimated, and that lists them.

    Parameters
    ----------
    estimate : of a model at its best shapes.
    fit : the same method, of another model; None where its sigma cannot hold them.
    widths : joints whose friction width was estimated from the same data, too.

    Returns
    -------
    With `trading_off`: parameters that these data do not tell from a shape.
    """
    model, robot = estimate.model, estimate.model.robot
    shaped = shaped_effects(model)
    slopes = tuple(
        ShapeSlope(e.joint, e.source, of=e, values=tuple(estimate.effect_values(e.label).tolist()))
        for e in shaped
        if fit and not e.nonlinear and np.any(estimate.effect_values(e.label))
    )
    known = [e.title for e in shaped if e.label not in {s.effect.label for s in slopes}]
    sought = [width_slope(model, estimate.values, joint) for joint in widths]
    added = (*slopes, *(one for one in sought if one is not None))
    sigma: dict[str, np.ndarray] = {}
    if fit and added and np.any(estimate.covariance):
        whole = fit(replace(model, effects=(*model.effects, *added)))
        estimate = _widened(estimate, whole, [model.slices[s.effect.label] for s in slopes])
        spread = whole.sigma
        sigma = {s.effect.label: spread[whole.model.slices[s.label]] for s in slopes}
    found = []
    for effect in shaped:
        parameters = effect.shape_parameters(robot)
        each = sigma.get(effect.label, np.full(len(parameters), np.nan))
        names = model.shape_names[effect.label]
        for name, parameter, value, one in zip(names, parameters, effect.shape, each, strict=True):
            found.append(
                ShapeValue(
                    name=name,
                    value=value,
                    sigma=float(one * parameter.slope(value)),
                    unit=parameter.unit,
                )
            )
    notes = (*estimate.notes, *shapes_at_ends(model).values())
    if known and np.any(estimate.covariance):
        named, it = listed(known), "it" if len(known) == 1 else "each"
        words = estimate.words_of_sigma + _KNOWN.format(named, it)
        estimate = replace(estimate, sigma_words=words)
    return replace(estimate, shapes=tuple(found), notes=notes)


def shapes_at_ends(model: Model) -> dict[str, str]:
    """Say of the shapes at the end of where they are sought that they are, by their names."""
    found = {}
    for effect in shaped_effects(model):
        shapes = effect.shape_parameters(model.robot)
        for name, one, x in zip(model.shape_names[effect.label], shapes, effect.shape, strict=True):
            ends = np.array([one.coordinate(end) for end in (one.lower, one.upper)])
            if np.abs(ends - one.coordinate(x)).min() < _TO_BOUND:
                found[name] = _AT_BOUND.format(name, x, one.unit)
    return found


def _widened(estimate: Estimate, whole: Estimate, shaped: Sequence[slice]) -> Estimate:
    """Return an estimate with the covariance that its parameters have beside those of shapes.

    Parameters
    ----------
    estimate : with the shapes as known.
    whole : with their derivatives as columns more.
    shaped : parameters of effects with a shape.
    """
    size, names, sigma = estimate.model.size, estimate.names, estimate.sigma
    lost = estimate.identified & ~whole.identified[:size]
    trading = [*np.flatnonzero(lost), *_makes_a_slope(whole, size)]
    covariance = np.where(np.outer(lost, lost), 0.0, whole.covariance[:size, :size])
    wide = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    reach = np.abs(estimate.identified_values) / _QUANTILE
    for own in shaped:
        trading += [i for i in range(own.start, own.stop) if sigma[i] < reach[i] <= wide[i]]
    return replace(
        estimate,
        covariance=covariance,
        trading_off=tuple(names[i] for i in sorted(set(trading)) if estimate.identified[i]),
    )


def _makes_a_slope(whole: Estimate, size: int) -> list[int]:
    """Which of the first parameters make what a change of a shape does, where it is no other."""
    basis, found = whole.basis, []
    heads = np.array(basis.independent)
    for k, index in enumerate(basis.dependent):
        if index >= size:
            share = np.abs(basis.K[:, k]) * basis.scale[heads]
            found += heads[share > _MADE_OF * basis.scale[index]].tolist()
    return [i for i in found if i < size]
