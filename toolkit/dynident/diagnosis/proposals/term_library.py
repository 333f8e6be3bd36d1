"""The terms of which laws are proposed: products of one to three factors, at one joint.

Of three there are too many: they are made of the best products of two.

Factors are of four sorts: position, motion, load, and the time of the session. Those of one term
are of different sorts, but for products of two joints' speeds or positions, waves among them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations, product
from math import prod
from typing import Literal

from dynident.effects import Law
from dynident.formulas import quoted_joint
from dynident.robot import Robot

Sort = Literal["position", "motion", "load", "session"]
Shape = tuple[str, float, float, float]
"""Name, start, lower and upper bound of a parameter inside a factor."""
_ORDER: tuple[Sort, ...] = ("motion", "position", "load", "session")  # of factors in a term
HARMONICS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
"""Frequencies of sines of the position, rad per rad or m; between them they are sought."""
_FREQUENCIES = ("k", "m")  # names of their shapes, of the first wave in a term and of the second
_REACH = 1.0  # of a frequency, to both sides
_LOWEST = 0.25
_DECAY = (0.02, 0.1, 0.5)  # rad/s or m/s, of an exponential of the speed
_SLOWEST, _FASTEST = 0.01, 3.0


@dataclass(frozen=True)
class Factor:
    """A function of the motion.

    Attributes
    ----------
    sort : of what.
    texts : formulas of its columns, with "{q}", "{v}" ... for the signals of its joint and the
        names of its shapes for their values.
    joint : None for the joint of the law.
    shape : its one shape parameter; or none.
    """

    sort: Sort
    texts: tuple[str, ...]
    joint: str | None = None
    shape: Shape | None = None

    def columns(self) -> tuple[str, ...]:
        """Formulas of its columns, its shape at the start."""
        return tuple(self._written(text, numeric=True) for text in self.texts)

    def formulas(self) -> tuple[str, ...]:
        """Formulas of its columns, its shape by name."""
        return tuple(self._written(text, numeric=False) for text in self.texts)

    def _written(self, text: str, *, numeric: bool) -> str:
        place = "" if self.joint is None else f"[{quoted_joint(self.joint)}]"
        signals = {name: f"{name}{place}" for name in ("q", "v", "a", "load")}
        found = text.format(**signals, shape=repr(self.shape[1]) if self.shape else "")
        if self.shape and not numeric:
            found = text.format(**signals, shape=self.shape[0])
        return found


@dataclass(frozen=True)
class LibraryTerm:
    """A product of factors.

    Attributes
    ----------
    factors : where several have more than one column, each of one goes with each of the others.
    """

    factors: tuple[Factor, ...]

    @property
    def size(self) -> int:
        """Number of columns."""
        return prod(len(one.texts) for one in self.factors)

    @property
    def price(self) -> int:
        """Of its factors: one each, and one for each other joint."""
        return len(self.factors) + sum(one.joint is not None for one in self.factors)

    @property
    def waves(self) -> int:
        """How many of its factors are waves over a position."""
        return sum(len(one.texts) > 1 for one in self.factors)

    @property
    def of_load(self) -> bool:
        """Whether the predicted torque is in it."""
        return any(one.sort == "load" for one in self.factors)

    @property
    def of_session(self) -> bool:
        """Whether the time is in it: it does not repeat with the motion."""
        return any(one.sort == "session" for one in self.factors)

    @property
    def torque(self) -> str:
        """Its formula, with a coefficient for each column."""
        single = [one.formulas()[0] for one in self.factors if len(one.texts) == 1]
        several = [one.formulas() for one in self.factors if len(one.texts) > 1]
        if several:
            each = enumerate(map("*".join, product(*several)), 1)
            sum_ = " + ".join(f"c{k}*{text}" for k, text in each)
            return "*".join([*single, f"({sum_})" if single else sum_])
        return "*".join(["c", *single])

    def law(self, name: str) -> Law:
        """Return the law of that formula, its frequencies and decays free."""
        shapes = [one.shape for one in self.factors if one.shape]
        ranges = tuple((name, lower, upper) for name, _, lower, upper in shapes)
        return Law(name=name, torque=self.torque, shape=ranges)

    @property
    def start(self) -> tuple[float, ...]:
        """Shapes at which it was screened, in the order of the law's."""
        return tuple(one.shape[1] for one in self.factors if one.shape)

    def beginning_at(self, shape: Sequence[float]) -> LibraryTerm:
        """Return the term with other shapes to begin with, in the order of `start`."""
        values = iter(shape)
        factors = (
            one if one.shape is None else replace(one, shape=_begun(one.shape, next(values)))
            for one in self.factors
        )
        return LibraryTerm(tuple(factors))


def _begun(shape: Shape, value: float) -> Shape:
    name, _, *given = shape
    return (name, value, *centred(name, value, (given[0], given[1])))


def centred(name: str, value: float, given: tuple[float, float]) -> tuple[float, float]:
    """Return the range in which a shape is sought when it is near a value.

    Parameters
    ----------
    name : of the shape.
    value : that it has.
    given : its range by now, kept where it is no frequency.

    Returns
    -------
    Lower and upper bound.
    """
    if name not in _FREQUENCIES:
        return given
    return round(max(value - _REACH, _LOWEST), 2), round(value + _REACH, 2)


def library(robot: Robot, joint: str, slowest: float = _SLOWEST) -> tuple[LibraryTerm, ...]:
    """Return every term that may be missing at a joint.

    Parameters
    ----------
    robot, joint : of this one, and of others beside it.
    slowest : rad/s or m/s within which no term may fade.
    """
    others = [name for name in robot.names if name != joint]
    own, load = _of_joint(None, slowest), tuple(_load())
    terms = [LibraryTerm((one,)) for one in (*own, *load)]
    terms += _products(own, own)
    terms += [LibraryTerm((one, other)) for one, other in product(own, load)]
    terms += [LibraryTerm((one,)) for one in _session()]
    terms += [LibraryTerm((one, other)) for one, other in product(own, _session()) if _plain(one)]
    for name in others:
        far = _of_joint(name, slowest)
        terms += [LibraryTerm((one,)) for one in far]
        terms += [
            LibraryTerm((one, other)) for one, other in product(own, far) if _coupled(one, other)
        ]
        terms += chain.from_iterable(map(_term, product(_waves(own), _waves(far))))
        terms += _products(far, far)
        terms += [LibraryTerm((one, other)) for one, other in product(far, load) if _plain(one)]
    terms += [LibraryTerm(pair) for pair in combinations(map(_speed, others), 2)]
    return tuple(terms)


def extended(seeds: Sequence[LibraryTerm], factors: Sequence[Factor]) -> tuple[LibraryTerm, ...]:
    """Return products of two factors with a third, each once.

    Parameters
    ----------
    seeds : some terms; those of two factors are extended.
    factors : by which they are multiplied, where no factor is of the same sort of the same joint.
    """
    found = []
    for seed, factor in product(seeds, factors):
        places = {(one.sort, one.joint) for one in seed.factors}
        if len(seed.factors) != 2 or (factor.sort, factor.joint) in places:
            continue
        if factor.sort != "session":
            found += _term((*seed.factors, factor))
    return tuple(dict.fromkeys(found))


def pairs_within(terms: Sequence[LibraryTerm]) -> tuple[LibraryTerm, ...]:
    """Return products of all but one factor of some terms, each once.

    Parameters
    ----------
    terms : of three factors.
    """
    pairs = (pair for one in terms for pair in combinations(one.factors, 2))
    return tuple(dict.fromkeys(chain.from_iterable(map(_term, pairs))))


def _term(factors: tuple[Factor, ...]) -> list[LibraryTerm]:
    """The product of some factors, in one order, with names of their own for their shapes.

    None of more than two waves, or of more than one factor that fades.
    """
    names, found = list(_FREQUENCIES), []
    for one in sorted(factors, key=lambda one: (one.joint or "", _ORDER.index(one.sort))):
        shape = one.shape
        if shape is not None and shape[0] in _FREQUENCIES:
            if not names:
                return []
            shape = (names.pop(0), *shape[1:])
        found.append(replace(one, shape=shape))
    shapes = [one.shape[0] for one in found if one.shape]
    return [LibraryTerm(tuple(found))] if len(set(shapes)) == len(shapes) else []


def _products(some: tuple[Factor, ...], others: tuple[Factor, ...]) -> list[LibraryTerm]:
    """Position times motion, of one joint."""
    pairs = product(some, others)
    return [LibraryTerm((b, a)) for a, b in pairs if (a.sort, b.sort) == ("position", "motion")]


def _waves(some: tuple[Factor, ...]) -> list[Factor]:
    return [one for one in some if len(one.texts) > 1]


def _coupled(own: Factor, far: Factor) -> bool:
    """Whether a product of two joints' factors is one that mechanisms have."""
    if own.sort != far.sort:
        return True
    return _plain(own) and _plain(far)


def _plain(one: Factor) -> bool:
    return one.texts in (("{q}",), ("{v}",), ("sign({v})",), ("abs({v})",), ("{v}^2",))


def _of_joint(joint: str | None, slowest: float) -> tuple[Factor, ...]:
    return (*_position(joint), *_motion(joint, slowest))


def _position(joint: str | None) -> Iterator[Factor]:
    yield Factor("position", ("{q}",), joint)
    yield Factor("position", ("{q}^2",), joint)
    for k in HARMONICS:
        shape = ("k", k, *centred("k", k, (0.0, 0.0)))
        yield Factor("position", ("sin({shape}*{q})", "cos({shape}*{q})"), joint, shape)


def _motion(joint: str | None, slowest: float) -> Iterator[Factor]:
    for text in ("{v}", "sign({v})", "abs({v})", "{v}*abs({v})", "{v}^2", "{v}^3", "{a}"):
        yield Factor("motion", (text,), joint)
    yield Factor("motion", ("abs({a})",), joint)
    lower = float(f"{slowest:.2g}")
    for speed in (one for one in _DECAY if one > lower):
        shape = ("w", speed, lower, _FASTEST)
        yield Factor("motion", ("sign({v})*exp(-abs({v})/{shape})",), joint, shape)


def _speed(joint: str) -> Factor:
    """Two of them are a product that Coriolis torques are made of; of others there are too many."""
    return Factor("motion", ("{v}",), joint)


def _load() -> Iterator[Factor]:
    for text in ("{load}", "abs({load})", "{load}*abs({load})", "{load}^2", "{load}^3"):
        yield Factor("load", (text,))


def _session() -> Iterator[Factor]:
    yield Factor("session", ("t",))
