"""Write a robot, and replace the old file only once the new one has proved itself.

The new file is read back: its links must be consistent, its inverse dynamics that of the robot,
and Drake and Pinocchio must load it and move it.
"""

from __future__ import annotations

from codecs import BOM_UTF8
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dynident import files
from dynident.errors import DynidentError, FileError, RobotError
from dynident.inertia import margins
from dynident.robot.drake import add_to_plant
from dynident.robot.formats.reading import FORMATS
from dynident.robot.other_parsers import passive_motion, require_pinocchio, simulate_in_drake
from dynident.robot.patching import patched
from dynident.robot.robot import Robot
from dynident.robot.tree import Link

_SAMPLES = 50
_TOLERANCE = 1e-10  # of the largest torque


@dataclass(frozen=True, kw_only=True)
class Verification:
    """What was found true of a robot description after it was read back.

    Attributes
    ----------
    path : str
        The file.
    links : int
        Number of links, all of which are consistent.
    semi_only : tuple of str
        Links that are no more than semi-consistent: they break the triangle inequality.
    difference : float
        Of the inverse dynamics from that of the robot, relative to the largest torque.
    simulated : float
        Seconds of passive motion in Drake.
    drake, pinocchio : "own parser" or "our tree"
        Whether that program's parser read joints and inertias from the file, or was given them.
    unchanged : bool
        Whether the file is the description that was given, to the byte.
    """

    path: str
    links: int
    semi_only: tuple[str, ...]
    difference: float
    simulated: float
    drake: Literal["own parser", "our tree"]
    pinocchio: Literal["own parser", "our tree"]
    unchanged: bool

    @property
    def notion(self) -> Literal["full", "semi"]:
        """The notion of consistency that every link satisfies."""
        return "semi" if self.semi_only else "full"

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was done and found, in words."""
        written = "unchanged, to the byte" if self.unchanged else "only inertial elements changed"
        own = "read joints and inertias from the file"
        ours = "got joints and inertias from us"
        drake = own if self.drake == "own parser" else ours
        pinocchio = own if self.pinocchio == "own parser" else ours
        consistent = f"All {self.links} links are fully consistent."
        if self.semi_only:
            consistent = (
                f"All {self.links} links are semi-consistent; no mass distribution has the "
                f"parameters of {', '.join(self.semi_only)} (triangle inequality), and Drake's "
                "parser would replace them."
            )
        return (
            f"Written: {self.path} ({written}).",
            f"{consistent} Read back, the inverse dynamics differs by {self.difference:.0e} of "
            "the largest torque.",
            f"Drake {drake}, and simulated {self.simulated:g} s of passive motion.",
            f"Pinocchio {pinocchio}: inverse dynamics as ours, forward dynamics finite.",
        )

    def to_dict(self) -> dict[str, Any]:
        """The verification as JSON holds it."""
        return {
            "notion": self.notion,
            "links": self.links,
            "semi_only": list(self.semi_only),
            "inverse_dynamics_difference": self.difference,
            "simulated_s": self.simulated,
            "drake": self.drake,
            "pinocchio": self.pinocchio,
            "unchanged": self.unchanged,
        }


def require_format(robot: Robot, path: str | Path) -> None:
    """Refuse a file that says another format than the robot's description has.

    Raises
    ------
    FileError
        If its name says so, or a file is there that is no description and would be lost.
    """
    if Path(path).is_file() and files.read_bytes(path).removeprefix(BOM_UTF8).lstrip()[:1] != b"<":
        raise FileError("is not a robot description", str(path), "write to another file")
    suffix, own = Path(path).suffix.lower(), robot.description and robot.description.format
    for other in FORMATS.values():
        if own is not None and suffix in other.files and other.name != own:
            remedy = "name the file accordingly: a description is patched, not converted"
            raise FileError(f"the description is of the format {own.upper()}", str(path), remedy)


def write_verified(
    robot: Robot,
    path: str | Path,
    consistency: Literal["full", "semi"] = "full",
    source: str | Path | None = None,
) -> Verification:
    """Write the description of a robot, verified before it replaces an old file.

    Parameters
    ----------
    robot : Robot
        Read from a description, and perhaps changed since; see `robot.patching.write`.
    path : str or Path
        In the same format as the description; may be the description's own file.
    consistency : "full" or "semi"
        What every link must satisfy: with "semi" the triangle inequality may be broken; then
        Drake's own parser, which does not take such links, is left out.
    source : str or Path, optional
        The file that the robot was read from, whose bytes are copied if nothing changed.

    Returns
    -------
    What was checked, with the largest difference of the torques.

    Raises
    ------
    RobotError
        If the file would not be the robot, would not be consistent, or does not load or move in
        Drake or Pinocchio. Nothing is written then.
    FileError
        If the file cannot be written.
    """
    require_format(robot, path)
    text = patched(robot)
    unchanged = robot.description is not None and text == robot.description.text
    data = files.read_bytes(source) if unchanged and source else text.encode("utf-8")
    found: list[Verification] = []

    def read_back(temporary: Path) -> None:
        found.append(_verify(files.read_text(temporary), robot, str(path), consistency, unchanged))

    files.write_bytes(path, data, read_back)
    return found[0]


def _verify(
    text: str, robot: Robot, where: str, consistency: Literal["full", "semi"], unchanged: bool
) -> Verification:
    try:
        reloaded = Robot.from_text(text, where, robot.names, robot.gravity)
        semi_only = _consistent(reloaded.links, consistency, where)
        difference = _difference(reloaded, robot)
        if not difference <= _TOLERANCE:
            raise RobotError(f"its inverse dynamics differs by {difference:.1e}", where)
        if semi_only:
            simulated = _simulate_our_tree(reloaded, where)
        else:
            simulated = simulate_in_drake(reloaded, text, where)
        by_parser = require_pinocchio(reloaded, text, where)
    except DynidentError as error:
        remedy = " ".join(
            filter(None, (error.remedy and f"{error.remedy}.", "Nothing was written"))
        )
        raise RobotError(f"the new description fails: {error.what}", error.where, remedy) from None
    return Verification(
        path=where,
        links=len(reloaded.links),
        semi_only=semi_only,
        difference=difference,
        simulated=simulated,
        drake="our tree" if semi_only else "own parser",
        pinocchio="own parser" if by_parser else "our tree",
        unchanged=unchanged,
    )


def _consistent(links: tuple[Link, ...], consistency: str, where: str) -> tuple[str, ...]:
    """Names of links that are semi-consistent only; others are refused."""
    semi_only = []
    for link in links:
        margin = margins(link.phi)
        if margin.consistent:
            continue
        if consistency == "full" or not margin.semi_consistent:
            rule, value = margin.worst
            what = f"is not consistent ({rule} {value:.3g})"
            raise RobotError(what, f"{where}: link '{link.name}'")
        semi_only.append(link.name)
    return tuple(semi_only)


def _difference(one: Robot, other: Robot) -> float:
    motion = one.random_motion(0, _SAMPLES)
    torque = other.inverse_dynamics(*motion)
    size = float(np.max(np.abs(torque)))
    difference = float(np.max(np.abs(one.inverse_dynamics(*motion) - torque)))
    return difference / size if size > 0 else difference


def _simulate_our_tree(robot: Robot, where: str) -> float:
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    add_to_plant(robot, plant)
    return passive_motion(plant, robot, where)
