"""Loads on the last link of which some parameters are known: a mass from a scale, a drawing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dynident.errors import StudyError
from dynident.inertia import from_com
from dynident.robot import Robot

SYMMETRIC = ("Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
"""The order in which a load's inertia is stated."""
ROUNDED = 0.01
"""Of the largest moment, by which stated ones may break a rule: data sheets have two digits."""
_MASS, _MOMENTS, _INERTIAS = ("m",), ("mx", "my", "mz"), ("Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")


@dataclass(frozen=True, kw_only=True)
class Load:
    """A rigid body that some recordings carry; what is None is unknown.

    Attributes
    ----------
    name : by which recordings name it.
    mass : kg.
    centre : (x, y, z) of its centre of mass, m, in the frame of `link`.
    inertia : (Ixx, Ixy, Ixz, Iyy, Iyz, Izz) about its centre of mass, kg m^2, in the axes of
        `link`.
    link : a link that the last joint moves; empty for the one that it drives, whose frame in a
        URDF is the last joint's.

    Raises
    ------
    StudyError
        If its inertia is stated about a centre that is not, or no rigid body can have it.
    """

    name: str
    mass: float | None = None
    centre: tuple[float, float, float] | None = None
    inertia: tuple[float, ...] | None = None
    link: str = ""

    def __post_init__(self) -> None:
        where = f"load '{self.name}'"
        if self.inertia is not None and self.centre is None:
            what = "its inertia is stated about a centre of mass that is not stated"
            raise StudyError(what, where, "state its centre, or leave the inertia out")
        if self.inertia is not None and len(self.inertia) != len(SYMMETRIC):
            what = f"its inertia has {len(self.inertia)} values"
            raise StudyError(what, where, f"give six: {', '.join(SYMMETRIC)}")
        if self.inertia is not None:
            _require_possible(symmetric(self.inertia), where)

    @property
    def is_known(self) -> bool:
        """Whether nothing of it is left to identify."""
        return None not in (self.mass, self.centre, self.inertia)


def _require_possible(inertia: np.ndarray, where: str) -> None:
    """Refuse moments about the centre of mass (3, 3) that break the triangle inequality."""
    if not np.isfinite(inertia).all():
        raise StudyError("its inertia is not finite", where, "give six numbers in kg m^2")
    least, middle, largest = np.linalg.eigvalsh(inertia)
    slack = ROUNDED * max(largest, -least)
    if least < -slack or least + middle < largest - slack:
        moments = ", ".join(f"{one:.4g}" for one in (least, middle, largest))
        what = f"no rigid body has its principal moments, {moments} kg m^2"
        remedy = f"is it about the centre of mass, and in the order {', '.join(SYMMETRIC)}?"
        raise StudyError(what, where, remedy)


@dataclass(frozen=True, eq=False)
class LoadSplit:
    """Ten parameters phi = given + unknown @ x of a load, in the frame of its link.

    Attributes
    ----------
    names : of x, (k,).
    given : (10,).
    unknown : (10, k).
    """

    names: tuple[str, ...]
    given: np.ndarray
    unknown: np.ndarray


def split(load: Load) -> LoadSplit:
    """Return what is known of a load and what is not: linear, since a known centre is fixed."""
    inertia = symmetric(load.inertia) if load.inertia is not None else np.zeros((3, 3))
    unit, zero = np.eye(10), np.zeros((3, 3))
    if load.centre is None:
        given = (load.mass or 0.0) * unit[0]
        columns, names = unit[1:], (*_MOMENTS, *_INERTIAS)
        if load.mass is None:
            columns, names = unit, (*_MASS, *names)
        return LoadSplit(names, given, columns.T)
    of_mass = from_com(1.0, load.centre, zero)
    given = from_com(0.0, np.zeros(3), inertia) + (load.mass or 0.0) * of_mass
    parts, names = [], ()
    if load.mass is None:
        parts, names = [of_mass], _MASS
    if load.inertia is None:
        parts, names = [*parts, *unit[4:]], (*names, *_INERTIAS)
    return LoadSplit(names, given, np.reshape(parts, (-1, 10)).T)


def symmetric(six: Any) -> np.ndarray:
    """Return the (3, 3) matrix of (Ixx, Ixy, Ixz, Iyy, Iyz, Izz)."""
    xx, xy, xz, yy, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=float)


def placement(load: Load, robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return the placement R (3, 3), p (3,) in m of a load's link in the last joint's frame.

    Parameters
    ----------
    load : its link is looked up.
    robot : whose last joint carries it.

    Raises
    ------
    StudyError
        If the robot's last joint moves no such link.
    """
    moved = {link.name: link for link in robot.links if link.joint == robot.tip}
    link = moved.get(load.link)
    if load.link and link is None:
        what = f"the last joint, '{robot.names[robot.tip]}', moves no link '{load.link}'"
        raise StudyError(what, f"load '{load.name}'", f"links: {', '.join(moved)}")
    link = link or robot.links[robot.driven[robot.tip]]
    return np.array(link.R), np.array(link.p)
