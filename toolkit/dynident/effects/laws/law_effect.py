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
from dynident.formulas import (
    Formula,
    Operation,
    Signal,
    Unit,
    evaluate,
    evaluate_slopes,
    nodes,
    units_of,
)
from dynident.robot import Robot
from dynident.words import nearest_and_all

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
                valid = nearest_and_all(str(joint), robot.names, "joints")
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
        columns = [found.column(one) for one in self.made_of.columns]
        return np.stack(columns, axis=1)

    def signal(self, signal: Signal, block: Block) -> Any:
        """What the formula takes of a block for one of its signals, (T,)."""
        return _BlockValues(self, block).signal(signal)

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
        """See `Effect.sensitivities`: exact."""
        law = self.made_of
        found = _BlockValues(self, block)
        full = np.zeros((*block.q.shape, len(law.linear), len(law.shape)))
        at_joint = full[:, block.index(self.joint)]
        for i, column in enumerate(law.columns if law.shape else ()):
            for k, slope in enumerate(found.slopes(column)):
                # A root has no slope at zero, where its column may have a value all the same.
                at_joint[:, i, k] = np.where(np.isfinite(slope), slope, 0.0)
        for k, (value, (_, lower, upper)) in enumerate(zip(self.shape, law.shape, strict=True)):
            at_joint[..., k] *= ShapeParameter("", "", (), lower=lower, upper=upper).slope(value)
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
        "reverses": any(isinstance(n, Operation) and n.name == "sign" for n in nodes(law.formula)),
    }
    return type(f"Law_{law.name}", (LawEffect,), content)


def _made(law: Law, *place: Any) -> LawEffect:
    return law_effect(law)(*place)


class _BlockValues:
    """What the columns of a law take from a block."""

    def __init__(self, effect: LawEffect, block: Block) -> None:
        self._effect, self._block = effect, block
        names = [name for name, _, _ in effect.made_of.shape]
        self._shape = dict(zip(names, effect.shape, strict=True))

    def column(self, formula: Formula) -> np.ndarray:
        """Return the torque of one linear parameter, (T,) per unit of it."""
        found = evaluate(formula, self)
        found = found if np.ndim(found) else np.full(len(self._block.t), found)
        # Of numbers, or of symbols where the block has them.
        return found if found.dtype == object else found.astype(float)

    def slopes(self, formula: Formula) -> list[Any]:
        """Return the derivatives of a column by each shape, (T,) or a number."""
        return evaluate_slopes(formula, self, list(self._shape))

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
        return self._shape[name]

    def sign(self, speed: Any, joints: tuple[str | None, ...]) -> Any:
        return self._block.sign(speed, *(one or self._effect.joint for one in joints))

    def sign_slope(self, sign: Any, joints: tuple[str | None, ...]) -> Any:
        return self._block.sign_slope(sign, *(one or self._effect.joint for one in joints))


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
