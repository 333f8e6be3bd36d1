"""A robot description as Drake's and Pinocchio's own parsers understand it.

They are shown the copy that our reader makes (joints and links, without shapes and plugins, whose
files may be missing), with the inertial elements of the description put back as they are written.
Only descriptions whose inertias have been checked belong here: neither parser tells the truth
about a broken one.
"""

from __future__ import annotations

from copy import deepcopy
from typing import Any
from xml.etree import ElementTree

import numpy as np

from dynident.errors import RobotError
from dynident.inertia import from_drake
from dynident.robot.contents import Contents, to_text
from dynident.robot.kinematics import WORLD, quiet
from dynident.robot.reading import take_apart
from dynident.robot.robot import Robot
from dynident.robot.tree import Array
from dynident.robot.xmltree import Element

_SAME = 1e-9  # of a link's largest parameter: what a parser's own arithmetic may change
_TORQUE = 1e-8  # likewise, of the torque
_SAMPLES = 20
_DURATION = 0.1  # s of passive motion
_LIMITS = {"lower": "-1e9", "upper": "1e9", "velocity": "1e9", "effort": "1e9"}


def simulate_in_drake(robot: Robot, text: str, where: str) -> float:
    """Let Drake's parser read a description, and simulate a short passive motion.

    Parameters
    ----------
    robot : as our reader understands the text; its joints and gravity.
    text : the description.
    where : names it in messages.

    Returns
    -------
    Seconds that were simulated.

    Raises
    ------
    RobotError
        If Drake refuses the description, takes another inertia than the one that is written, or
        cannot simulate it.
    """
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    _, format_, contents = take_apart(text, where)
    for link in robot.links if format_ == "mjcf" else ():
        if link.source == "inertial element" and link.phi[0] == 0.0:
            what, remedy = "states a mass of zero, which Drake and MuJoCo refuse", "give it a mass"
            raise RobotError(what, f"{where}: link '{link.name}'", remedy)
    plant: Any = MultibodyPlant(0.0)
    try:
        with quiet():
            Parser(plant).AddModelsFromString(_copy(contents, format_), contents.suffix)
    except (Exception, SystemExit) as error:  # the bindings raise whatever Drake throws
        raise RobotError(f"Drake refuses it: {_first(error)}", where) from None
    for link in robot.links:
        if link.joint < 0 and (link.source == "absent" or link.name == WORLD):
            continue  # it stands still, whatever the parser makes of it
        inertia = plant.GetBodyByName(link.name).default_spatial_inertia()
        _require_same(link.phi, from_drake(inertia), link.source, f"{where}: link '{link.name}'")
    return passive_motion(plant, robot, where)


def passive_motion(plant: Any, robot: Robot, where: str) -> float:
    """Finalize a Drake plant that holds a robot and let it fall for a moment; see above."""
    from pydrake.multibody.tree import BodyIndex
    from pydrake.systems.analysis import Simulator

    bodies = [plant.get_body(BodyIndex(i)) for i in range(plant.num_bodies())]
    joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
    attached = {joint.child_body().index() for joint in joints}
    for body in bodies:
        if body.index() != plant.world_body().index() and body.index() not in attached:
            pose = plant.GetDefaultFloatingBaseBodyPose(body)
            plant.WeldFrames(plant.world_frame(), body.body_frame(), pose)
    plant.mutable_gravity_field().set_gravity_vector(np.array(robot.gravity))
    q = robot.random_motion(0, 1)[0][0]
    try:
        with quiet():
            plant.Finalize()
            simulator = Simulator(plant)
            context = simulator.get_mutable_context()
            positions = plant.GetPositions(context)
            for name, value in zip(robot.names, q, strict=True):
                positions[plant.GetJointByName(name).position_start()] = value
            plant.SetPositions(context, positions)
            simulator.AdvanceTo(_DURATION)
    except RuntimeError as error:
        raise RobotError(f"Drake cannot simulate it: {_first(error)}", where) from None
    state = plant.GetPositionsAndVelocities(context)
    if not np.all(np.isfinite(state)):
        raise RobotError("its motion in Drake is not finite", where)
    return _DURATION


def require_pinocchio(robot: Robot, text: str, where: str) -> bool:
    """Let Pinocchio compute the dynamics of a description; a URDF is read by its own parser.

    Returns
    -------
    Whether its own parser read the description.

    Raises
    ------
    RobotError
        If Pinocchio refuses the description, its inverse dynamics differs from ours, or the
        forward dynamics is not finite.
    """
    import pinocchio

    pin: Any = pinocchio
    _, format_, contents = take_apart(text, where)
    model = robot.pinocchio()
    if format_ == "urdf":
        try:
            model = pin.buildModelFromXML(_for_urdfdom(_copy(contents, format_)))
        except Exception as error:  # as above
            raise RobotError(f"Pinocchio refuses it: {_first(error)}", where) from None
        model.gravity.linear = np.array(robot.gravity)
    data = model.createData()
    motion = robot.random_motion(0, _SAMPLES)
    torque = robot.inverse_dynamics(*motion)
    places = [model.joints[model.getJointId(name)] for name in robot.names]
    found = np.zeros_like(torque)
    for k, (q, v, a) in enumerate(zip(*motion, strict=True)):
        at, speed, acceleration = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
        for j, place in enumerate(places):
            # Pinocchio keeps the cosine and the sine of joints without limits.
            at[place.idx_q : place.idx_q + place.nq] = (
                [q[j]] if place.nq == 1 else [np.cos(q[j]), np.sin(q[j])]
            )
            speed[place.idx_v], acceleration[place.idx_v] = v[j], a[j]
        all_torques = pin.rnea(model, data, at, speed, acceleration)
        found[k] = [all_torques[place.idx_v] for place in places]
        if not np.all(np.isfinite(pin.aba(model, data, at, speed, np.zeros(model.nv)))):
            what = "the forward dynamics is not finite: its mass matrix is singular"
            raise RobotError(what, where, "give the last link of each chain a mass")
    if not np.max(np.abs(found - torque)) <= _TORQUE * np.max(np.abs(torque)):
        raise RobotError("Pinocchio's inverse dynamics of it is another", where)
    return format_ == "urdf"


def _copy(contents: Contents, format_: str) -> str:
    """The harmless copy of a description with the inertial elements that it states."""
    root = ElementTree.fromstring(contents.copy)
    for element in root.iter("body" if format_ == "mjcf" else "link"):
        for harmless in element.findall("inertial"):
            element.remove(harmless)
        name = element.get("name") or ""
        stated = contents.inertials.get(name)
        if stated is not None and stated.source == "inertial element":
            own = contents.elements[name].find("inertial")
            assert own is not None
            element.insert(0, deepcopy(own))
    return to_text(root)


def _for_urdfdom(copy: str) -> str:
    """What this parser demands and others do not: all limits, and a link for the world."""
    root = ElementTree.fromstring(copy)
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if limit is None and joint.get("type") in ("revolute", "prismatic"):
            limit = ElementTree.SubElement(joint, "limit")
        if limit is not None:
            for key, value in _LIMITS.items():
                limit.attrib.setdefault(key, value)
    named = {link.get("name") for link in root.findall("link")}
    parents = {parent.get("link") for parent in root.iter("parent")}
    if "world" in parents - named:
        root.append(Element("link", {"name": "world"}))
    return to_text(root)


def _require_same(phi: Array, found: Array, source: str, where: str) -> None:
    if np.max(np.abs(found - phi)) <= _SAME * np.max(np.abs(phi), initial=0.0):
        return
    if source == "absent":
        what = f"states no inertia, for which Drake takes a default of {found[0]:g} kg"
        raise RobotError(what, where, "state its inertia")
    what = "Drake's parser replaces its inertia: it is too flat, or too light for its size"
    raise RobotError(what, where, "state more digits, or a thicker body")


def _first(error: BaseException) -> str:
    lines = str(error).strip().splitlines()
    return lines[0][:200].rstrip(". ") if lines else "no reason given"
