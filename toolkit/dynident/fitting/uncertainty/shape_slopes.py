"""How a model's torque changes with what is inside its effects, as columns of a regression."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import or_
from typing import ClassVar

import numpy as np

from dynident.effects import Block, Effect, Needs, Parameter, ShapeParameter
from dynident.model import Model

_STEP = 1e-4
"""Of the coordinate of a shape, for differences where no derivatives are known."""


@dataclass(frozen=True)
class ShapeSlope(Effect):
    """The derivatives of an effect's torque by the coordinates of its shapes.

    Attributes
    ----------
    of : the effect.
    values : of its linear parameters.
    shapes : as the robot of the model has them.
    """

    of: Effect | None = None
    values: tuple[float, ...] = ()
    shapes: tuple[ShapeParameter, ...] = ()
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

    def time_factor(self, block: Block) -> np.ndarray:
        """The derivative of the effect's by its shape: it goes another way in the course of time.

        That of the effect itself where its shapes are several, or its factor has none of them.
        """
        factor = self.effect.time_factor(block)
        if len(self.shapes) != 1:
            return factor
        (shape,) = self.shapes
        middle = shape.coordinate(self.effect.shape[0])
        ends = [shape.at(middle + side * _STEP) for side in (1.0, -1.0)]
        high, low = (self.effect.shaped(end).time_factor(block) for end in ends)
        slope = (high - low) / (shape.coordinate(ends[0]) - shape.coordinate(ends[1]))
        return slope if np.any(slope) else factor

    def on(self, robot) -> ShapeSlope:
        return replace(self, shapes=self.effect.shape_parameters(robot))

    def parameters(self, robot) -> tuple[Parameter, ...]:
        return tuple(Parameter(s.name, "1") for s in self.effect.shape_parameters(robot))

    def columns(self, block: Block) -> np.ndarray:
        slopes = self.effect.sensitivities(block)
        if slopes is None:
            slopes = _differences(self.effect, self.shapes, block)
        return np.einsum("tnks,k->tns", slopes, np.array(self.values))


@dataclass(frozen=True)
class WidthSlope(Effect):
    """The derivative of a joint's dry friction by the logarithm of its friction width.

    Attributes
    ----------
    of : effects that reverse with the joint.
    values : of the parameters of each.
    """

    of: tuple[Effect, ...] = ()
    values: tuple[tuple[float, ...], ...] = ()
    name: ClassVar[str] = "friction width"
    ends: ClassVar[tuple[float, float]] = (_STEP, -_STEP)
    """Logarithms of two widths, over the model's, between which the torque changes."""
    in_catalogue: ClassVar[bool] = False

    @property
    def needs(self) -> Needs:  # type: ignore[override]
        """All that its effects need."""
        return reduce(or_, (effect.needs for effect in self.of), Needs.NOTHING)

    @property
    def time_varying(self) -> bool:  # type: ignore[override]
        """Whether any of them is."""
        return any(effect.time_varying for effect in self.of)

    def on(self, robot) -> WidthSlope:
        return self

    def parameters(self, robot) -> tuple[Parameter, ...]:
        return (Parameter("width", "1"),)

    def columns(self, block: Block) -> np.ndarray:
        wider, narrower = (self._torque(block, np.exp(end)) for end in self.ends)
        return ((wider - narrower) / (self.ends[0] - self.ends[1]))[:, :, None]

    def _torque(self, block: Block, factor: float) -> np.ndarray:
        """Torque (T, n) of the effects with another width of the joint."""
        widths = np.array(np.broadcast_to(block.friction_width, len(block.names)), dtype=float)
        widths[block.index(self.joint)] *= factor
        other = replace(block, friction_width=widths)
        pairs = zip(self.of, self.values, strict=True)
        return np.sum([one.columns(other) @ np.array(x) for one, x in pairs], axis=0)


@dataclass(frozen=True)
class WidthSecant(WidthSlope):
    """The same up to ten times the width: one that is far too narrow has no derivative to speak of.

    Friction has turned at nearly every row, and a little wider it has, too.
    """

    name: ClassVar[str] = "wider friction"
    ends: ClassVar[tuple[float, float]] = (np.log(10.0), 0.0)


def width_slope(model: Model, values: np.ndarray, joint: str) -> WidthSlope | None:
    """Return how the torque changes with a joint's friction width; None where it does not.

    Parameters
    ----------
    model, values : (p,) of its parameters.
    joint : its name.

    Returns
    -------
    For the values of effects that follow from a sample alone.
    """
    own = [
        one
        for one in model.effects
        if one.reverses and one.is_instantaneous and joint in (one.joint, one.source)
    ]
    if not own:
        return None
    each = tuple(tuple(values[model.slices[one.label]].tolist()) for one in own)
    return WidthSlope(joint, of=tuple(own), values=each)


def _differences(effect: Effect, shapes: Sequence[ShapeParameter], block: Block) -> np.ndarray:
    """Derivatives of columns by the coordinates of shapes, (T, n, k, s); within their bounds."""
    found = []
    for k, one in enumerate(shapes):
        at, sides = one.coordinate(effect.shape[k]), []
        ends = [one.at(at + step) for step in (_STEP, -_STEP)]
        for end in ends:
            shape = (*effect.shape[:k], end, *effect.shape[k + 1 :])
            sides.append(effect.shaped(*shape).columns(block))
        high, low = map(one.coordinate, ends)
        found.append((sides[0] - sides[1]) / (high - low))
    return np.stack(found, axis=-1)
