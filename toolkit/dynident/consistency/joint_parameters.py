"""Friction, damping and rotor inertia: nothing of it may be negative."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dynident.consistency.checked_bodies import Scale
from dynident.robot.formats.format import JointDynamics

if TYPE_CHECKING:
    from dynident.effects import Parameter
    from dynident.fitting import Estimate


@dataclass(frozen=True, kw_only=True)
class JointCheck:
    """The margin of one quantity at a joint (or of an effect of the whole robot).

    Attributes
    ----------
    name : str
        The joint, or the parameter of an effect ("Fv@elbow").
    quantity : str
        "damping", "friction", "rotor inertia", or the effect.
    value : float
        SI; the margin is its distance to the bound (zero).
    unit : str
    relative : float
        The margin relative to what is large for the robot.
    sigma : float or None
        Standard deviations between value and bound, where it was estimated with one.
    broken : bool
    words : str
    """

    name: str
    quantity: str
    value: float
    unit: str
    relative: float
    sigma: float | None
    broken: bool
    words: str = ""


def of_description(dynamics: tuple[JointDynamics, ...], scale: Scale) -> tuple[JointCheck, ...]:
    """Judge what a description states of its joints."""
    found = []
    for one in dynamics:
        broken = not 0.0 <= one.value < float("inf")
        words = ""
        if broken:
            words = f"{one.quantity} is not a usable number: {one.value:g}"
            if np.isfinite(one.value):
                words = (
                    f"{one.quantity} is negative: {one.value:.4g} {one.unit} (nearest possible: 0)"
                )
        relative = one.value / scale.of(one.unit)
        found.append(
            JointCheck(
                name=one.joint,
                quantity=one.quantity,
                value=one.value,
                unit=one.unit,
                relative=relative,
                sigma=None,
                broken=broken,
                words=words,
            )
        )
    return tuple(found)


def of_estimate(estimate: Estimate, scale: Scale) -> tuple[JointCheck, ...]:
    """Judge the parameters of an estimate's effects against their physical bounds."""
    model, sigmas = estimate.model, estimate.sigma
    found = []
    for effect in model.effects:
        start = model.slices[effect.label].start
        for index, parameter in enumerate(effect.parameters(model.robot), start=start):
            if parameter.lower == -np.inf and parameter.upper == np.inf:
                continue
            value, sigma = float(estimate.values[index]), float(sigmas[index])
            margin = min(value - parameter.lower, parameter.upper - value)
            large = scale.of(parameter.unit)
            # Rounding of a constrained fit is forgiven.
            broken = not margin >= -1e-9 * large
            apart = margin / sigma if sigma > 0.0 else None
            name = model.names[index]
            words = _words(effect.name, value, parameter, apart) if broken else ""
            found.append(
                JointCheck(
                    name=name,
                    quantity=effect.name,
                    value=value,
                    unit=parameter.unit,
                    relative=margin / large,
                    sigma=apart,
                    broken=broken,
                    words=words,
                )
            )
    return tuple(found)


def _words(name: str, value: float, parameter: Parameter, apart: float | None) -> str:
    if not np.isfinite(value):
        return f"{name} is not a usable number: {value:g}"
    unit, nearest = parameter.unit, float(np.clip(value, parameter.lower, parameter.upper))
    what = "is negative" if parameter.lower == 0.0 and value < 0.0 else "is outside of its bounds"
    text = f"{name} {what}: {value:.4g} {unit} (nearest possible: {nearest:g})"
    if apart is None:
        return text
    verdict = "zero is within its uncertainty" if abs(apart) < 2.0 else "more than its uncertainty"
    return f"{text}, {abs(apart):.2g} standard deviations: {verdict}"
