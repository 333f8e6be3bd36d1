"""What every physical effect says about itself.

An effect contributes a torque that the drives must supply on top of the rigid body's. Its columns
are linear in its parameters once its shape parameters are fixed, so that

    tau = Y(q, v, a) theta + sum over effects of columns(block) @ values.

One class in one file holds everything that the rest of the package needs to know of an effect:
columns, parameters, units, bounds, how it is simulated, what it is confounded with, and which
experiment shows it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from dynident.effects.terms import Term
from dynident.errors import EffectError

if TYPE_CHECKING:
    from typing import Self

    from dynident.robot import Robot

FRICTION_WIDTH = 0.01
"""Speed (rad/s, or m/s for a prismatic joint) over which dry friction changes its sign.

The one law of dry friction in this package, in regression and in simulation, is
tanh(v / FRICTION_WIDTH); a study may set another width for all of its joints at once.
"""


@dataclass(frozen=True)
class Parameter:
    """A linear parameter of an effect: its name, unit and physical bounds."""

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True)
class ShapeParameter:
    """A parameter in which the columns are not linear, with the grid on which it is screened."""

    name: str
    unit: str
    grid: tuple[float, ...]
    lower: float
    upper: float


@dataclass(frozen=True)
class Block:
    """Consecutive samples of one recording, as effects see them.

    Attributes
    ----------
    t : (T,) s, from the start of the session.
    q, v, a : (T, n) rad or m, and their derivatives.
    names : the joints, in the order of the columns of q.
    friction_width : rad/s or m/s, see `FRICTION_WIDTH`.
    carries_payload : whether the payload under study is on the robot.
    tip : column of the joint that carries the last link, where a payload is mounted.
    rigid : (T, n, 10 n) the rigid-body regressor; None where no effect in use needs it.
    torque : (T, n) N m or N, torque that the present model predicts; None where none needs it.
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    names: tuple[str, ...]
    friction_width: float = FRICTION_WIDTH
    carries_payload: bool = False
    tip: int = -1
    rigid: np.ndarray | None = None
    torque: np.ndarray | None = None

    def index(self, joint: str | None) -> int:
        """Column of a joint."""
        if joint not in self.names:
            raise EffectError(f"no joint '{joint}'", mend=f"joints: {', '.join(self.names)}")
        return self.names.index(joint)

    def sign(self, speed: np.ndarray) -> np.ndarray:
        """Smoothed sign of a speed, the package's one law of dry friction."""
        return np.tanh(speed / self.friction_width)


@dataclass(frozen=True)
class Effect(ABC):
    """A physical effect at a joint (`joint`), between two (`source`), or of the whole robot.

    Attributes
    ----------
    joint : the joint whose torque changes (first); None for an effect of the whole robot.
    source : the other joint of a coupling.
    shape : values of `shape_parameters`, in their order.
    """

    joint: str | None = None
    source: str | None = None
    shape: tuple[float, ...] = ()

    name: ClassVar[str]
    place: ClassVar[Literal["joint", "pair", "robot"]] = "joint"
    law: ClassVar[str]
    """The torque as a formula, for tables."""
    sign_of: ClassVar[str]
    """What it looks like in the residual, one clause."""
    confounded_with: ClassVar[tuple[str, ...]] = ()
    experiment: ClassVar[str]
    """The experiment that shows it: a sentence in which {joint} and {source} are filled in."""
    contains: ClassVar[tuple[str, ...]] = ()
    """Simpler effects whose columns are among this one's."""
    stands_in_for: ClassVar[tuple[str, ...]] = ()
    """Those of `contains` whose column may belong to either: they are named first where they do
    most of the work."""
    needs: ClassVar[frozenset[str]] = frozenset()
    """What `Block` must carry: "rigid", "torque"; "payload" where runs with and without differ."""
    linear_in_torque: ClassVar[bool] = False
    """Whether its columns are linear in the predicted torque and depend on nothing else: then it
    does not matter whether they are filtered or made of filtered torque, which is quicker."""

    # --- what it is ---------------------------------------------------------------------------

    @classmethod
    def candidates(cls, robot: Robot) -> Iterator[Self]:
        """Every place of a robot where the effect may sit."""
        names = robot.names
        if cls.place == "robot":
            yield cls()
        elif cls.place == "joint":
            for joint in names:
                yield cls(joint)
        else:
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
        for role, value, expected in (
            ("joint", self.joint, self.place != "robot"),
            ("source", self.source, self.place == "pair"),
        ):
            if (value is not None) != expected:
                verb = "needs" if expected else "takes no"
                raise EffectError(f"{self.name} {verb} {role}", self.label, _form(type(self)))
            if value is not None and value not in robot.names:
                valid = f"joints: {', '.join(robot.names)}"
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

    @property
    def advice(self) -> str:
        """The experiment that shows this effect at its place."""
        return self.experiment.format(joint=self.joint, source=self.source)

    # --- its torque ----------------------------------------------------------------------------

    @abstractmethod
    def columns(self, block: Block) -> np.ndarray:
        """Torque per unit of each linear parameter, (T, n, k) in N m or N."""

    # --- how it is simulated: the four ways in which an effect can act on a plant --------------

    def simulated_force(self, values: Sequence[float], block: Block) -> np.ndarray:
        """Torque that it takes from the drives, (T, n), from t, q and v alone."""
        return self.columns(block) @ np.asarray(values, dtype=float)

    def simulated_terms(self, values: Sequence[float], robot: Robot) -> tuple[Term, ...] | None:
        """The same force as terms that a simulator evaluates natively; None if it has others.

        Such a force is evaluated in Python, which takes longer. Empty where there is no force.
        """
        return None

    def simulated_inertia(self, values: Sequence[float], robot: Robot) -> np.ndarray:
        """Addition to the joint-space inertia matrix, (n, n)."""
        return np.zeros((robot.n, robot.n))

    def simulated_robot(self, values: Sequence[float], robot: Robot) -> Robot:
        """The robot with the effect on board, where the effect is a change of its bodies."""
        return robot

    def simulated_gain(self, values: Sequence[float], robot: Robot) -> np.ndarray:
        """Recorded torque per torque that acts, (n,)."""
        return np.ones(robot.n)


class JointEffect(Effect):
    """An effect whose torque acts at one joint only."""

    @abstractmethod
    def at_joint(self, block: Block) -> np.ndarray:
        """Columns at `joint`, (T, k)."""

    def columns(self, block: Block) -> np.ndarray:
        here = self.at_joint(block)
        # Of the same type, so that the columns can also be taken of symbols (see closed_loop).
        full = np.zeros((len(block.t), len(block.names), here.shape[1]), dtype=here.dtype)
        full[:, block.index(self.joint)] = here
        return full


def motion_unit(robot: Robot, joint: str | None) -> str:
    """Unit of a joint's position: rad or m."""
    return "m" if robot.kinds[robot.names.index(str(joint))] == "prismatic" else "rad"


def force_unit(robot: Robot, joint: str | None) -> str:
    """Unit of a joint's torque or force: N m or N."""
    return "N" if motion_unit(robot, joint) == "m" else "N m"


def _form(effect: type[Effect]) -> str:
    form = {"joint": "@JOINT", "pair": "@JOINT:SOURCE", "robot": ""}[effect.place]
    return f"write it {effect.name}{form}"
