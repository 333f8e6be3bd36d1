"""Laws drawn at random that no catalogue has: products of functions of position, motion and load.

The torque is computed here, by NumPy from q, v and the load: nothing of it is the package's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any, ClassVar, Literal

import numpy as np

from blind_study.robots import Specimen
from dynident.effects import JointEffect, Parameter

NAME = "drawn_law"
"""Of the effect that puts a drawn law into a simulated plant."""
Family = Literal["library", "memory", "outside"]
"""Whether the library of the search has the law; or it has a state of its own; or neither."""


@dataclass(frozen=True)
class DrawnFactor:
    """A function of one signal.

    Attributes
    ----------
    name : of the function, see `_FUNCTIONS`.
    joint : column of the joint whose signal it is.
    numbers : the parameters inside it.
    """

    name: str
    joint: int
    numbers: tuple[float, ...] = ()


@dataclass(frozen=True)
class DrawnLaw:
    """A torque that the drive of a joint must supply: a product of factors.

    Attributes
    ----------
    joint : column.
    factors : one to three.
    width : rad/s over which what is dry friction in it changes its sign.
    scale : N m, so that one unit of it is as much as the joint's dry friction.
    family : see `Family`.
    """

    joint: int
    factors: tuple[DrawnFactor, ...]
    width: float
    scale: float = 1.0
    family: Family = "library"

    @classmethod
    def of(cls, said: dict[str, Any]) -> DrawnLaw:
        """Return the law that a truth tells."""
        factors = tuple(
            DrawnFactor(one["name"], one["joint"], tuple(one["numbers"])) for one in said["factors"]
        )
        return cls(**{**said, "factors": factors})

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)

    @property
    def of_load(self) -> bool:
        """Whether the load is in it, which the package's own simulator does not offer."""
        return any(one.name in _LOADS for one in self.factors)

    @property
    def has_memory(self) -> bool:
        return any(one.name in _RATES for one in self.factors)

    def words(self) -> str:
        """Return the law as text, for tables."""
        parts = []
        for one in self.factors:
            numbers = ", ".join(f"{x:.3g}" for x in one.numbers)
            place = "" if one.joint == self.joint else f"[joint{one.joint + 1}]"
            parts.append(f"{one.name}{place}" + (f"({numbers})" if numbers else ""))
        return " * ".join(parts)

    def torque(self, q: Any, v: Any, load: Any = 0.0, memory: Any = 0.0) -> Any:
        """Return the torque for one unit.

        Parameters
        ----------
        q, v : of each joint, a number or samples (T,), rad and rad/s.
        load : N m of this joint that all but this law takes.
        memory : its internal state.

        Returns
        -------
        A number or (T,) N m.
        """
        found = self.scale
        for one in self.factors:
            found = found * _FUNCTIONS[one.name](
                _Signals(q[one.joint], v[one.joint], load, memory, self.width), *one.numbers
            )
        return found

    def rate(self, v: Any, memory: Any) -> Any:
        """Return the rate of its internal state per s.

        Parameters
        ----------
        v : of each joint.
        memory : that state.
        """
        for one in self.factors:
            if one.name in _RATES:
                return _RATES[one.name](v[one.joint], memory, *one.numbers)
        return 0.0 * memory

    def past(self, step: float, v: np.ndarray) -> np.ndarray:
        """Return the internal state along samples, (T,), from a run through them before.

        Parameters
        ----------
        step : s between samples.
        v : (T, n) rad/s.
        """
        found, state, fine = np.zeros(len(v)), 0.0, 10
        if not self.has_memory:
            return found
        for _ in range(2):
            for k, speeds in enumerate(v):
                found[k] = state
                for _ in range(fine):
                    state += step / fine * self.rate(speeds, state)
        return found

    def beside(self, total: Any, q: Any, v: Any, amount: float, memory: Any = 0.0) -> Any:
        """Return the torque where the drive's whole torque is known and not the load.

        Parameters
        ----------
        total : N m of the drive, a number or (T,): load and law together.
        q, v : of each joint, a number or (T,).
        amount : units of the law.
        memory : its internal state.
        """
        found = amount * self.torque(q, v, total, memory)
        if self.of_load:
            for _ in range(12):
                found = (found + amount * self.torque(q, v, total - found, memory)) / 2
        return found


@dataclass(frozen=True)
class _Signals:
    q: Any
    v: Any
    load: Any
    memory: Any
    width: float

    @property
    def sign(self) -> Any:
        return np.tanh(self.v / self.width)


_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "q": lambda x: x.q,
    "q^2": lambda x: x.q**2,
    "wave": lambda x, k, p: np.sin(k * x.q + p),
    "v": lambda x: x.v,
    "sign": lambda x: x.sign,
    "abs v": lambda x: np.abs(x.v),
    "v abs v": lambda x: x.v * np.abs(x.v),
    "v^2": lambda x: x.v**2,
    "v^3": lambda x: x.v**3,
    "fading": lambda x, w: x.sign * np.exp(-np.abs(x.v) / w),
    "load": lambda x: x.load,
    "abs load": lambda x: np.abs(x.load),
    # Outside the library.
    "step of q": lambda x, middle, width: np.tanh((x.q - middle) / width),
    "bump of q": lambda x, middle, width: np.exp(-(((x.q - middle) / width) ** 2)),
    "growth of q": lambda x, width: np.exp(x.q / width),
    "saturated v": lambda x, limit: x.v / (1.0 + np.abs(x.v) / limit),
    "saturated load": lambda x, limit: limit * np.tanh(x.load / limit),
    # With a state.
    "lag": lambda x, constant: x.memory,
    "bristle": lambda x, distance: x.memory,
    "bouc wen": lambda x, distance, share: x.memory,
}
_RATES: dict[str, Callable[..., Any]] = {
    "lag": lambda v, x, constant: (v - x) / constant,
    "bristle": lambda v, x, distance: (v - np.abs(v) * x) / distance,
    "bouc wen": lambda v, x, distance, share: (
        (v - share * np.abs(v) * x - (1.0 - share) * v * np.abs(x)) / distance
    ),
}
_LOADS = ("load", "abs load", "saturated load")


class DrawnEffect(JointEffect):
    """The law in the package's own simulator, which compiles what is computed here."""

    drawn: ClassVar[DrawnLaw]
    in_catalogue = False
    sign_of = "a residual that nothing in the catalogue explains"
    experiment = "move {joint} once more"

    def parameters(self, robot):
        return (Parameter("c", "1"),)

    def at_joint(self, block):
        memory = 0.0 if block.memory is None else block.memory[:, 0]
        found = self.drawn.torque(block.q.T, block.v.T, 0.0, memory)
        return np.reshape(found, (-1, 1))

    def simulated_rate(self, values, block):
        assert block.memory is not None
        found = self.drawn.rate(block.v.T, block.memory[:, 0])
        return np.reshape(found, (-1, 1))


@cache
def effect_of(law: DrawnLaw) -> type[DrawnEffect]:
    """Return the class of effects of a law."""
    content = {
        "__module__": __name__,
        "name": NAME,
        "law": law.words(),
        "drawn": law,
        "memory": int(law.has_memory),
    }
    return type("Drawn", (DrawnEffect,), content)


# --- drawing ----------------------------------------------------------------------------------


def draw_law(family: Family, made: Specimen, width: float, rng: np.random.Generator) -> DrawnLaw:
    """Draw a law of one joint.

    Parameters
    ----------
    family : see `Family`.
    made : the robot.
    width : rad/s of dry friction.
    rng : of all that is drawn.
    """
    n = made.robot.n
    joint = int(rng.integers(n))
    far = int(rng.choice([i for i in range(n) if i != joint]))
    factors = _DRAWINGS[family](_Draw(made, joint, far, rng))
    law = DrawnLaw(joint, factors, width, 1.0, family)
    return DrawnLaw(joint, factors, width, float(made.dry[joint] / _usual(law, made)), family)


def _usual(law: DrawnLaw, made: Specimen) -> float:
    """Root mean square of a law over motion as the robot has it."""
    rng = np.random.default_rng(0)
    phase = rng.uniform(0.0, 2 * np.pi, (2000, made.robot.n))
    q, v = made.amplitude * np.sin(phase), made.speed * np.cos(phase) * rng.uniform(0, 1, (2000, 1))
    load = made.robot.inverse_dynamics(q, v, np.zeros_like(q))[:, law.joint]
    memory = v[:, law.joint] if law.factors[0].name == "lag" else np.sign(v[:, law.joint])
    return float(np.sqrt(np.mean(law.torque(q.T, v.T, load, memory) ** 2)))


@dataclass(frozen=True)
class _Draw:
    made: Specimen
    joint: int
    far: int
    rng: np.random.Generator

    def one(self, *names: str, far: bool = False) -> DrawnFactor:
        """One of some functions, of this joint or another."""
        joint = self.far if far else self.joint
        name = str(self.rng.choice(names))
        return DrawnFactor(name, joint, self._numbers(name, joint))

    def _numbers(self, name: str, joint: int) -> tuple[float, ...]:
        rng, reach, speed = self.rng, self.made.amplitude[joint], self.made.speed[joint]
        drawn: dict[str, tuple[float, ...]] = {
            "wave": (rng.uniform(1.0, 6.0), rng.uniform(-np.pi, np.pi)),
            "fading": (np.exp(rng.uniform(np.log(0.05), np.log(0.5))),),
            "step of q": (rng.uniform(-0.4, 0.4) * reach, rng.uniform(0.05, 0.3) * reach),
            "bump of q": (rng.uniform(-0.4, 0.4) * reach, rng.uniform(0.1, 0.3) * reach),
            "growth of q": (rng.choice([-1, 1]) * rng.uniform(0.3, 0.7) * reach,),
            "saturated v": (rng.uniform(0.05, 0.3) * speed,),
            "lag": (np.exp(rng.uniform(np.log(0.05), np.log(0.5))),),
            "bristle": (np.exp(rng.uniform(np.log(0.02), np.log(0.5))),),
            "bouc wen": (np.exp(rng.uniform(np.log(0.05), np.log(0.5))), rng.uniform(0.5, 0.9)),
        }
        return tuple(float(x) for x in drawn.get(name, ()))


_POSITION = ("q", "q^2", "wave", "wave")
_MOTION = ("v", "sign", "abs v", "v abs v", "v^2", "v^3", "fading")
_SPEED = ("v", "sign", "abs v", "v^2")
_LOAD = ("load", "abs load")


def _of_library(d: _Draw) -> tuple[DrawnFactor, ...]:
    match int(d.rng.integers(10)):
        case 0 | 1 | 2:  # friction that changes with position
            return d.one(*_POSITION), d.one(*_MOTION)
        case 3:  # with another joint's position
            return d.one(*_POSITION, far=True), d.one(*_MOTION)
        case 4:  # speeds of two joints
            return d.one("v", "sign", "abs v"), d.one("v", "abs v", "v^2", far=True)
        case 5:  # another joint's position and motion, at this one
            return d.one(*_POSITION, far=True), d.one(*_SPEED, far=True)
        case 6 | 7:  # load
            return d.one(*_POSITION, "v", "v^2"), d.one(*_LOAD)
        case 8:
            return d.one(*_POSITION), d.one(*_SPEED), d.one(*_LOAD)
    return d.one(*_POSITION), d.one(*_SPEED), d.one("q", "wave", "abs v", far=True)


def _with_memory(d: _Draw) -> tuple[DrawnFactor, ...]:
    state = d.one("lag", "bristle", "bouc wen")
    return (state, d.one(*_POSITION)) if d.rng.random() < 0.5 else (state,)


def _outside(d: _Draw) -> tuple[DrawnFactor, ...]:
    match int(d.rng.integers(4)):
        case 0:
            return d.one("step of q"), d.one("v", "abs v", "v^2")
        case 1:
            return d.one("bump of q"), d.one("v", "sign", "v abs v")
        case 2:
            return d.one("growth of q"), d.one("v", "sign")
    return d.one("saturated v"), d.one("wave", "q")


_DRAWINGS: dict[Family, Callable[[_Draw], tuple[DrawnFactor, ...]]] = {
    "library": _of_library,
    "memory": _with_memory,
    "outside": _outside,
}
