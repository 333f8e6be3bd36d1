"""An effect that a simulated robot really has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dynident.effects import Effect, effects_of
from dynident.errors import EffectError
from dynident.robot import Robot
from dynident.settings import nearest


@dataclass(frozen=True)
class TrueEffect:
    """An effect that a simulated robot really has.

    Attributes
    ----------
    effect : with its place and shape.
    values : of its parameters, in their order.
    hidden : whether the user of the recordings is to find it: it is left out of the study.
    """

    effect: Effect
    values: tuple[float, ...]
    hidden: bool = False

    @classmethod
    def of(
        cls,
        label: str,
        robot: Robot,
        values: Mapping[str, float] | Sequence[float],
        shape: Mapping[str, float] | Sequence[float] = (),
        *,
        hidden: bool = False,
    ) -> tuple[TrueEffect, ...]:
        """Return the effects of a label: `name@joint` one, `name` one per place.

        Parameters
        ----------
        label : as in a study file.
        robot : on which they sit.
        values, shape : by name (parameters left out are 0, shape parameters at their default) or
            all in order.
        hidden : see the class.

        Raises
        ------
        EffectError
            If the label, a name or a number of values does not fit, or a value is out of bounds.
        """
        return tuple(
            cls(effect, ordered(effect, robot, values), hidden)
            for effect in (_shaped(one, robot, shape) for one in effects_of(label, robot))
        )


def ordered(effect: Effect, robot: Robot, values) -> tuple[float, ...]:
    """Return values, given by name or in order, in the order of an effect's parameters.

    Raises
    ------
    EffectError
        If a name or the number does not fit, or a value is out of bounds.
    """
    parameters = effect.parameters(robot)
    if isinstance(values, Mapping):
        names = tuple(parameter.name for parameter in parameters)
        for name in values:
            if name not in names:
                remedy = nearest(name, names, "parameters")
                raise EffectError(f"no parameter '{name}'", effect.label, remedy)
        values = [values.get(name, 0.0) for name in names]
    if len(values) != len(parameters):
        names = ", ".join(parameter.name for parameter in parameters)
        raise EffectError(f"{len(values)} values", effect.label, f"give {names}")
    for value, parameter in zip(values, parameters, strict=True):
        if not (np.isfinite(value) and parameter.lower <= value <= parameter.upper):
            limits = f"between {parameter.lower:g} and {parameter.upper:g} {parameter.unit}"
            remedy = f"choose it {limits}"
            raise EffectError(f"{parameter.name} = {value:g}", effect.label, remedy)
    return tuple(float(value) for value in values)


def _shaped(effect: Effect, robot: Robot, shape) -> Effect:
    if isinstance(shape, Mapping):
        names = tuple(one.name for one in effect.shape_parameters(robot))
        for name in shape:
            if name not in names:
                remedy = nearest(name, names, "shape parameters")
                raise EffectError(f"no shape parameter '{name}'", effect.label, remedy)
        shape = [shape.get(name, own) for name, own in zip(names, effect.shape, strict=True)]
    return effect.shaped(*shape).on(robot) if len(shape) else effect
