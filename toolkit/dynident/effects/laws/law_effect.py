"""The effect of a law at a joint: its columns, units, derivatives and simulation."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, lru_cache
from typing import Any, ClassVar, Self

import numpy as np

from dynident.effects.block import Block
from dynident.effects.effect import JointEffect, Motion, motion_unit
from dynident.effects.laws.law import Law
from dynident.effects.laws.shape_grid import shape_grid
from dynident.effects.parameter import Parameter, ShapeParameter
from dynident.effects.traits import Needs
from dynident.errors import EffectError
from dynident.formulas import Operation, Signal, Unit, evaluate, nodes, units_of
from dynident.robot import Robot

_UNITS = {
    "rad": {
        "q": Unit.of(rad=1),
        "v": Unit.of(rad=1, s=-1),
        "a": Unit.of(rad=1, s=-2),
        "load": Unit.of(N=1, m=1),
    },
    "m": {
        "q": Unit.of(m=1),
        "v": Unit.of(m=1, s=-1),
        "a": Unit.of(m=1, s=-2),
        "load": Unit.of(N=1),
    },
}
_OF_ALL = {"t": Unit.of(s=1), "temperature": Unit.of(degC=1)}
_SHOWN: tuple[tuple[str, Motion, str], ...] = (
    ("load", "load", "move {joint} under several loads"),
    ("a", "acceleration", "accelerate {joint} as hard as it goes"),
    ("temperature", "session", "repeat a recording of {joint} from cold until it is warm"),
    ("t", "session", "repeat a recording of {joint} throughout a long session"),
    ("v", "speed", "move {joint} at several speeds, in both directions and over its whole range"),
    ("q", "position range", "sweep {joint} over its whole range"),
)


class LawEffect(JointEffect):
    """The torque of a `Law` at a joint; `law_effect` makes a class of each law."""

    made_of: ClassVar[Law]
    in_catalogue: ClassVar[bool] = False

    # --- what it is ---------------------------------------------------------------------------

    @classmethod
    def candidates(cls, robot: Robot) -> Iterator[Self]:
        """Every joint at which the units of the formula are those of a torque; see `elsewhere`."""
        for joint in robot.names:
            try:
                yield cls(joint).on(robot)
            except EffectError:
                continue

    @classmethod
    def elsewhere(cls, robot: Robot) -> EffectError | None:
        """Why it sits at no joint of a robot; None where it sits at one."""
        refusal = None
        for joint in robot.names:
            try:
                cls(joint).on(robot)
            except EffectError as error:
                refusal = refusal or error
            else:
                return None
        return refusal

    def on(self, robot: Robot) -> Self:
        own = super().on(robot)
        own.parameters(robot)
        return own

    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        units = self._units(robot)
        return tuple(Parameter(name, str(units[name])) for name in self.made_of.linear)

    def shape_parameters(self, robot: Robot) -> tuple[ShapeParameter, ...]:
        law = self.made_of
        if not law.shape:
            return ()
        units = self._units(robot)
        grids = shape_grid(law)
        return tuple(
            ShapeParameter(name, str(units[name]), grids[name], lower=lower, upper=upper)
            for name, lower, upper in law.shape
        )

    def parameter_name(self, name: str) -> str:
        """As `wave.c@joint`: several laws may have a c at one joint."""
        return f"{self.made_of.name}.{super().parameter_name(name)}"

    def _units(self, robot: Robot) -> dict[str, Unit]:
        law = self.made_of
        joints = dict.fromkeys([self.joint, *(s.joint for s in law.signals if s.joint)])
        for joint in joints:
            if joint not in robot.names:
                valid = f"joints: {', '.join(robot.names)}"
                raise EffectError(f"the robot has no joint '{joint}'", self.label, valid)
        own = motion_unit(robot, self.joint)
        others = tuple((str(j), motion_unit(robot, j)) for j in joints if j != self.joint)
        try:
            return _units(law, own, others)
        except EffectError as error:
            raise EffectError(error.what, self.label, error.remedy) from None

    # --- its torque ----------------------------------------------------------------------------

    def at_joint(self, block: Block) -> np.ndarray:
        found = _BlockValues(self, block)
        columns = [found.column(name) for name in self.made_of.linear]
        return np.stack(columns, axis=1)

    def require_finite(self, columns: np.ndarray, block: Block) -> None:
        """See `Effect.require_finite`."""
        finite = np.isfinite(columns).all(axis=(1, 2))
        if not finite.all():
            row, j = int(np.argmin(finite)), block.index(self.joint)
            where = f"at q = {block.q[row, j]:.4g}, v = {block.v[row, j]:.4g}"
            remedy = "keep divisors, roots and exponents within what numbers can hold"
            what = f"{self.made_of.torque} is not finite {where}"
            raise EffectError(what, self.label, remedy)

    def sensitivities(self, block: Block) -> np.ndarray:
        """See `Effect.sensitivities`: exact, by CasADi."""
        law = self.made_of
        found = _BlockValues(self, block)
        full = np.zeros((*block.q.shape, len(law.linear), len(law.shape)))
        if law.shape:
            rows = [np.broadcast_to(found.signal(one), len(block.t)) for one in law.signals]
            inputs = np.stack([np.asarray(row, dtype=float) for row in rows])
            widths = [found.width(one) for one in _sign_joints(law)]
            slopes = np.array(_slopes(law)(inputs, widths, list(self.shape)))
            slopes = slopes.reshape(len(law.shape), len(law.linear), -1)
            # A root has no slope at zero, where its column may have a value all the same.
            slopes = np.where(np.isfinite(slopes), slopes, 0.0)
            full[:, block.index(self.joint)] = np.moveaxis(slopes, 2, 0).swapaxes(1, 2)
            for k, (value, (_, lower, upper)) in enumerate(zip(self.shape, law.shape, strict=True)):
                one = ShapeParameter("", "", (), lower=lower, upper=upper)
                full[..., k] *= one.slope(value)
        return full

    # --- its simulation ------------------------------------------------------------------------

    @property
    def not_simulated(self) -> str:
        """Accelerations and loads depend on the force that they would make."""
        held = sorted({"a", "load"} & self.made_of.quantities)
        if held:
            return f"its force depends on {' and '.join(held)}, which it changes itself"
        return "no simulation has a temperature" if "temperature" in self._quantities else ""

    @property
    def _quantities(self) -> frozenset[str]:
        return self.made_of.quantities

    def __reduce__(self) -> tuple[Any, ...]:
        # Its class is made, not imported: it is made again where it arrives.
        return _made, (self.made_of, self.joint, self.source, self.shape, self.point)


@cache
def law_effect(law: Law) -> type[LawEffect]:
    """Return the class of effects of a law; of equal laws it is the same.

    Parameters
    ----------
    law : checked by itself; on a robot, its effect is.
    """
    held = law.quantities
    shown, advice = next((s, a) for q, s, a in (*_SHOWN, ("", "speed", "")) if q in held or not q)
    needs = Needs.TORQUE if "load" in held else Needs.NOTHING
    content = {
        "__doc__": f"{law.torque}, a law of the user's.",
        "__module__": __name__,
        "made_of": law,
        "name": law.label,
        "law": law.torque,
        "sign_of": f"what follows {law.torque}",
        "experiment": advice or "record {joint} once more",
        "shown_by": shown,
        "needs": needs,
        "time_varying": bool({"t", "temperature"} & held),
        "reverses": bool(_sign_joints(law)),
    }
    return type(f"Law_{law.name}", (LawEffect,), content)


def _made(law: Law, *place: Any) -> LawEffect:
    return law_effect(law)(*place)


class _BlockValues:
    """What a formula takes from a block, for one of its linear parameters at a time."""

    def __init__(self, effect: LawEffect, block: Block) -> None:
        self._effect, self._block = effect, block
        names = [name for name, _, _ in effect.made_of.shape]
        self._shape = dict(zip(names, effect.shape, strict=True))
        self._one = ""

    def column(self, name: str) -> np.ndarray:
        """Return the torque of one linear parameter, (T,) per unit of it."""
        self._one = name
        found = evaluate(self._effect.made_of.formula, self)
        found = found if np.ndim(found) else np.full(len(self._block.t), found)
        # Of numbers, or of symbols where the block has them.
        return found if found.dtype == object else found.astype(float)

    def signal(self, signal: Signal) -> Any:
        block, joint = self._block, signal.joint or self._effect.joint
        match signal.quantity:
            case "t":
                return block.t
            case "q" | "v" | "a":
                return getattr(block, signal.quantity)[:, block.index(joint)]
            case "load":
                if block.torque is None:
                    what = "needs the predicted torque in the block"
                    raise EffectError(what, self._effect.label)
                return block.torque[:, block.index(joint)]
        known = block.temperature
        here = None if known is None else known[:, block.index(joint)]
        if here is None or not np.isfinite(here).all():
            remedy = f"record temperature.{joint}, or write a law of t"
            raise EffectError("the temperature is not recorded", self._effect.label, remedy)
        return here

    def parameter(self, name: str) -> float:
        return self._shape[name] if name in self._shape else float(name == self._one)

    def sign(self, speed: Any, joints: tuple[str | None, ...]) -> Any:
        return self._block.sign(speed, *(one or self._effect.joint for one in joints))

    def width(self, joints: tuple[str | None, ...]) -> float:
        """Friction width of a speed that is made of joints' speeds."""
        widths = np.broadcast_to(self._block.friction_width, len(self._block.names))
        each = (widths[self._block.index(one or self._effect.joint)] for one in joints)
        return float(max(each))


class _Symbols:
    """Symbols of a formula, for its derivatives."""

    def __init__(self, law: Law) -> None:
        import casadi

        def row(size: int, name: str) -> np.ndarray:
            symbols = casadi.SX.sym(name, size)
            return np.array([symbols[k] for k in range(size)], dtype=object)

        self.signals = row(len(law.signals), "x")
        self.widths = row(len(_sign_joints(law)), "w")
        self.shape = row(len(law.shape), "p")
        self._law = law
        self.one = ""

    def signal(self, signal: Signal) -> Any:
        k = self._law.signals.index(signal)
        return self.signals[k : k + 1]

    def parameter(self, name: str) -> Any:
        names = [one for one, _, _ in self._law.shape]
        if name not in names:
            return float(name == self.one)
        k = names.index(name)
        return self.shape[k : k + 1]

    def sign(self, speed: Any, joints: tuple[str | None, ...]) -> Any:
        k = _sign_joints(self._law).index(joints)
        return np.tanh(speed / self.widths[k : k + 1])


@cache
def _slopes(law: Law) -> Any:
    """Function of signals (m, T), widths and shapes: the columns by the shapes, (s k, T)."""
    import casadi

    symbols, columns = _Symbols(law), []
    for name in law.linear:
        symbols.one = name
        found = np.ravel(evaluate(law.formula, symbols))[0]
        columns.append(casadi.SX(found))
    signals, widths, shape = (
        casadi.vertcat(*one) if len(one) else casadi.SX(0, 1)
        for one in (symbols.signals, symbols.widths, symbols.shape)
    )
    by_shape = casadi.jacobian(casadi.vertcat(*columns), shape)
    slopes = casadi.densify(casadi.vec(by_shape))
    return casadi.Function("slopes", [signals, widths, shape], [slopes])


@cache
def _sign_joints(law: Law) -> tuple[tuple[str | None, ...], ...]:
    """Joints of each `sign` in the formula, see `evaluate`."""
    found = []
    for node in nodes(law.formula):
        if isinstance(node, Operation) and node.name == "sign":
            inner = (one.joint for one in nodes(node.of[0]) if isinstance(one, Signal))
            found.append(tuple(dict.fromkeys(inner)))
    return tuple(dict.fromkeys(found))


@lru_cache(maxsize=4096)
def _units(law: Law, own: str, others: tuple[tuple[str, str], ...]) -> dict[str, Unit]:
    """Units of the parameters, at a joint that moves in `own`; `others` by their names."""
    motion = {None: own, **dict(others)}

    def unit(signal: Signal) -> Unit:
        if signal.quantity in _OF_ALL:
            return _OF_ALL[signal.quantity]
        # A joint that is named may be the one at which the law sits.
        return _UNITS[motion.get(signal.joint, own)][signal.quantity]

    return dict(units_of(law.formula, unit, _UNITS[own]["load"]))
