"""Constraint sets on standard parameters: each is linear or a second-order cone, hence convex."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol, SupportsFloat

import numpy as np
from numpy.typing import ArrayLike

from dynident.constraints.space import ParameterSpace
from dynident.errors import FitError

Consistency = Literal["full", "semi", "none"]
"""Which bodies are allowed.

"full": those of some mass distribution (4x4 pseudo-inertia positive semidefinite);
"semi": positive mass and central inertia (6x6 spatial inertia positive semidefinite), which is
what the virtual parameters of equation (5) of Ting et al. (RSS 2006) give: the triangle inequality
of the principal moments may be broken; "none": all.
"""

NOTIONS: dict[str, str] = {
    "full": "fully consistent: some mass distribution has these parameters",
    "semi": "semi-consistent only (equation 5): positive mass and central inertia, but the "
    "triangle inequality of the principal moments may be broken",
    "none": "not constrained to be consistent",
}


@dataclass(frozen=True, eq=False)
class Linear:
    """lower <= A x <= upper, entry by entry; equal bounds make an equality.

    Attributes
    ----------
    A : (k, s) on the standard parameters.
    lower, upper : (k,) may be infinite.
    """

    name: str
    A: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    unit: str = field(default="", kw_only=True)


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """A x in the second-order cone: the first entry is at least the norm of the others.

    Attributes
    ----------
    A : (k, s).
    """

    name: str
    A: np.ndarray
    unit: str = ""


class ConstraintSet(Protocol):
    """What a set says about the standard parameters of a model."""

    def on(self, space: ParameterSpace) -> tuple[Linear | SecondOrder, ...]:
        """Return the set as linear and second-order constraints."""
        ...


@dataclass(frozen=True)
class Bounds:
    """A parameter within bounds, by its name ("m.link3", "Fv@elbow"), in its own unit."""

    name: str
    lower: float = -np.inf
    upper: float = np.inf

    def on(self, space: ParameterSpace) -> tuple[Linear, ...]:
        return (_combination(space, self.name, {self.name: 1.0}, self.lower, self.upper),)


def Known(name: str, value: float) -> Bounds:
    """Return the set in which a parameter has a known value: a mass, a friction."""
    return Bounds(name, value, value)


@dataclass(frozen=True)
class Sum:
    """A weighted sum of parameters within bounds.

    Attributes
    ----------
    weights : factor of each parameter, by name.
    """

    weights: dict[str, float]
    lower: float = -np.inf
    upper: float = np.inf
    name: str = "sum"

    def on(self, space: ParameterSpace) -> tuple[Linear, ...]:
        return (_combination(space, self.name, self.weights, self.lower, self.upper),)


@dataclass(frozen=True)
class TotalMass:
    """The mass of all moving bodies together, kg, as a scale shows it.

    A base that does not move is not in it.
    """

    lower: float
    upper: float

    def on(self, space: ParameterSpace) -> tuple[Linear, ...]:
        weights = {f"m.{body}": 1.0 for body in space.bodies}
        return (_combination(space, "total mass", weights, self.lower, self.upper),)


@dataclass(frozen=True, eq=False)
class Vanishing:
    """Combinations of parameters that are zero: those found irrelevant, say.

    Attributes
    ----------
    rows : (k, s) on the standard parameters.
    """

    rows: np.ndarray
    name: str = "irrelevant"

    def on(self, space: ParameterSpace) -> tuple[Linear, ...]:
        rows = np.asarray(self.rows, dtype=float)
        if rows.ndim != 2 or rows.shape[1] != space.size or not np.all(np.isfinite(rows)):
            what = f"rows of {space.size} finite numbers are needed, one for each parameter"
            raise FitError(what, self.name, "ParameterSpace.of(model).names says which")
        none = np.zeros(len(rows))
        return (Linear(self.name, rows, none, none),)


@dataclass(frozen=True, eq=False)
class CentreInBox:
    """The centre of mass of a body within a box.

    Attributes
    ----------
    body : the moving body.
    lower, upper : (3,) corners, m, in the body's frame.
    """

    body: str
    lower: ArrayLike
    upper: ArrayLike

    def on(self, space: ParameterSpace) -> tuple[Linear, ...]:
        where = f"centre of mass of {self.body}"
        low, high = _three(self.lower, where), _three(self.upper, where)
        if not np.all(low <= high):
            raise FitError("the box is empty", where, "lower must not exceed upper")
        A = np.zeros((6, space.size))
        start = space.body(self.body).start
        # m low <= h <= m high, which is linear: the centre of mass itself is not.
        A[:3, start], A[3:, start] = -low, high
        A[:3, start + 1 : start + 4], A[3:, start + 1 : start + 4] = np.eye(3), -np.eye(3)
        return (Linear(f"{where} in a box", A, np.zeros(6), np.full(6, np.inf), unit="kg m"),)


@dataclass(frozen=True, eq=False)
class CentreInEllipsoid:
    """The centre of mass of a body within an ellipsoid.

    Attributes
    ----------
    body : the moving body.
    centre : (3,) m, in the body's frame.
    semi_axes : (3,) m, positive.
    axes : (3, 3) directions of the semi-axes as columns, in the body's frame.
    """

    body: str
    centre: ArrayLike
    semi_axes: ArrayLike
    axes: ArrayLike = field(default_factory=lambda: np.eye(3))

    def on(self, space: ParameterSpace) -> tuple[SecondOrder, ...]:
        where = f"centre of mass of {self.body}"
        centre, semi = _three(self.centre, where), _three(self.semi_axes, where)
        if not np.all(semi > 0):
            raise FitError("a semi-axis is not positive", where, "give three lengths above 0")
        axes = np.asarray(self.axes, dtype=float)
        if axes.shape != (3, 3) or not np.allclose(axes.T @ axes, np.eye(3), atol=1e-6):
            raise FitError("its axes are not orthonormal", where, "give three unit vectors")
        unit = axes.T / semi[:, None]
        A = np.zeros((4, space.size))
        start = space.body(self.body).start
        A[0, start] = 1.0
        A[1:, start], A[1:, start + 1 : start + 4] = -unit @ centre, unit
        return (SecondOrder(f"{where} in an ellipsoid", A, "kg"),)


@dataclass(frozen=True)
class Symmetric:
    """Two bodies that are each other's mirror image, in their own frames.

    Attributes
    ----------
    left, right : moving bodies, or twice the same: a body that is its own mirror image.
    axis : the axis normal to the mirror; "" for bodies that are equal, not mirrored.
    """

    left: str
    right: str
    axis: Literal["x", "y", "z", ""] = "y"

    def on(self, space: ParameterSpace) -> tuple[Linear, ...]:
        sign = np.ones(3)
        if self.axis:
            sign["xyz".index(self.axis)] = -1.0
        x, y, z = sign
        mirror = np.array([1.0, x, y, z, 1.0, x * y, 1.0, x * z, y * z, 1.0])
        A = np.zeros((10, space.size))
        A[:, space.body(self.left)] += np.eye(10)
        A[:, space.body(self.right)] -= np.diag(mirror)
        A = A[np.any(A != 0, axis=1)]  # a body that is its own image: only the odd parameters
        name = f"{self.left} mirrors {self.right}"
        return (Linear(name, A, np.zeros(len(A)), np.zeros(len(A))),)


@dataclass(frozen=True)
class Within:
    """All that an estimate is to lie within.

    Attributes
    ----------
    consistency : see `Consistency`.
    sets : further constraint sets.
    inset : how far inside the consistent bodies a solution stays, in units of each body's
        reference: a body on the boundary is a flat one, and rounding would put it outside.
    """

    consistency: Consistency = "full"
    sets: Sequence[ConstraintSet] = ()
    inset: float = 1e-7

    def __post_init__(self) -> None:
        if self.consistency not in NOTIONS:
            remedy = f"choose one of {', '.join(NOTIONS)}"
            raise FitError(f"no notion of consistency '{self.consistency}'", remedy=remedy)
        if not 0.0 <= self.inset < 0.1:
            raise FitError(f"inset = {self.inset:g}", remedy="choose it from 0 to 0.1")
        sets = self.sets if isinstance(self.sets, Sequence) else (self.sets,)
        for one in sets:
            if not hasattr(one, "on"):
                remedy = "give TotalMass, Known, Bounds, Sum, CentreInBox, ..."
                raise FitError(f"a {type(one).__name__} is no constraint set", remedy=remedy)
        object.__setattr__(self, "sets", tuple(sets))

    @property
    def notion(self) -> str:
        """The notion of consistency, in words."""
        return NOTIONS[self.consistency]


def _three(values: ArrayLike, where: str) -> np.ndarray:
    array = np.asarray(values, dtype=float)
    if array.shape != (3,) or not np.all(np.isfinite(array)):
        raise FitError("three finite numbers are needed", where, "m, in the body's frame")
    return array


def _combination(
    space: ParameterSpace, name: str, weights: dict[str, float], lower: float, upper: float
) -> Linear:
    least, most = (_number(bound, "a bound", name) for bound in (lower, upper))
    if not least <= most or least == np.inf or most == -np.inf:
        what = f"the bounds {least:g} to {most:g} hold nothing"
        raise FitError(what, name, "lower must not exceed upper")
    A = np.zeros((1, space.size))
    for parameter, weight in weights.items():
        A[0, space.index(parameter)] = _number(weight, f"the weight of {parameter}", name)
    if not np.all(np.isfinite(A)):
        raise FitError("a weight is not finite", name, "give finite weights")
    unit = space.units[space.index(next(iter(weights)))] if weights else ""
    return Linear(name, A, np.array([least]), np.array([most]), unit=unit)


def _number(value: object, what: str, where: str) -> float:
    if isinstance(value, str | bytes | bool) or not isinstance(value, SupportsFloat):
        kind = "None" if value is None else f"a {type(value).__name__}"
        raise FitError(f"{what} is {kind}", where, "give a number")
    if np.isnan(number := float(value)):
        raise FitError(f"{what} is not a number (NaN)", where, "give a number")
    return number
