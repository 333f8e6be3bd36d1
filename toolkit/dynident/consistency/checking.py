"""The verb `check`: anything that has a robot in it is taken apart and judged."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dynident import files
from dynident.arguments import checked
from dynident.consistency.checked_bodies import CheckedBody, of_links
from dynident.consistency.findings import Check
from dynident.consistency.hints import hints
from dynident.consistency.joint_parameters import JointCheck, of_description, of_estimate
from dynident.consistency.link import LinkCheck
from dynident.consistency.remedy import remedy
from dynident.consistency.rules import TITLES, judge
from dynident.errors import RobotError, UnsupportedError
from dynident.robot import Description, Link, Robot
from dynident.robot.formats.reading import joint_dynamics, lone_links

if TYPE_CHECKING:
    from dynident.fitting import Estimate


@checked
def check(what: Robot | Estimate | str | Path | Any) -> Check:
    """Check whether a robot can exist: the margin of every rule, link by link.

    For each link of the description, and for each moving body of several links: finite numbers,
    positive mass, inertia about the centre of mass, triangle inequality, pseudo-inertia, and
    where the description has geometry, centre of mass and spread of mass within its convex hull
    (a spread no more than ten times too large is a hint: shapes are often simplified).
    For each joint: friction, damping and rotor inertia not negative.

    Parameters
    ----------
    what : Robot, Estimate, path, or anything with a robot in its attribute `robot`
        A path names a robot description (URDF, SDF, MJCF) or a saved estimate.

    Returns
    -------
    Check
        Report first: nothing is raised for a broken robot before `Check.require`.

    Raises
    ------
    DynidentError
        If a file cannot be read, or is neither a robot description nor an estimate.
    """
    # Numbers of any size are looked at: what overflows is judged as not finite.
    with np.errstate(all="ignore"):
        if isinstance(what, str | Path):
            return _file(Path(what))
        if isinstance(what, Robot):
            return _robot(what, what.name, what.description.format if what.description else "robot")
        return _holder(what)


def _holder(what: Any) -> Check:
    """Check an estimate, or what has a robot and perhaps an estimate among its attributes."""
    # Imported where it is used: the estimators are slow to load, and a description needs none.
    from dynident.fitting import Estimate

    if isinstance(what, Estimate):
        return _estimate(what, what.model.robot.name)
    robot = getattr(what, "robot", None)
    if not isinstance(robot, Robot):
        raise RobotError(
            f"a {type(what).__name__} has no robot to check",
            remedy="give a Robot, an Estimate, or the path of a robot description or estimate",
        )
    estimate = getattr(what, "estimate", None)
    if isinstance(estimate, Estimate):
        return _check(robot.links, robot.description, robot, robot.name, "estimate", estimate)
    return _robot(robot, robot.name, "robot")


def _file(path: Path) -> Check:
    text = files.read_text(path)
    start = text.lstrip()[:1]
    if start == "{":
        from dynident.fitting import load_estimate

        return _estimate(load_estimate(path), str(path))
    if start != "<":
        raise RobotError(
            "is empty" if not start else "is neither a robot description nor a saved estimate",
            str(path),
            "give a URDF, SDF or MJCF file, or an estimate that `dynident fit --out` wrote; "
            "a study is shown by `dynident show` and fitted by `dynident fit`",
        )
    try:
        robot = Robot.from_text(text, str(path))
    except UnsupportedError as error:
        description, links = lone_links(text, str(path))
        place = (error.where or "").removeprefix(str(path)).lstrip(": ") or "the description"
        note = (
            "Links were checked one by one, without the tree of joints that carries them: "
            f"{place} {error.what}."
        )
        name, source = description.path, description.format
        return _check(links, description, None, name, source, None, (note,))
    return _robot(robot, str(path), robot.description.format if robot.description else "robot")


def _robot(robot: Robot, name: str, source: str) -> Check:
    return _check(robot.links, robot.description, robot, name, source)


def _estimate(estimate: Estimate, name: str) -> Check:
    robot = estimate.robot
    notes = ()
    if estimate.links is None:  # else the fit chose the links itself
        notes = (
            "What the data cannot tell (how a combination is shared among its parameters) was "
            "taken as near to the description as it can be: another share may be consistent.",
        )
    return _check(robot.links, robot.description, robot, name, "estimate", estimate, notes)


def _check(
    links: tuple[Link, ...],
    description: Description | None,
    robot: Robot | None,
    name: str,
    source: str,
    estimate: Estimate | None = None,
    notes: tuple[str, ...] = (),
) -> Check:
    subjects, scale = of_links(links, description, robot, _rotors(estimate))
    found = tuple(sorted((_link(one) for one in subjects), key=_order))
    joints: tuple[JointCheck, ...] = ()
    if description is not None:
        joints = of_description(joint_dynamics(description), scale)
    if estimate is not None:
        joints += of_estimate(estimate, scale)
    mute = [link.name for link in links if link.source == "absent"]
    if mute and len(mute) == len(links):
        notes = ("The description states no inertia of any link.", *notes)
    not_read = [
        f"{one.name}: {'; '.join(one.not_checked)}"
        for one in found
        if one.kind == "link" and one.not_checked
    ]
    if not_read:
        notes = (*notes, "Geometry not checked: " + ". ".join(not_read) + ".")
    return Check(
        name=name,
        source=source,
        links=tuple(one for one in found if one.kind == "link"),
        bodies=tuple(one for one in found if one.kind != "link"),
        joints=tuple(
            sorted(joints, key=lambda one: _worst(one.relative) if one.broken else np.inf)
        ),
        notes=notes,
    )


def _rotors(estimate: Estimate | None) -> frozenset[str]:
    """Joints that an estimate gives a rotor inertia."""
    if estimate is None:
        return frozenset()
    effects = [one for one in estimate.model.effects if one.name == "rotor_inertia"]
    return frozenset(
        str(one.joint) for one in effects if np.any(estimate.effect_values(one.label) > 0.0)
    )


def _link(subject: CheckedBody) -> LinkCheck:
    body = subject.body
    verdicts = judge(body)
    order = list(TITLES)
    rules = sorted(
        verdicts.rules,
        key=lambda one: (
            not one.broken,
            one.rule != "finite",
            _worst(one.relative),
            order.index(one.rule),
        ),
    )
    # Finite numbers are no margin to speak of once they are finite.
    rules.sort(key=lambda one: one.rule == "finite" and not one.broken)
    broken = any(one.broken for one in rules)
    suspicions = list(hints(body, verdicts))
    if body.phi[0] == 0.0 and not broken and subject.source == "inertial element":
        suspicions.append("its mass is stated as zero")
    return LinkCheck(
        name=body.name,
        kind=subject.kind,
        body=subject.carrier,
        parts=subject.links,
        length=body.length,
        length_from=body.length_from,
        rules=tuple(rules),
        not_checked=(*subject.not_checked, *verdicts.not_checked),
        hints=tuple(suspicions),
        remedy=remedy(body) if broken else (),
    )


def _order(one: LinkCheck) -> tuple[bool, bool, float]:
    finite = not any(rule.rule == "finite" and rule.broken for rule in one.rules)
    return not one.broken, finite, _worst(one.worst.relative)


def _worst(relative: float) -> float:
    """A margin to sort by: what is not a number is worst."""
    return relative if relative == relative else -np.inf
