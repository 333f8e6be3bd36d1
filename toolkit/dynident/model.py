"""A model: a robot and the physical effects that it is said to have."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynident.effects import FRICTION_WIDTH, Block, Effect, Needs, effects_of
from dynident.errors import EffectError
from dynident.robot import BaseParameters, Robot, nearest_parameters, structural_base


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
            raise EffectError(
                f"friction_width = {self.friction_width:g}", remedy="choose it above 0"
            )
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
        made = replace(self, effects=tuple(by_label.get(e.label, e) for e in self.effects))
        made.__dict__["base"] = self.base  # the costly part, and the same
        return made

    def at(self, values: np.ndarray) -> Model:
        """Return the model linearised at other values, (p,), where it is not linear in them."""
        moved = tuple(
            effect.at(_plain(values[self.slices[effect.label]]))
            for effect in self.effects
            if effect.nonlinear
        )
        return self.with_shapes(moved) if moved else self

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
    def needs_values(self) -> bool:
        """Whether some columns depend on the parameters: they are taken at values, and again."""
        return any(e.nonlinear or e.depends_on_fit for e in self.effects)

    # --- torque --------------------------------------------------------------------------------

    def block(
        self,
        t,
        q,
        v,
        a,
        *,
        carries_payload: bool = False,
        rigid: bool = True,
        number: int = 0,
        temperature: np.ndarray | None = None,
    ) -> Block:
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
            number=number,
            temperature=temperature,
        )

    def columns(
        self,
        block: Block,
        values: np.ndarray | None = None,
        known: Mapping[str, np.ndarray] | None = None,
    ) -> np.ndarray:
        """Torque per unit of each parameter.

        Parameters
        ----------
        block : Block
            With its rigid-body regressor, as `Model.block` makes it.
        values : (p,), optional
            Parameter values at which columns that depend on the fitted model are taken; without
            them those that depend on its torque are zero, and its bodies are as described.
        known : label -> (T, n, k), optional
            Columns of effects that need the whole recording, see `whole_columns`; without them
            the block is taken for it.

        Returns
        -------
        (T, n, p) in N m or N per unit of the parameters.
        """
        assert block.rigid is not None
        full = np.zeros((len(block.t), self.robot.n, self.size))
        rigid = len(self.base.independent)
        full[:, :, :rigid] = np.take(block.rigid, self.base.independent, axis=2)

        def torque(found: Mapping[str, np.ndarray]) -> np.ndarray:
            # With the regressor at hand, a product is quicker than recursive inverse dynamics.
            assert values is not None
            return self._filled(full, found) @ self._without_loads(values)

        given = known or {}
        wanted = [e for e in self.effects if not (e.needs_torque and values is None)]
        found = self._in_order(
            [e for e in wanted if e.label not in given], block, values, given, torque
        )
        return self._filled(full, found)

    def whole_columns(
        self, block: Block, values: np.ndarray | None = None
    ) -> dict[str, np.ndarray]:
        """Columns of the effects that need the whole recording, by their labels.

        Parameters
        ----------
        block : Block
            The whole recording at its full rate; no regressor is needed.
        values : as for `columns`.

        Returns
        -------
        label -> (T, n, k)
        """
        whole = [effect for effect in self.effects if effect.needs_recording]
        return self._in_order(
            whole, block, values, {}, lambda found: self.torque_without_loads(block, values, found)
        )

    def _in_order(
        self,
        effects: Sequence[Effect],
        block: Block,
        values: np.ndarray | None,
        known: Mapping[str, np.ndarray],
        torque: Callable[[Mapping[str, np.ndarray]], np.ndarray],
    ) -> dict[str, np.ndarray]:
        """Columns by label: of the effects that make the torque, then of those that depend on it.

        `torque` predicts it from the columns of the former, as soon as one of the latter asks.
        """
        found = dict(known)
        for effect in sorted(effects, key=lambda one: one.needs_torque):
            if effect.needs_torque and block.torque is None:
                block = replace(block, torque=torque(found))
            found[effect.label] = effect.columns(self.ready(effect, block, values))
        return found

    def _filled(self, full: np.ndarray, found: Mapping[str, np.ndarray]) -> np.ndarray:
        for label, own in found.items():
            full[:, :, self.slices[label]] = own
        return full

    def torque(self, block: Block, values: np.ndarray) -> np.ndarray:
        """Predicted torque, (T, n) in N m or N."""
        return self.columns(block, values) @ values

    def relaxed(self, at: np.ndarray, found: np.ndarray) -> np.ndarray:
        """Values at which to take columns that depend on the fitted model next.

        Where a share e is added to the torque, the plain repetition (at `found`) shrinks its error
        by -e only, and grows it from e = 1 on. This step shrinks it by e / (2 + e) at worst.

        Parameters
        ----------
        at : (p,) values at which these columns were taken.
        found : (p,) values fitted with them.
        """
        loads = (found[self.slices[e.label]] for e in self.effects if e.linear_in_torque)
        shares = np.concatenate([np.zeros(1), *loads])
        return at + 2.0 / max(2.0 + shares.min() + shares.max(), 0.1) * (found - at)

    def torque_without_loads(
        self,
        block: Block,
        values: np.ndarray | None,
        known: Mapping[str, np.ndarray] | None = None,
    ) -> np.ndarray:
        """Predicted torque, but for effects that depend on it, (T, n) in N m or N.

        By recursive inverse dynamics: `block` needs no regressor unless an effect does.

        Parameters
        ----------
        values, known : as for `columns`; without values the torque is zero.
        """
        if values is None:
            return np.zeros(block.q.shape)
        carries = block.carries_payload
        bodies = self._bodies(values, carries_payload=carries)
        torque = bodies.inverse_dynamics(block.q, block.v, block.a)
        for effect in self.effects:
            if effect.needs_torque or effect.is_payload:
                continue
            own = (known or {}).get(effect.label)
            if own is None:
                own = effect.columns(self.ready(effect, block, values))
            torque = torque + own @ values[self.slices[effect.label]]
        return torque

    # --- the robot that the parameters describe -------------------------------------------------

    def ready(self, effect: Effect, block: Block, values: np.ndarray | None) -> Block:
        """Return a block with all that an effect needs of the model: bodies, regressor, torque.

        What the block has already stays as it is.

        Parameters
        ----------
        effect : of this model, or a candidate for it.
        block : of any length.
        values : (p,); None for the robot as described, and no torque.

        Returns
        -------
        A block that effects of the same `shares_block` can use as well.
        """
        block = self.with_bodies(effect, block, values)
        if effect.needs_regressor and block.rigid is None:
            block = replace(block, rigid=self.robot.regressor(block.q, block.v, block.a))
        if effect.needs_torque and block.torque is None:
            block = replace(block, torque=self.torque_without_loads(block, values))
        return block

    def with_bodies(self, effect: Effect, block: Block, values: np.ndarray | None) -> Block:
        """Return a block with the bodies that an effect needs, and no more of what it needs.

        Parameters
        ----------
        effect, block, values : as for `ready`.

        Returns
        -------
        The block itself where the effect needs none, or the block has them.
        """
        if effect.needs_bodies and block.body is None:
            values = self.given_values() if values is None else values
            carries = block.carries_payload
            body = self.current_robot(values, effect, carries_payload=carries)
            empty = self.current_robot(values, effect) if carries else body
            block = replace(block, body=body, empty=empty, rotor=self.rotor(values))
        return block

    def shares_block(self, effect: Effect) -> Hashable:
        """Return what effects have in common that can use one and the same `ready` block."""
        # What comes before an effect of the model is another robot than what a candidate sees.
        before = effect.label if effect.needs_bodies and effect in self else ""
        return effect.needs & Needs.OF_MODEL, before

    def current_robot(
        self, values: np.ndarray, before: Effect | None = None, *, carries_payload: bool = False
    ) -> Robot:
        """Return the robot with the bodies, and the changes of them, that the parameters say.

        Each effect that changes the robot builds on those before it in the model, so that
        together they are the torque of the robot with all of them.

        Parameters
        ----------
        values : (p,); what base parameters leave open is as near to the description as it can be.
        before : an effect of the model: without it and those after it.
        carries_payload : whether the payload is on board.
        """
        robot = self._bodies(values, carries_payload=carries_payload)
        for effect in self.effects:
            if before is not None and effect.label == before.label:
                break
            if effect.needs_bodies:
                robot = effect.simulated_robot(_plain(values[self.slices[effect.label]]), robot)
        return robot

    def rotor(self, values: np.ndarray) -> np.ndarray:
        """Inertia that effects add at each joint, (n,) kg m^2 or kg."""
        total = np.zeros(self.robot.n)
        for effect in self.effects:
            own = _plain(values[self.slices[effect.label]])
            total += np.diag(effect.simulated_inertia(own, self.robot))
        return total

    def _bodies(self, values: np.ndarray, *, carries_payload: bool) -> Robot:
        """The robot with its base parameters and payload; the last ones asked for are kept."""
        key = (values.tobytes(), carries_payload)
        if key not in self._made:
            if len(self._made) > 1:
                self._made.clear()
            base = values[: self.base.rank]
            robot = self.robot.with_theta(
                nearest_parameters(self.base, self.robot.theta, np.asarray(base))
            )
            for effect in self.effects:
                if effect.is_payload and carries_payload:
                    robot = effect.simulated_robot(_plain(values[self.slices[effect.label]]), robot)
            self._made[key] = robot
        return self._made[key]

    @cached_property
    def _made(self) -> dict[tuple[bytes, bool], Robot]:
        return {}

    def _without_loads(self, values: np.ndarray) -> np.ndarray:
        """Values with those of effects that depend on the predicted torque at zero."""
        without = np.array(values)
        for effect in self.effects:
            if effect.needs_torque:
                without[self.slices[effect.label]] = 0.0
        return without

    def linearisation_point(self) -> np.ndarray:
        """Values at which columns that are not linear in them are taken, all others zero, (p,)."""
        values = np.zeros(self.size)
        for effect in self.effects:
            if effect.point:
                values[self.slices[effect.label]] = effect.point
        return values

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


def _plain(values: np.ndarray) -> tuple[float, ...]:
    return tuple(float(x) for x in values)
