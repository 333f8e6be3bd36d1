"""Two estimates of which one has effects that the other has not: what is common, and what is not.

Beside another effect the value of a parameter may be another one, though the robot is the same:
where the effect acts, a model without it puts a part of its torque into the parameters that it has.
A difference is then the robot's, or the model's. Two hypotheses of a robot that is the same say
what to expect: the effect is new to it, then both estimates are right as they are; or it was there
all along, then two fits without it are wrong alike, if the motions are. What contradicts both is
neither: an intersection-union test (Berger, Technometrics 24, 1982), which keeps the level of its
parts without a correction.

The fit without an effect follows from the one with it: b1 - C12 C22^-1 b2, with the covariance
C11 - C12 C22^-1 C21. That is exact where both fits would have the same weights, and a covariance
that is the inverse of the same information. Where weights come from the residual, or the covariance
counts errors that rows share, it is approximate: a fit anew has other weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.fitting.estimate import Estimate
from dynident.model import Model

_NOTHING = 1e-10  # share of the largest eigenvalue of a correlation that is rounding


@dataclass(frozen=True, kw_only=True)
class LoneParameter:
    """A parameter of an effect that only one of two estimates has.

    Attributes
    ----------
    effect : its label.
    parameter, unit : its name.
    stands_for : the combination that is identified; empty where it is the parameter alone.
    value, sigma : NaN where it is not identified on its own; sigma also where it has none.
    """

    effect: str
    parameter: str
    unit: str
    stands_for: str
    value: float
    sigma: float


def shared_effects(before: Model, after: Model) -> tuple[str, ...]:
    """Return the labels of the effects that both models have, in the order of the first."""
    known = {one.label for one in after.effects}
    return tuple(one.label for one in before.effects if one.label in known)


def places_of(model: Model, labels: tuple[str, ...]) -> np.ndarray:
    """Return where a model has its base parameters and those of some effects, in this order."""
    slices = [model.slices[label] for label in labels]
    base = range(len(model.base.independent))
    return np.array([*base, *(i for one in slices for i in range(one.start, one.stop))])


def lone_parameters(estimate: Estimate, labels: tuple[str, ...]) -> tuple[LoneParameter, ...]:
    """Return the parameters of an estimate's effects that are none of some labels.

    Parameters
    ----------
    estimate : one of two.
    labels : of the effects that both have.

    Returns
    -------
    The linear parameters of each effect, then its shapes.
    """
    model, basis, found = estimate.model, estimate.basis, []
    rows = {head: row for row, head in enumerate(basis.independent)}
    heads, words = basis.coordinates(estimate.values), model.stands_for(basis)
    for effect in model.effects:
        if effect.label in labels:
            continue
        own = model.slices[effect.label]
        for i in range(own.start, own.stop):
            row = rows.get(i)
            found.append(
                LoneParameter(
                    effect=effect.label,
                    parameter=estimate.names[i],
                    unit=model.units[i],
                    stands_for="" if row is None else words[row],
                    value=float("nan") if row is None else float(heads[row]),
                    sigma=float(estimate.sigma[i]),
                )
            )
        shapes = model.shape_names[effect.label]
        found += [
            LoneParameter(
                effect=effect.label,
                parameter=one.name,
                unit=one.unit,
                stands_for="",
                value=one.value,
                sigma=one.sigma,
            )
            for one in estimate.shapes
            if one.name in shapes
        ]
    return tuple(found)


def without(estimate: Estimate, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return values (p,) and covariance (p, p) as a fit without some parameters would give them.

    Parameters
    ----------
    estimate : with them.
    kept : places of the parameters that stay; what the data do not tell from these is not taken
        out, for a fit without it is the same.
    """
    basis, values, C = estimate.basis, np.array(estimate.values), estimate.covariance
    B = basis.combination
    told = [
        row
        for row, head in enumerate(basis.independent)
        if not np.any(B[row, kept]) and C[head, head] > 0
    ]
    if not told:
        return values, C
    out = np.array(basis.independent)[told]
    size = np.sqrt(C[out, out])
    inverse = np.linalg.pinv(C[np.ix_(out, out)] / np.outer(size, size), _NOTHING, hermitian=True)
    gain = C[:, out] @ (inverse / np.outer(size, size))
    return values - gain @ (B[told] @ values), C - gain @ C[out]
