"""A robot description as Drake's and Pinocchio's own parsers understand it.

They are shown the copy that our reader makes (joints and links, without shapes and plugins, whose
files may be missing), with the inertial elements of the description put back as they are written.
Only descriptions whose inertias have been checked belong here: both parsers replace broken ones.
"""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np

from dynident.errors import RobotError
from dynident.inertia import from_drake
from dynident.late_modules import LateModule
from dynident.robot.formats.reading import Opened, open_description
from dynident.robot.formats.tree_assembly import WORLD, drake_bodies, drake_plant, quiet
from dynident.robot.formats.xmltree import Element, to_text
from dynident.robot.robot import Robot
from dynident.robot.tree import Array

pin: Any = LateModule("pinocchio")  # as in `dynamics`
_SAME = 1e-9  # of a link's largest parameter: what a parser's own arithmetic may change
_TORQUE = 1e-8  # likewise, of the torque
_SAMPLES = 20
_DURATION = 0.1  # s of passive motion


def simulate_in_drake(robot: Robot, text: str, where: str) -> float:
    """Let Drake's parser read a description, and simulate a short passive motion.

    Parameters
    ----------
    robot : Robot
        As our reader understands the text; its joints and gravity.
    text : str
        The description.
    where : str
        Names it in messages.

    Returns
    -------
    float
        Seconds that were simulated.

    Raises
    ------
    RobotError
        If Drake refuses the description, takes another inertia than the one that is written, or
        cannot simulate it.
    """
    opened = open_description(text, where)
    for link in () if opened.format.takes_massless else robot.links:
        if link.source == "inertial element" and link.phi[0] == 0.0:
            what, remedy = "states a mass of zero, which Drake and MuJoCo refuse", "give it a mass"
            raise RobotError(what, f"{where}: link '{link.name}'", remedy)
    try:
        plant = drake_plant(_with_inertias(opened), opened.format.drake)
    except (Exception, SystemExit) as error:  # the bindings raise whatever Drake throws
        raise RobotError(f"Drake refuses it: {_first(error)}", where) from None
    for link in robot.links:
        if link.joint < 0 and (link.source == "absent" or link.name == WORLD):
            continue  # it stands still, whatever the parser makes of it
        inertia = plant.GetBodyByName(link.name).default_spatial_inertia()
        _require_same(link.phi, from_drake(inertia), link.source, f"{where}: link '{link.name}'")
    return passive_motion(plant, robot, where)


def passive_motion(plant: Any, robot: Robot, where: str) -> float:
    """Finalize a Drake plant that holds a robot and let it fall for a moment.

    Parameters
    ----------
    plant : pydrake.multibody.plant.MultibodyPlant
    robot : Robot
        Its gravity and limits.
    where : str
        The file, for messages.

    Returns
    -------
    float
        Seconds that were simulated.

    Raises
    ------
    RobotError
        If Drake cannot simulate it, or the motion is not finite.
    """
    from pydrake.systems.analysis import Simulator

    joints = [plant.get_joint(i) for i in plant.GetJointIndices()]
    attached = {joint.child_body().name() for joint in joints}
    for name, body in drake_bodies(plant).items():
        if name not in attached:
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

    Parameters
    ----------
    robot : Robot
        As our reader understands the text.
    text : str
        The description.
    where : str
        Names it in messages.

    Returns
    -------
    bool
        Whether its own parser read the description.

    Raises
    ------
    RobotError
        If Pinocchio refuses the description, its inverse dynamics differs from ours, or the
        forward dynamics is not finite.
    """
    opened = open_description(text, where)
    model, complete = robot.pinocchio(), opened.format.for_pinocchio
    if complete is not None:
        copy = _with_inertias(opened)
        complete(copy)
        try:
            model = pin.buildModelFromXML(to_text(copy))
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
    return complete is not None


def _with_inertias(opened: Opened) -> Element:
    """Return the sanitised copy of a description with the inertial elements that it states."""
    contents, root = opened.contents, deepcopy(opened.contents.copy)
    for element in root.iter(opened.format.link):
        for inertial in element.findall("inertial"):
            element.remove(inertial)
        name = element.get("name") or ""
        stated = contents.inertials.get(name)
        if stated is not None and stated.source == "inertial element":
            own = contents.elements[name].find("inertial")
            assert own is not None
            element.insert(0, deepcopy(own))
    return root


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
