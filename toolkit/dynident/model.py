"""A model: a robot and the physical effects that it is said to have."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynident.effects import FRICTION_WIDTH, Block, Effect, effects_of
from dynident.errors import EffectError
from dynident.robot import BaseParameters, Robot, structural_base


@dataclass(frozen=True)
class Model:
    """A robot and its effects, as a torque that is linear in its parameters.

    The parameters are the robot's base parameters (structurally identifiable combinations of the
    standard inertial parameters), then those of each effect in turn.

    Attributes
    ----------
    robot : the tree of joints and links.
    effects : at most one of a label.
    friction_width : rad/s or m/s, see `dynident.effects.FRICTION_WIDTH`.
    """

    robot: Robot
    effects: tuple[Effect, ...] = ()
    friction_width: float = FRICTION_WIDTH

    def __post_init__(self) -> None:
        checked = tuple(effect.on(self.robot) for effect in self.effects)
        labels = [effect.label for effect in checked]
        for label in labels:
            if labels.count(label) > 1:
                raise EffectError("is in the model twice", label, "name it once")
        if not self.friction_width > 0:
            raise EffectError(f"friction_width = {self.friction_width:g}", mend="choose it above 0")
        object.__setattr__(self, "effects", checked)

    # --- with other effects --------------------------------------------------------------------

    def __add__(self, addition: Effect | str | tuple[Effect, ...]) -> Model:
        """Return the model with an effect more (`name`, `name@joint`, an effect or several)."""
        if isinstance(addition, str):
            addition = effects_of(addition, self.robot)
        more = addition if isinstance(addition, tuple) else (addition,)
        return replace(self, effects=(*self.effects, *more))

    def __sub__(self, effect: Effect | str) -> Model:
        """Return the model without an effect, given as itself or by its label."""
        label = effect if isinstance(effect, str) else effect.label
        kept = tuple(one for one in self.effects if one.label != label)
        if len(kept) == len(self.effects):
            raise EffectError("is not in the model", label)
        return replace(self, effects=kept)

    def __contains__(self, effect: Effect | str) -> bool:
        label = effect if isinstance(effect, str) else effect.label
        return any(one.label == label for one in self.effects)

    def with_shapes(self, effects: tuple[Effect, ...]) -> Model:
        """Return the model with these effects in place of those of the same labels."""
        by_label = {effect.label: effect for effect in effects}
        return replace(self, effects=tuple(by_label.get(e.label, e) for e in self.effects))

    # --- parameters ----------------------------------------------------------------------------

    @cached_property
    def base(self) -> BaseParameters:
        """Structurally identifiable combinations of the rigid body's standard parameters."""
        return structural_base(self.robot)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, those of effects as `Fv@joint`."""
        return (*(self.base.names[i] for i in self.base.independent), *self._of_effects("name"))

    @cached_property
    def expressions(self) -> tuple[str, ...]:
        """Each parameter as a combination of standard parameters."""
        return (*self.base.expressions, *self._of_effects("name"))

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Unit of each parameter."""
        rigid = (self.robot.parameter_units[i] for i in self.base.independent)
        return (*rigid, *self._of_effects("unit"))

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Columns of each effect, by its label."""
        found, start = {}, len(self.base.independent)
        for effect in self.effects:
            stop = start + len(effect.parameters(self.robot))
            found[effect.label] = slice(start, stop)
            start = stop
        return found

    @property
    def size(self) -> int:
        """Number of columns."""
        return len(self.names)

    @cached_property
    def needs_torque(self) -> bool:
        """Whether some column depends on the torque that the model predicts."""
        return any("torque" in effect.needs for effect in self.effects)

    # --- torque --------------------------------------------------------------------------------

    def block(self, t, q, v, a, *, carries_payload: bool = False, rigid: bool = True) -> Block:
        """Samples as effects see them; see `Block` for shapes.

        `rigid` says whether the rigid-body regressor, the costly part, is evaluated.
        """
        return Block(
            t,
            q,
            v,
            a,
            self.robot.names,
            self.friction_width,
            carries_payload,
            self.robot.tip,
            rigid=self.robot.regressor(q, v, a) if rigid else None,
        )

    def columns(self, block: Block, values: np.ndarray | None = None) -> np.ndarray:
        """Torque per unit of each parameter.

        Parameters
        ----------
        block : Block
            With its rigid-body regressor, as `Model.block` makes it.
        values : (p,), optional
            Parameter values at which columns that depend on the predicted torque are taken;
            without them those columns are zero.

        Returns
        -------
        (T, n, p) in N m or N per unit of the parameters.
        """
        assert block.rigid is not None
        full = np.zeros((len(block.t), self.robot.n, self.size))
        rigid = len(self.base.independent)
        full[:, :, :rigid] = np.take(block.rigid, self.base.independent, axis=2)
        for effect in self.effects:
            if "torque" not in effect.needs:
                full[:, :, self.slices[effect.label]] = effect.columns(block)
        if self.needs_torque and values is not None:
            # Their own columns are still zero here: the torque is that of all the rest.
            loaded = replace(block, torque=full @ values)
            for effect in self.effects:
                if "torque" in effect.needs:
                    full[:, :, self.slices[effect.label]] = effect.columns(loaded)
        return full

    def torque(self, block: Block, values: np.ndarray) -> np.ndarray:
        """Predicted torque, (T, n) in N m or N."""
        return self.columns(block, values) @ values

    def settled(self, at: np.ndarray, found: np.ndarray) -> np.ndarray:
        """Values at which to take columns that depend on the predicted torque next.

        Where a share e is added to the torque, the plain repetition (at `found`) shrinks its error
        by -e only, and grows it from e = 1 on. This step shrinks it by e / (2 + e) at worst.

        Parameters
        ----------
        at : (p,) values at which these columns were taken.
        found : (p,) values fitted with them.
        """
        loads = (found[self.slices[e.label]] for e in self.effects if "torque" in e.needs)
        shares = np.concatenate([np.zeros(1), *loads])
        return at + 2.0 / max(2.0 + shares.min() + shares.max(), 0.1) * (found - at)

    def torque_without_loads(self, block: Block, values: np.ndarray | None) -> np.ndarray:
        """Predicted torque, but for effects that scale with it, (T, n) in N m or N.

        By recursive inverse dynamics: `block` needs no regressor unless an effect does.
        """
        if values is None:
            values = np.zeros(self.size)
        theta = np.zeros(10 * self.robot.n)
        theta[list(self.base.independent)] = values[: len(self.base.independent)]
        torque = self.robot.inverse_dynamics(block.q, block.v, block.a, theta)
        for effect in self.effects:
            if "torque" not in effect.needs:
                torque = torque + effect.columns(block) @ values[self.slices[effect.label]]
        return torque

    def given_values(self) -> np.ndarray:
        """Parameter values of the robot description, effects at zero, (p,)."""
        values = np.zeros(self.size)
        values[: len(self.base.independent)] = self.base.coordinates(self.robot.theta)
        return values

    def _of_effects(self, attribute: str) -> tuple[str, ...]:
        found = []
        for effect in self.effects:
            for parameter in effect.parameters(self.robot):
                place = effect.label.partition("@")[2]
                tail = f"@{place}" if place and attribute == "name" else ""
                head = str(getattr(parameter, attribute))
                if attribute == "name" and not place:
                    head = f"{effect.name}.{head}"
                found.append(head + tail)
        return tuple(found)
