"""A small change that makes a broken body possible."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dynident.consistency.rules import Array, Body, judge
from dynident.consistency.spread import second_moment, spread_of, worst_spread
from dynident.errors import DynidentError
from dynident.inertia import frame_change, from_com, to_com
from dynident.robot.formats.tree_assembly import quiet
from dynident.robot.hull import Hull

NAMES = ("mass", "com x", "com y", "com z", "ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_UNITS = ("kg", *("m",) * 3, *("kg m^2",) * 6)
# What is smaller than this relative to the size of the body is no change.
_NEGLIGIBLE = 1e-5
_ROUNDS = 300


@dataclass(frozen=True)
class Change:
    """One number of the description's form, as it is and as it could be.

    Attributes
    ----------
    name : str
        One of `NAMES`; moments are about the centre of mass in the link's axes.
    before, after : float
    unit : str
    """

    name: str
    before: float
    after: float
    unit: str

    def __str__(self) -> str:
        digits = 4 if self.shows else 8
        return f"{self.name} {self.before:.{digits}g} -> {self.after:.{digits}g} {self.unit}"

    @property
    def shows(self) -> bool:
        """Whether it can be seen in four digits."""
        return f"{self.before:.4g}" != f"{self.after:.4g}"


def remedy(body: Body) -> tuple[Change, ...]:
    """Return a small change after which a body keeps every rule; none if there is none.

    Mass and moments move to the nearest consistent ones (`nlp.nearest_body`; `refit` weighs
    otherwise, by what is known of the whole robot). A centre of mass outside of the geometry moves
    as little as the spread of mass around it allows; a spread too large for the geometry shrinks
    along the directions in which it is (for one direction the smallest change in the log-det
    divergence of second moments).
    """
    if not body.readable or body.weightless:
        return ()
    try:
        with quiet():
            phi = _consistent(body)
    except (DynidentError, np.linalg.LinAlgError):
        return ()  # numbers beyond what can be solved for: nothing near them is possible
    if body.hull is not None and phi[0] > 0.0:
        remedied = replace(body, phi=phi)
        broken = {one.rule for one in judge(remedied).rules if one.broken}
        if broken & {"centre_of_mass", "spread"}:
            phi = _within(remedied, body.hull, "centre_of_mass" in broken)
    if any(one.broken for one in judge(replace(body, phi=phi)).rules):
        return ()
    return _changes(body, phi)


def _consistent(body: Body) -> Array:
    from dynident.nlp.nearest import nearest_body

    # About the centre of mass, where there is one: what a negative mass does to moments about
    # another point is no fault of theirs.
    com = to_com(body.phi).com
    if not np.all(np.abs(com) <= 1e3 * body.length):
        com = np.zeros(3)
    phi = frame_change(np.eye(3), -com) @ body.phi
    phi = np.asarray(nearest_body(phi, body.length, mass=body.typical_mass), dtype=float)
    # What can turn has mass: at least so much that its extent explains its inertia.
    inertia = to_com(phi).inertia_com
    needed = 4.0 * float(np.linalg.eigvalsh(spread_of(inertia))[-1]) / body.length**2
    if body.phi[0] <= 0.0 and not phi[0] >= min(needed, 1e-3 * body.typical_mass):
        phi = from_com(needed, np.zeros(3), inertia)
    return frame_change(np.eye(3), com) @ phi


def _within(body: Body, hull: Hull, move: bool) -> Array:
    properties = to_com(body.phi)
    com = properties.com
    if move:
        middle = hull.points.mean(axis=0)

        def moved(share: float) -> Array:
            """The nearest point of the hull shrunk towards its middle."""
            return middle + share * (hull.nearest(middle + (com - middle) / share) - middle)

        # On the surface itself nothing may be spread across it.
        least, most = 1e-3, 1.0 - 1e-9
        for _ in range(30):
            share = 0.5 * (least + most)
            phi = from_com(properties.mass, moved(share), properties.inertia_com)
            least, most = (share, most) if worst_spread(phi, hull)[0] <= 0.0 else (least, share)
        com = moved(least)
    spread = second_moment(body.phi)
    phi = from_com(properties.mass, com, properties.inertia_com)
    for _ in range(_ROUNDS):
        excess, n = worst_spread(phi, hull)
        if excess <= 1e-9 * body.moment:
            break
        across = spread @ n
        along = float(n @ across)
        if not along**2 > 0.0:
            break
        spread = spread - np.outer(across, across) * (excess / along**2)
        inertia = np.trace(spread) * np.eye(3) - spread
        phi = from_com(properties.mass, com, inertia)
    return phi


def _numbers(phi: Array) -> Array:
    properties = to_com(phi)
    return np.array([properties.mass, *properties.com, *properties.inertia_com[np.triu_indices(3)]])


def _changes(body: Body, phi: Array) -> tuple[Change, ...]:
    before, after = _numbers(body.phi), _numbers(phi)
    sizes = np.maximum(_sizes(before, body.length), _sizes(after, body.length))
    moved = np.abs(after - before) / np.maximum(sizes, np.finfo(float).tiny)
    # Of a body that is hardly broken all changes are small, and the largest are told.
    changed = ~(moved <= min(_NEGLIGIBLE, 0.1 * np.max(moved, initial=0.0)))
    # What the solver leaves of a zero is zero.
    after = np.where(np.abs(after) <= _NEGLIGIBLE * _sizes(after, body.length), 0.0, after)
    return tuple(
        Change(name, float(old), float(new), unit)
        for name, old, new, unit, told in zip(NAMES, before, after, _UNITS, changed, strict=True)
        if told
    )


def _sizes(numbers: Array, length: float) -> Array:
    """What is large for each of a body's numbers."""
    return np.array([abs(numbers[0]), *(length,) * 3, *(np.max(np.abs(numbers[4:])),) * 6])
