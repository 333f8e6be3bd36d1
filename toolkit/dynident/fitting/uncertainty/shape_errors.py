"""How well the data tell the parameters inside effects, and what they cost the others.

At the shapes that fit best, the torque is linear in small changes of them: their derivatives are
columns more. The covariance of the fit with these columns is that of all parameters together
(Gauss-Newton; Seber and Wild, *Nonlinear Regression*, 2003, section 2.1); without them the linear
parameters would be as certain as if the shapes were known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from dynident.effects import Block, Effect, Needs, Parameter
from dynident.fitting.estimate import Estimate, ShapeValue
from dynident.fitting.row_objective import shaped_effects
from dynident.model import Model

_KNOWN = "sigma takes {} as known, which they are not."


@dataclass(frozen=True)
class ShapeSlope(Effect):
    """The derivatives of an effect's torque by the coordinates of its shapes.

    Attributes
    ----------
    of : the effect.
    values : of its linear parameters.
    """

    of: Effect | None = None
    values: tuple[float, ...] = ()
    in_catalogue: ClassVar[bool] = False

    @property
    def effect(self) -> Effect:
        """The effect itself."""
        assert self.of is not None
        return self.of

    @property
    def name(self) -> str:  # type: ignore[override]
        """Of no effect in the catalogue."""
        return f"shape of {self.effect.name}"

    @property
    def needs(self) -> Needs:  # type: ignore[override]
        """As the effect."""
        return self.effect.needs

    @property
    def time_varying(self) -> bool:  # type: ignore[override]
        """As the effect."""
        return self.effect.time_varying

    def on(self, robot) -> ShapeSlope:
        return self

    def parameters(self, robot) -> tuple[Parameter, ...]:
        return tuple(Parameter(s.name, "1") for s in self.effect.shape_parameters(robot))

    def columns(self, block: Block) -> np.ndarray:
        slopes = self.effect.sensitivities(block)
        assert slopes is not None
        return np.einsum("tnks,k->tns", slopes, np.array(self.values))


def with_shape_errors(estimate: Estimate, fit: Callable[[Model], Estimate] | None) -> Estimate:
    """Return an estimate whose sigma holds that shapes are estimated, and that lists them.

    Parameters
    ----------
    estimate : of a model at its best shapes.
    fit : the same method, of another model; None where its sigma cannot hold them.
    """
    model, robot = estimate.model, estimate.model.robot
    shaped = shaped_effects(model)
    slopes = tuple(
        ShapeSlope(e.joint, e.source, of=e, values=tuple(estimate.effect_values(e.label).tolist()))
        for e in shaped
        if fit and type(e).sensitivities is not Effect.sensitivities and not e.nonlinear
        if np.any(estimate.effect_values(e.label))
    )
    known = [e.label for e in shaped if e.label not in {s.effect.label for s in slopes}]
    sigma: dict[str, np.ndarray] = {}
    if fit and slopes and np.any(estimate.covariance):
        whole = fit(replace(model, effects=(*model.effects, *slopes)))
        size = model.size
        # Rows of what is not identified beside the slopes would be zero: then it is as before.
        if whole.identified[:size].sum() == estimate.identified.sum():
            estimate = replace(estimate, covariance=whole.covariance[:size, :size])
        spread = whole.sigma
        sigma = {s.effect.label: spread[whole.model.slices[s.label]] for s in slopes}
    found = []
    for effect in shaped:
        parameters = effect.shape_parameters(robot)
        each = sigma.get(effect.label, np.full(len(parameters), np.nan))
        for parameter, value, one in zip(parameters, effect.shape, each, strict=True):
            found.append(
                ShapeValue(
                    name=effect.parameter_name(parameter.name),
                    value=value,
                    sigma=float(one * parameter.slope(value)),
                    unit=parameter.unit,
                )
            )
    notes = estimate.notes
    if known and np.any(estimate.covariance):
        notes = (*notes, _KNOWN.format(f"the shapes of {', '.join(known)}"))
    return replace(estimate, shapes=tuple(found), notes=notes)
