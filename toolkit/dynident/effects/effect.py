"""What every physical effect says about itself.

An effect contributes a torque that the drives must supply on top of the rigid body's. Its columns
are linear in its parameters once its shape parameters are fixed, so that

    tau = Y(q, v, a) theta + sum over effects of columns(block) @ values.

One class holds everything that the rest of the package needs to know of an effect: columns,
parameters, units, bounds, how it is simulated, what it is confounded with, what it means to a
reader, and which experiment shows it; and it joins the catalogue when it is defined. The questions
about its columns are in `traits`, its simulation in `simulated`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar, Literal, Self

import numpy as np

from dynident.effects.block import Block
from dynident.effects.known_effects import join
from dynident.effects.parameter import Parameter, ShapeParameter
from dynident.effects.residual_picture import ResidualPicture
from dynident.effects.simulated import SimulatedEffect
from dynident.effects.terms import Term
from dynident.effects.traits import EffectTraits
from dynident.errors import EffectError
from dynident.robot import Robot
from dynident.words import nearest_and_all

_OWN = f"{__name__.partition('.')[0]}."
Motion = Literal[
    "speed",
    "slow",
    "reversals",
    "tiny reversals",
    "position range",
    "acceleration",
    "load",
    "session",
    "source alone",
    "payload",
    "repetition",
]
"""What shows an effect: a wide range of speeds; slow motion; many changes of direction; those of
less than 0.01 rad; a wide range of positions; high accelerations; a wide range of loads; a long
session; its source moving alone; recordings with and without the payload; a repeated period."""


@dataclass(frozen=True)
class Effect(EffectTraits, SimulatedEffect, ABC):
    """A physical effect at a joint (`joint`), between two (`source`), or of the whole robot.

    Attributes
    ----------
    joint : the joint whose torque changes (first); None for an effect of the whole robot.
    source : the other joint of a coupling.
    shape : values of `shape_parameters`, in their order.
    point : linearisation point, values of `parameters` at which columns are taken that are not
        linear in them: chords through it, so that there they are exact; empty for derivatives at
        zero.
    """

    joint: str | None = None
    source: str | None = None
    shape: tuple[float, ...] = ()
    point: tuple[float, ...] = ()

    name: ClassVar[str]
    """As it is written in a study. A class that has one of its own joins the catalogue."""
    in_catalogue: ClassVar[bool] = True
    """False keeps a class, and those derived from it, out of the catalogue."""
    place: ClassVar[Literal["joint", "pair", "robot", "joint or robot"]] = "joint"
    """Where it sits; "joint or robot" is common to all joints where no joint is named."""
    law: ClassVar[str]
    """The torque as a formula, for tables: of this joint; v[source] is of the other one's."""
    sign_of: ClassVar[str]
    """What it looks like in the residual, one clause."""
    meaning: ClassVar[str] = ""
    """What it is, as a clause for a reader who has never heard its name."""
    pictures: ClassVar[tuple[ResidualPicture, ...]] = ()
    """What it draws in residual maps, where that is a plain shape."""
    confounded_with: ClassVar[tuple[str, ...]] = ()
    experiment: ClassVar[str]
    """The experiment that shows it: a sentence in which {joint} and {source} are filled in."""
    shown_by: ClassVar[Motion] = "speed"
    """The kind of motion or experiment that shows it, for advice with a robot's numbers."""
    contains: ClassVar[tuple[str, ...]] = ()
    """Simpler effects whose columns are among this one's."""
    stands_in_for: ClassVar[tuple[str, ...]] = ()
    """Simpler effects whose columns it has, or may seem to have: they are named first where they do
    most of the work."""
    excludes: ClassVar[tuple[str, ...]] = ()
    """Effects that a diagnosis asks for no more at its joint, once it is in the model."""
    requires: ClassVar[tuple[str, ...]] = ()
    """Labels of effects without which it makes no torque: a diagnosis asks for it beside them."""
    beyond: ClassVar[tuple[str, ...]] = ()
    """Effects at the same joint of which it is a refinement: a diagnosis asks for these first."""
    found_by: ClassVar[Literal["residual", "repetition"]] = "residual"
    """Where it shows: in what repetitions have in common, or in what differs between them."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        """Join the catalogue, unless the class is internal; see `known_effects.join`."""
        super().__init_subclass__(**keywords)
        if "name" in vars(cls):  # another effect than the one that it derives from: other words
            cls.meaning = vars(cls).get("meaning", "")
            cls.pictures = vars(cls).get("pictures", ())
        join(cls)

    # --- what it is ---------------------------------------------------------------------------

    @classmethod
    def candidates(cls, robot: Robot) -> Iterator[Self]:
        """Every place of a robot where the effect may sit."""
        names = robot.names
        if cls.place in ("robot", "joint or robot"):
            yield cls()
        common = cls.place == "joint or robot" and robot.n == 1
        if cls.place in ("joint", "joint or robot") and not common:
            for joint in names:
                yield cls(joint)
        if cls.place == "pair":
            for joint in names:
                for source in names:
                    if source != joint:
                        yield cls(joint, source)

    @abstractmethod
    def parameters(self, robot: Robot) -> tuple[Parameter, ...]:
        """Linear parameters with units and bounds, in the order of the columns."""

    def shape_parameters(self, robot: Robot) -> tuple[ShapeParameter, ...]:
        """Parameters of the columns' shape; none by default."""
        return ()

    def on(self, robot: Robot) -> Self:
        """Return this effect checked against a robot, with its shape filled in.

        Raises
        ------
        EffectError
            If the joint or the source is missing, unknown or out of place, or a shape parameter
            is outside its bounds.
        """
        with_joint = self.place != "robot"
        if self.place == "joint or robot":
            with_joint = self.joint is not None
        for role, value, expected in (
            ("joint", self.joint, with_joint),
            ("source", self.source, self.place == "pair"),
        ):
            if (value is not None) != expected:
                verb = "needs" if expected else "takes no"
                raise EffectError(f"{self.name} {verb} {role}", self.label, _form(type(self)))
            if value is not None and value not in robot.names:
                valid = nearest_and_all(str(value), robot.names, "joints")
                raise EffectError(f"the robot has no joint '{value}'", self.label, valid)
        if self.source is not None and self.source == self.joint:
            raise EffectError("a joint is not coupled to itself", self.label, _form(type(self)))
        wanted = self.shape_parameters(robot)
        shape = self.shape or tuple(s.grid[len(s.grid) // 2] for s in wanted)
        if len(shape) != len(wanted):
            raise EffectError(f"{len(wanted)} shape parameters, got {len(shape)}", self.label)
        for value, s in zip(shape, wanted, strict=True):
            if not s.lower <= value <= s.upper:
                limits = f"between {s.lower:g} and {s.upper:g} {s.unit}"
                raise EffectError(f"{s.name} = {value:g}", self.label, f"choose it {limits}")
        return replace(self, shape=tuple(float(value) for value in shape))

    def shaped(self, *shape: float) -> Self:
        """Return the effect with other shape parameters."""
        return replace(self, shape=tuple(float(value) for value in shape))

    def variants(self, robot: Robot) -> Iterator[Self]:
        """With every combination of its shape grids, to be screened."""
        for shape in product(*(one.grid for one in self.shape_parameters(robot))):
            yield self.shaped(*shape)

    def sought_in(self, robot: Robot) -> tuple[tuple[float, float], ...]:
        """Limits of shapes, then of values, to search through where a few shapes may miss the true.

        Empty, the default, for effects whose variants are near enough to any shape.
        """
        return ()

    @property
    def is_of_an_instant(self) -> bool:
        """Whether its torque is a function of the motion at an instant, and of nothing else."""
        past = self.needs_recording or self.is_payload or self.time_varying
        return self.found_by == "residual" and not past

    def lines_over_position(self, robot: Robot) -> tuple[float, float] | None:
        """Limits of its one shape where that is the phase of a wave per unit of the position.

        Between them a spectrum over the positions tells where to look, between the values of the
        grid or beyond them; None, the default, where the grid is near enough to every shape.
        """
        return None

    def unresolved(self, values: Sequence[float], step: float) -> str:
        """Why such values say nothing at a time of `step` s between samples; empty if they do."""
        return ""

    def suited(self, block: Block) -> Self:
        """Return the effect with those shapes that the fitted model in a block suggests."""
        return self

    def at(self, values: Sequence[float]) -> Self:
        """Return the effect with its columns taken at other values; itself where it is linear."""
        return replace(self, point=tuple(float(x) for x in values)) if self.nonlinear else self

    @property
    def label(self) -> str:
        """`name@joint`, `name@joint:source` or `name`."""
        if self.joint is None:
            return self.name
        return f"{self.name}@{self.joint}" + (f":{self.source}" if self.source else "")

    @property
    def title(self) -> str:
        """The label as words."""
        words = self.name.replace("_", " ")
        if self.joint is None:
            return words
        return f"{words} at {self.joint}" + (f" from {self.source}" if self.source else "")

    def parameter_name(self, name: str) -> str:
        """Return the name of a parameter in a model: `Fv@joint`, or `payload.m`."""
        place = self.label.partition("@")[2]
        return f"{name}@{place}" if place else f"{self.name}.{name}"

    @property
    def formula(self) -> str:
        """The torque as a formula, the other joint by its name."""
        return self.law.replace("[source]", f"[{self.source}]")

    @property
    def advice(self) -> str:
        """The experiment that shows this effect at its place."""
        return self.experiment.format(joint=self.joint, source=self.source)

    # --- its torque ----------------------------------------------------------------------------

    @abstractmethod
    def columns(self, block: Block) -> np.ndarray:
        """Torque per unit of each linear parameter, (T, n, k) in N m or N."""

    def require_finite(self, columns: np.ndarray, block: Block) -> None:
        """Refuse columns (T, n, k) in a model that are not numbers; nothing by default.

        Raises
        ------
        EffectError
            Saying where.
        """

    def acting_at(self, robot: Robot) -> tuple[int, ...]:
        """Columns of the joints whose torque it changes."""
        return tuple(range(robot.n))

    def acting_columns(self, block: Block) -> np.ndarray:
        """Columns at the joints whose torque it changes, (T, J, k); see `acting_at`."""
        return self.columns(block)

    def family(self, variants: Sequence[Any], blocks: Sequence[Block]) -> list[list[np.ndarray]]:
        """Columns of `variants`, this effect with several shapes, in each of several blocks.

        For less than one after the other, where that can be.
        """
        return [[one.columns(block) for one in variants] for block in blocks]

    def time_factor(self, block: Block) -> np.ndarray:
        """The factor of its columns that depends on the time of the session, (T,)."""
        return np.ones(len(block.t))

    def sensitivities(self, block: Block) -> np.ndarray | None:
        """Derivatives of the columns by the coordinate of each of s shape parameters.

        See `ShapeParameter`: by the logarithms of those that are positive.

        Returns
        -------
        (T, n, k, s) exact derivatives; None where none are known, and shapes are sought without.
        """
        return None

    def point_slope(self, block: Block) -> np.ndarray | None:
        """Derivative of the torque by the value, at the value where the column is taken.

        Of an effect whose column is the response to one value (`point`), per unit of it.

        Returns
        -------
        (T, n, 1) where `sensitivities` are known as well; None where a value is not a point.
        """
        return None


class Forceless(Effect):
    """An effect that is simulated by a change of the plant, not by a force on it."""

    def simulated_force(self, values: Sequence[float], block: Block) -> np.ndarray:
        return np.zeros(block.q.shape)

    def simulated_terms(self, values: Sequence[float], robot: Robot) -> tuple[Term, ...]:
        return ()


class JointEffect(Effect):
    """An effect whose torque acts at one joint only."""

    @abstractmethod
    def at_joint(self, block: Block) -> np.ndarray:
        """Columns at `joint`, (T, k)."""

    def acting_at(self, robot: Robot) -> tuple[int, ...]:
        return (robot.names.index(str(self.joint)),)

    def acting_columns(self, block: Block) -> np.ndarray:
        return self._here(block)[:, None, :]

    def columns(self, block: Block) -> np.ndarray:
        here = self._here(block)
        # Of the same type, so that the columns can also be taken of symbols (see closed_loop).
        full = np.zeros((len(block.t), len(block.names), here.shape[1]), dtype=here.dtype)
        full[:, block.index(self.joint)] = here
        return full

    def _here(self, block: Block) -> np.ndarray:
        """Columns at `joint`; those of a class from elsewhere only if they are numbers."""
        here = self.at_joint(block)
        if type(self).__module__.startswith(_OWN) or here.dtype == object:  # or symbols
            return here
        if here.ndim != 2 or len(here) != len(block.t):
            what = f"at_joint() has the shape {here.shape} for {len(block.t)} samples"
            raise EffectError(what, self.label, "return (samples, parameters)")
        bad = ~np.isfinite(here).all(axis=1)
        if bad.any():  # a motion that is not finite itself is no fault of the law
            bad &= np.isfinite(block.q).all(axis=1) & np.isfinite(block.v).all(axis=1)
        if bad.any():
            j, row = block.index(self.joint), int(np.argmax(bad))
            at = f"first at q = {block.q[row, j]:.4g}, v = {block.v[row, j]:.4g}"
            rows = f"{np.count_nonzero(bad)} of {len(here)} of its columns' rows"
            raise EffectError(f"{rows} are not finite, {at}", self.label, "correct the class")
        return here


def motion_unit(robot: Robot, joint: str | None) -> str:
    """Unit of a joint's position: rad or m."""
    return "m" if robot.kinds[robot.names.index(str(joint))] == "prismatic" else "rad"


def force_unit(robot: Robot, joint: str | None) -> str:
    """Unit of a joint's torque or force: N m or N."""
    return "N" if motion_unit(robot, joint) == "m" else "N m"


def _form(effect: type[Effect]) -> str:
    forms = {
        "joint": "@JOINT",
        "pair": "@JOINT:SOURCE",
        "robot": "",
        "joint or robot": " or, at one joint, @JOINT",
    }
    form = forms[effect.place]
    return f"write it {effect.name}{form}"
