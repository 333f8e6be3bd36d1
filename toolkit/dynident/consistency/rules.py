"""The rules that one body must keep, each with its margin."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from dynident.consistency.spread import IMPOSSIBLE_SPREAD, axis_name, relative_spread, worst_spread
from dynident.inertia import LARGEST, PARAMETERS, Margins, margins, pseudo_inertia, to_com
from dynident.robot.hull import Hull

Array = NDArray[np.float64]

TITLES = {
    "finite": "finite numbers",
    "mass": "mass",
    "inertia": "inertia about the centre of mass",
    "triangle": "triangle inequality",
    "pseudo_inertia": "pseudo-inertia",
    "centre_of_mass": "centre of mass inside the geometry",
    "spread": "spread of mass within the geometry",
}
"""The rules by name, in the order in which one builds on another."""

# Shapes and centres of mass are written with some digits: relative to the extent.
_DRAWN = 1e-6
_SMALLEST = float(np.finfo(float).tiny)


@dataclass(frozen=True, kw_only=True)
class RuleMargin:
    """How far a body is inside (positive) or outside (negative) of one rule.

    Attributes
    ----------
    rule : str
        A key of `TITLES`.
    value : float
        The margin in SI units; NaN where a number it needs is not finite.
    unit : str
    relative : float
        The margin relative to the size of the body: a mass to the robot's typical mass, a length
        to the extent l, a moment to m l^2.
    broken : bool
        Rounding forgiven.
    words : str
        Why it is broken, or to be looked at, and by how much; empty where the rule holds.
    """

    rule: str
    value: float
    unit: str
    relative: float
    broken: bool
    words: str = ""

    @property
    def doubtful(self) -> bool:
        """Whether it is exceeded by no more than simplified shapes explain: a hint, not broken."""
        return bool(self.words) and not self.broken


@dataclass(frozen=True, eq=False, kw_only=True)
class Body:
    """A link, or the links that move as one, as the rules see it.

    Attributes
    ----------
    name : str
    phi : (10,) ndarray
        In the frame of the link (of the joint, for a moving body).
    length : float
        Extent, m, positive.
    length_from : str
        "geometry", "joints", "robot" (its typical extent) or "inertia".
    typical_mass : float
        Of the robot's links, kg, positive.
    hull : Hull or None
        Of its geometry.
    whole : bool
        Whether all of its geometry was read.
    broken_numbers : tuple of str
        What the description states that is not finite.
    weightless : bool
        Whether it is a moving body without any mass that carries none either.
    onward : (3,) ndarray or None
        From a link's origin to the farthest joint that it carries, m, in the link's frame.
    """

    name: str
    phi: Array
    length: float
    length_from: str
    typical_mass: float
    hull: Hull | None = None
    whole: bool = True
    broken_numbers: tuple[str, ...] = ()
    weightless: bool = False
    onward: Array | None = None

    @property
    def readable(self) -> bool:
        """Whether its numbers are finite and of a size that can be computed with."""
        return bool(np.all(np.abs(self.phi) < LARGEST))

    @property
    def moment(self) -> float:
        """The moment of inertia to which others are compared, kg m^2: m l^2."""
        mass = abs(float(self.phi[0]))
        found = (mass if mass > 0.0 else self.typical_mass) * self.length**2
        return max(found, _SMALLEST)  # what underflows is no scale


@dataclass(frozen=True)
class Verdicts:
    """The margins of all rules for one body, and the rules that could not be judged.

    Attributes
    ----------
    rules : tuple of RuleMargin
    not_checked : tuple of str
    """

    rules: tuple[RuleMargin, ...]
    not_checked: tuple[str, ...] = field(default=())


def judge(body: Body) -> Verdicts:
    """Return the margin of every rule for a body."""
    if not body.readable:
        return Verdicts((_finite(body),))
    rules, not_checked = [_finite(body), *_consistency(body)], ()
    if body.hull is not None and body.phi[0] > 0.0:
        inside = _inside(body, body.hull)
        if inside.broken and not body.whole:
            not_checked = ("centre of mass: it is outside of the shapes that were read",)
        else:
            rules.append(inside)
            if inside.value > 0.0 and body.whole and not any(one.broken for one in rules):
                rules.append(_spread(body, body.hull))
    return Verdicts(tuple(rules), not_checked)


def _finite(body: Body) -> RuleMargin:
    if body.readable:
        return RuleMargin(rule="finite", value=1.0, unit="", relative=1.0, broken=False)
    names = body.broken_numbers or tuple(
        f"{name} = {value:g}"
        for name, value in zip(PARAMETERS, body.phi, strict=True)
        if not abs(value) < LARGEST
    )
    nan = float("nan")
    return RuleMargin(
        rule="finite",
        value=nan,
        unit="",
        relative=nan,
        broken=True,
        words=f"not a usable number: {', '.join(names)}",
    )


def _consistency(body: Body) -> list[RuleMargin]:
    """The rules of mass and moments alone; mass and inertia relative to typical mass and m l^2."""
    phi, found = body.phi, margins(body.phi)
    unit = "kg m^2"
    mass = _mass(body, found)
    # The verdict on one rule is that of the whole where the other rules hold.
    held = float("inf")
    turning = not replace(found, mass=held).semi_consistent
    triangle = not replace(found, mass=held, inertia_com_min_eig=held).consistent
    words = _negative_moment(phi, found)
    moments = _principal(phi)
    excess = moments[2] - moments[0] - moments[1]
    digits = 4 if excess > 1e-3 * abs(moments[2]) else 8  # so that the excess can be seen
    largest = " + ".join(f"{one:.{digits}g}" for one in moments[:2])
    largest = f"{moments[2]:.{digits}g} > {largest} kg m^2"
    scaling = np.diag([1.0 / body.length] * 3 + [1.0])
    scaled = scaling @ pseudo_inertia(phi) @ scaling / (body.moment / body.length**2)
    return [
        mass,
        _rule("inertia", found.inertia_com_min_eig, unit, body.moment, turning, words),
        _rule(
            "triangle",
            found.triangle,
            unit,
            body.moment,
            triangle,
            f"a principal moment exceeds the sum of the others: {largest}",
        ),
        RuleMargin(
            rule="pseudo_inertia",
            value=found.pseudo_inertia_min_eig,
            unit="kg, kg m, kg m^2",
            relative=float(_eigenvalues(scaled)[0]),
            broken=(found.mass < 0.0 and mass.broken) or turning or triangle,
            words="no distribution of mass has these parameters" if turning or triangle else "",
        ),
    ]


def _mass(body: Body, found: Margins) -> RuleMargin:
    mass = found.mass
    negative = not replace(found, inertia_com_min_eig=float("inf")).semi_consistent
    if negative:
        words = f"the mass is negative: {mass:.4g} kg"
    elif mass <= 0.0 and np.any(body.phi[1:4]):
        words = "a first moment of mass, but no mass"
    elif mass <= 0.0 and np.any(body.phi[4:]):
        words = "an inertia, but no mass"
    elif body.weightless:
        words = (
            "it has no mass and moves nothing that has: no simulation can accelerate it "
            "(the mass matrix is singular)"
        )
    else:
        words = ""
    return _rule("mass", mass, "kg", body.typical_mass, bool(words), words)


def _principal(phi: Array) -> Array:
    return _eigenvalues(to_com(phi).inertia_com)


def _eigenvalues(matrix: Array) -> Array:
    """Eigenvalues of a symmetric matrix, ascending; NaN where it is not finite."""
    if not np.all(np.isfinite(matrix)):
        return np.full(len(matrix), np.nan)
    return np.asarray(np.linalg.eigvalsh(matrix), dtype=float)


def _negative_moment(phi: Array, found: Margins) -> str:
    least = found.inertia_com_min_eig
    if least != least:
        return "there is a first moment of mass but no mass, so there is no centre of mass"
    diagonal = np.diag(to_com(phi).inertia_com)
    named = [f"i{a}{a} = {x:.4g}" for a, x in zip("xyz", diagonal, strict=True) if x < 0.0]
    which = f" ({', '.join(named)})" if named else ""
    return f"a principal moment is negative: {least:.4g} kg m^2{which}"


def _inside(body: Body, hull: Hull) -> RuleMargin:
    com = to_com(body.phi).com
    depth = hull.depth(com)
    broken = depth < -_DRAWN * hull.extent
    words = f"the centre of mass is {-depth:.3g} m outside of the link's geometry"
    return _rule("centre_of_mass", depth, "m", body.length, broken, words)


def _spread(body: Body, hull: Hull) -> RuleMargin:
    """Judge the spread of mass in every direction.

    Mass between lo and hi along a direction, with its centre at c, has a second moment of at most
    m (hi - c) (c - lo) about c (Bhatia and Davis, "A better bound on the variance", 2000).
    """
    excess, direction = worst_spread(body.phi, hull)
    exceeded = -excess < -_DRAWN * body.moment
    words = (
        f"mass is spread more along {axis_name(direction)} than the geometry allows, by "
        f"{excess:.3g} kg m^2"
    )
    return RuleMargin(
        rule="spread",
        value=-excess,
        unit="kg m^2",
        relative=-excess / body.moment,
        broken=exceeded and relative_spread(body.phi, hull) > IMPOSSIBLE_SPREAD,
        words=words if exceeded else "",
    )


def _rule(name: str, value: float, unit: str, scale: float, broken: bool, words: str) -> RuleMargin:
    return RuleMargin(
        rule=name,
        value=value,
        unit=unit,
        relative=value / scale,
        broken=broken,
        words=words if broken else "",
    )
