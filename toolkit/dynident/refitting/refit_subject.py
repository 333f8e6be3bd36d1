"""What is to be refitted: parameters that somebody gives, and the description that holds them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from dynident import files
from dynident.errors import FileError, RobotError, warn
from dynident.fitting import Estimate, load_estimate
from dynident.fitting.parameter_file import GivenParameters, read_parameters
from dynident.inertia import LARGEST, PARAMETERS
from dynident.model import Model
from dynident.robot import Robot

_DESCRIPTIONS = (".urdf", ".sdf", ".xml", ".mjcf", ".xacro")


@dataclass(frozen=True, eq=False, kw_only=True)
class RefitSubject:
    """Given parameters.

    Attributes
    ----------
    robot : the description that is written back, with the given inertial parameters.
    described : the description with its own parameters: the prior, if nothing else is.
    effects : values of effects' parameters that are given, by name ("Fv@elbow").
    estimate : where the parameters were estimated; its covariance says how well.
    source : the file of the description, if the parameters are the description's own.
    """

    robot: Robot
    described: Robot
    effects: dict[str, float] = field(default_factory=dict)
    estimate: Estimate | None = None
    source: Path | None = None

    def require_usable(self) -> None:
        """Refuse parameters that are no numbers, or beyond computing with: nothing is near to them.

        Raises
        ------
        RobotError
            Naming the first link and its parameters.
        """
        require_usable(self.robot)


def require_usable(robot: Robot) -> None:
    """Refuse a robot with parameters that are not finite, beyond `LARGEST`, or next to no mass.

    Raises
    ------
    RobotError
        Naming the first link and its parameters.
    """
    file = robot.description.path if robot.description else robot.name
    for link in robot.links:
        where, mass = f"{file}: link '{link.name}'", float(link.phi[0])
        broken = ", ".join(
            f"{name} = {value:g}"
            for name, value in zip(PARAMETERS, link.phi, strict=True)
            if not abs(value) < LARGEST
        )
        if broken:
            finite = np.all(np.isfinite(link.phi))
            what = "is beyond any robot" if finite else "is not finite"
            remedy = "state numbers first: nothing is near to what is not a number"
            raise RobotError(
                f"{what} ({broken})", where, "state it in SI units" if finite else remedy
            )
        if 0.0 < abs(mass) < 1.0 / LARGEST:
            remedy = "state 0 if it has no mass, and its mass in kg if it has"
            raise RobotError(f"has next to no mass (m = {mass:g})", where, remedy)


def read_subject(
    what: Robot | Estimate | GivenParameters | str | Path,
    model: Model | Robot | None = None,
    order: str | None = None,
) -> RefitSubject:
    """Find out what is to be refitted.

    Parameters
    ----------
    what : a robot, an estimate, parameters that `read_parameters` read; or a path: of a
        description (URDF, SDF, MJCF), of an estimate's JSON, or of a CSV of parameters.
    model : of whom the parameters in a CSV are; with effects, if some may be among them.
    order : of numbers without names in a CSV, see `read_parameters`.

    Returns
    -------
    The given parameters in their description.

    Raises
    ------
    FileError
        If the file cannot be read, or is a CSV and no robot is known.
    RobotError, FitError
        If it is not a supported description, or not an estimate.
    """
    if isinstance(what, Robot):
        return RefitSubject(robot=what, described=what)
    if isinstance(what, Estimate):
        return _estimated(what)
    if isinstance(what, GivenParameters):
        return _listed(what)
    # Numbers of any size are read: what cannot be computed with is refused by `require_usable`.
    with np.errstate(all="ignore"):
        subject = _read(Path(what), model, order)
    subject.require_usable()
    return subject


def _read(path: Path, model: Model | Robot | None, order: str | None) -> RefitSubject:
    text = files.read_text(path)
    start, suffix = text.lstrip()[:1], path.suffix.lower()
    if not start:
        remedy = "give a robot description, a saved estimate or a CSV of parameters"
        raise FileError("is empty", str(path), remedy)
    # What it is shows in its first character; a file that is damaged, by its name.
    if start not in "<{" and suffix in _DESCRIPTIONS:
        start = "<"
    if start not in "<{" and suffix == ".json":
        start = "{"
    if start in ("<", "{") and order is not None:
        remedy = f"leave out the order '{order}'"
        raise FileError("is no CSV file, and says its own order", str(path), remedy)
    if start == "<":
        robot = Robot.from_text(text, str(path))
        return RefitSubject(robot=robot, described=robot, source=path)
    if start == "{":
        return _estimated(load_estimate(path))
    if model is None:
        what_is_missing = "is taken for a CSV of parameters, which does not say of which robot"
        raise FileError(what_is_missing, str(path), "give the description (--robot) or a study")
    return _listed(read_parameters(path, model, order))


def aligned(robot: Robot, like: Robot, where: str) -> Robot:
    """Return a robot with the joints of another, in their order, and its gravity.

    Parameters
    ----------
    robot : to be aligned.
    like : with the joints that are wanted.
    where : file or argument, for messages.

    Raises
    ------
    RobotError
        If it has not these joints.
    """
    if robot.names == like.names:
        return robot.with_gravity(like.gravity)
    if robot.description is None:
        raise RobotError(
            "has other joints than the study", where, f"joints: {', '.join(like.names)}"
        )
    text, path = robot.description.text, robot.description.path
    other = Robot.from_text(text, path, like.names, like.gravity)
    return other.with_links({link.name: link.phi for link in robot.links})


def in_study(subject: RefitSubject, model: Model) -> RefitSubject:
    """Return the subject with the joints of a study's model.

    Effects that an estimate has, and the study has not (or of other shape), are left out.
    """
    robot = aligned(subject.robot, model.robot, subject.robot.name)
    effects = dict(subject.effects)
    estimate = subject.estimate
    if estimate is not None:
        same_width = np.array_equal(estimate.model.friction_widths, model.friction_widths)
        known = [one for one in estimate.model.effects if same_width and one in model.effects]
        names = [name for one in known for name in estimate.names[estimate.model.slices[one.label]]]
        effects = {name: estimate.value(name) for name in names}
        lost = [one.label for one in estimate.model.effects if one not in known]
        if lost:
            words = f"effects of the estimate that the study has otherwise: {', '.join(lost)}"
            warn(f"{words}; their values are not used")
    return replace(subject, robot=robot, effects=effects)


def _estimated(estimate: Estimate) -> RefitSubject:
    return RefitSubject(robot=estimate.robot, described=estimate.model.robot, estimate=estimate)


def _listed(given: GivenParameters) -> RefitSubject:
    return RefitSubject(robot=given.robot, described=given.described, effects=given.effects)
