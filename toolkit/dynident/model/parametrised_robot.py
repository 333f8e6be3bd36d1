"""Parameters of a robot with effects: names, units, places, and the robot that they describe."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from dynident.effects import FRICTION_WIDTH, Effect, Law, effects_of
from dynident.errors import EffectError
from dynident.robot import (
    BaseParameters,
    Robot,
    nearest_parameters,
    structural_base,
    written_out,
)

_CANCELLED = 1e-9
"""Share of what is added up below which a coefficient is rounding."""


@dataclass(frozen=True, eq=False)
class JointEffects:
    """Effects of a model at one joint, each with that joint's number among those where it acts.

    Attributes
    ----------
    plain : effects whose columns follow from the motion alone.
    dependent : effects whose columns depend on the fit.
    known_by : what the columns of the plain ones depend on besides the motion.
    places : numbers of the parameters of the plain ones, then of the dependent ones.
    """

    plain: tuple[tuple[Effect, int], ...]
    dependent: tuple[tuple[Effect, int], ...]
    known_by: tuple[Hashable, ...]
    places: np.ndarray

    @classmethod
    def of(cls, model: ParametrisedRobot, at: Sequence[tuple[Effect, int]]) -> JointEffects:
        """Return some effects of a model as those at a joint."""
        plain = tuple(one for one in at if not one[0].depends_on_fit)
        dependent = tuple(one for one in at if one[0].depends_on_fit)
        slices = (model.slices[effect.label] for effect, _ in (*plain, *dependent))
        places = [np.arange(one.start, one.stop) for one in slices]
        known_by = tuple(model.known_by(effect) for effect, _ in plain)
        return cls(plain, dependent, known_by, np.concatenate([np.empty(0, dtype=int), *places]))


@dataclass(frozen=True)
class ParametrisedRobot:
    """A robot and its effects as parameters.

    They are the robot's base parameters (structurally identifiable combinations of the standard
    inertial parameters), then those of each effect in turn.

    Attributes
    ----------
    robot : the tree of joints and links.
    effects : at most one of a label.
    friction_width : rad/s or m/s, see `dynident.effects.FRICTION_WIDTH`; of all joints, or n of
        them.
    laws : of the user, whose effects can be in the model, and are looked for where it fails.
    """

    robot: Robot
    effects: tuple[Effect, ...] = ()
    friction_width: float | tuple[float, ...] = FRICTION_WIDTH
    laws: tuple[Law, ...] = ()

    def __post_init__(self) -> None:
        checked = tuple(effect.on(self.robot) for effect in self.effects)
        labels = [effect.label for effect in checked]
        for label in labels:
            if labels.count(label) > 1:
                raise EffectError("is in the model twice", label, "name it once")
        if not np.all(np.asarray(self.friction_width) > 0):
            raise EffectError(f"friction_width = {self.friction_width}", remedy="choose it above 0")
        if np.size(self.friction_width) not in (1, self.robot.n):
            what = f"{np.size(self.friction_width)} friction widths for {self.robot.n} joints"
            raise EffectError(what, remedy="give one for all of them, or one for each")
        object.__setattr__(self, "effects", checked)

    def __repr__(self) -> str:
        effects = ", ".join(effect.label for effect in self.effects) or "no effects"
        return f"<Model of {self.robot!r}; {effects}>"

    @cached_property
    def friction_widths(self) -> np.ndarray:
        """Friction width of each joint, (n,) rad/s or m/s."""
        return np.broadcast_to(self.friction_width, self.robot.n)

    def with_friction_width(self, joint: str, width: float) -> Self:
        """Return the model with another friction width, in rad/s or m/s, at one joint."""
        widths = [float(w) for w in self.friction_widths]
        widths[self.robot.names.index(joint)] = float(width)
        return self._with(friction_width=tuple(widths))

    # --- with other effects --------------------------------------------------------------------

    def __add__(self, addition: Effect | str | tuple[Effect, ...]) -> Self:
        """Return the model with an effect more (`name`, `name@joint`, an effect or several)."""
        if isinstance(addition, str):
            addition = effects_of(addition, self.robot, self.laws)
        more = addition if isinstance(addition, tuple) else (addition,)
        return self._with(effects=(*self.effects, *more))

    def __sub__(self, effect: Effect | str) -> Self:
        """Return the model without an effect, given as itself or by its label."""
        without = self.effect(effect if isinstance(effect, str) else effect.label)
        return self._with(effects=tuple(one for one in self.effects if one is not without))

    def __contains__(self, effect: Effect | str) -> bool:
        label = effect if isinstance(effect, str) else effect.label
        return label in self._by_label

    def effect(self, label: str) -> Effect:
        """Return the effect of a label, with its shape; EffectError if it is not in the model."""
        if label not in self._by_label:
            raise EffectError("is not in the model", label)
        return self._by_label[label]

    @cached_property
    def _by_label(self) -> dict[str, Effect]:
        return {effect.label: effect for effect in self.effects}

    def with_shapes(self, effects: tuple[Effect, ...]) -> Self:
        """Return the model with these effects in place of those of the same labels."""
        by_label = {effect.label: effect for effect in effects}
        return self._with(effects=tuple(by_label.get(e.label, e) for e in self.effects))

    def _with(self, **changes: Any) -> Self:
        made = replace(self, **changes)
        if "base" in self.__dict__:
            made.__dict__["base"] = self.base  # the costly part, and the same
        return made

    def at(self, values: np.ndarray) -> Self:
        """Return the model linearised at other values, (p,), where it is not linear in them."""
        moved = tuple(
            effect.at(plain(values[self.slices[effect.label]]))
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
        """Names of the parameters, those of effects as `Fv@joint`; no two alike."""
        rigid = (self.base.names[i] for i in self.base.independent)
        return (*rigid, *self._effect_names)

    @cached_property
    def _effect_names(self) -> tuple[str, ...]:
        linear, _ = self._names_by_effect
        return tuple(name for names in linear.values() for name in names)

    @property
    def shape_names(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the parameters inside each effect, by its label; as `names`, no two alike."""
        return self._names_by_effect[1]

    @cached_property
    def _names_by_effect(self) -> tuple[dict[str, tuple[str, ...]], dict[str, tuple[str, ...]]]:
        """Names of linear parameters and of those inside, by the labels of the effects.

        Where a name is taken, by another effect at the same joint, that of the effect stands before
        it: `torque_ripple.k@elbow` beside the `k@elbow` of a spring.
        """
        linear, inside = {}, {}
        taken: set[str] = set()
        for found, parameters in (
            (linear, [effect.parameters(self.robot) for effect in self.effects]),
            (inside, [effect.shape_parameters(self.robot) for effect in self.effects]),
        ):
            for effect, each in zip(self.effects, parameters, strict=True):
                names = [effect.parameter_name(one.name) for one in each]
                names = [f"{effect.name}.{one}" if one in taken else one for one in names]
                found[effect.label] = tuple(names)
                taken |= set(names)
        return linear, inside

    @cached_property
    def expressions(self) -> tuple[str, ...]:
        """Each parameter as a combination of standard parameters."""
        return (*self.base.expressions, *self._effect_names)

    def stands_for(self, basis: BaseParameters) -> tuple[str, ...]:
        """What data tell, written in standard parameters of the links and those of effects.

        A combination of base parameters, each of them a combination itself, may lack a standard
        parameter that its first one has.

        Parameters
        ----------
        basis : of combinations of the model's parameters, or of some of them.

        Returns
        -------
        For each combination; empty where it is the parameter alone.
        """
        every = (*self.base.names, *self._effect_names)
        place = {name: k for k, name in enumerate(every)}
        told = np.zeros((len(basis.names), len(every)))
        heads = dict(zip(self.names, self.base.told, strict=False))
        for row, name in enumerate(basis.names):
            if name in heads:
                told[row, : len(self.base.names)] = heads[name]
            else:
                told[row, place[name]] = 1.0
        total, terms = basis.told @ told, np.abs(basis.told) @ np.abs(told)
        total[np.abs(total) <= _CANCELLED * terms] = 0.0
        found = []
        for row, head in zip(total, basis.independent, strict=True):
            name = basis.names[head]
            row[place[name]] = 0.0
            found.append(written_out(name, row, every) if np.any(row) else "")
        return tuple(found)

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Unit of each parameter."""
        rigid = (self.robot.parameter_units[i] for i in self.base.independent)
        return (*rigid, *(p.unit for e in self.effects for p in e.parameters(self.robot)))

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Columns of each effect, by its label."""
        found, start = {}, len(self.base.independent)
        for effect in self.effects:
            stop = start + len(effect.parameters(self.robot))
            found[effect.label] = slice(start, stop)
            start = stop
        return found

    def acting_at(self, joint: int, *, carries_payload: bool) -> JointEffects:
        """Return the effects that change a joint's torque."""
        key = joint, carries_payload
        if key not in self._acting:
            at = [
                (effect, joints.index(joint))
                for effect in self.effects
                if carries_payload or not effect.is_payload
                if joint in (joints := effect.acting_at(self.robot))
            ]
            self._acting[key] = JointEffects.of(self, at)
        return self._acting[key]

    def known_by(self, effect: Effect) -> Hashable:
        """What columns depend on that follow from the motion alone: dry friction where they act."""
        if not effect.reverses:
            return self.robot, effect
        names, widths = self.robot.names, self.friction_widths
        joints = [joint for joint in (effect.joint, effect.source) if joint is not None]
        return self.robot, effect, tuple(widths[names.index(joint)] for joint in joints or names)

    @cached_property
    def _acting(self) -> dict[tuple[int, bool], JointEffects]:
        return {}

    @property
    def size(self) -> int:
        """Number of columns."""
        return len(self.names)

    @cached_property
    def needs_values(self) -> bool:
        """Whether some columns depend on the parameters: they are taken at values, and again."""
        return any(e.nonlinear or e.depends_on_fit for e in self.effects)

    @property
    def is_time_varying(self) -> bool:
        """Whether some columns depend on the time in the session: no repetition equals another."""
        return any(e.time_varying for e in self.effects)

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

    # --- the robot that the parameters describe -------------------------------------------------

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
                robot = effect.simulated_robot(plain(values[self.slices[effect.label]]), robot)
        return robot

    def rotor(self, values: np.ndarray) -> np.ndarray:
        """Inertia that effects add at each joint, (n,) kg m^2 or kg."""
        total = np.zeros(self.robot.n)
        for effect in self.effects:
            own = plain(values[self.slices[effect.label]])
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
                    robot = effect.simulated_robot(plain(values[self.slices[effect.label]]), robot)
            self._made[key] = robot
        return self._made[key]

    @cached_property
    def _made(self) -> dict[tuple[bytes, bool], Robot]:
        return {}


def plain(values: np.ndarray) -> tuple[float, ...]:
    """Return values as effects take them."""
    return tuple(float(x) for x in values)
