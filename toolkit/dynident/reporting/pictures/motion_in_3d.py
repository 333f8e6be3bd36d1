"""A motion in 3D as one page, to look at before anything moves: Drake's Meshcat, made static."""

from __future__ import annotations

import gc
import html
from dataclasses import dataclass
from typing import Any

import numpy as np

from dynident.closed_loop import Trajectory
from dynident.errors import DesignError, DynidentError
from dynident.experiment_design import RecordingDesign
from dynident.experiment_design.geometry.robot_shapes import RobotShapes
from dynident.experiment_design.geometry.surroundings import Obstacle
from dynident.reporting.pictures.solids import solid
from dynident.robot import Robot
from dynident.robot.formats.tree_assembly import quiet
from dynident.robot.poses import poses

_RATE, _MOST_FRAMES = 30, 3000  # frames per s, and of a page
_THINNEST = 0.05  # of an ellipsoid's longest semi-axis, or the eye loses it
_GREY, _BONE = (0.45, 0.6, 0.85, 0.75), (0.2, 0.2, 0.2, 1.0)
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src data: blob:; font-src data:; worker-src blob:"
)
_CAPTION = (
    '<div style="position:absolute;left:0;bottom:0;max-width:60em;padding:.5em 1em;z-index:9;'
    'font:15px sans-serif;background:rgba(255,255,255,.85);color:#222">{}</div>'
)


@dataclass(frozen=True)
class MotionPage:
    """A page with a motion.

    Attributes
    ----------
    html : the page; it fetches nothing.
    shows : what the links are drawn as, in words.
    """

    html: str
    shows: str


def design_page(design: RecordingDesign) -> MotionPage:
    """Return a page with the motion of a designed recording; see `motion_page`."""
    task, least = design.task, design.least_distance
    clear = (
        "Collisions were not looked at."
        if least is None
        else f"By their collision geometry the links stay {1000 * least:.0f} mm or more apart."
    )
    caption = (
        f"Designed motion: {task.duration:g} s from rest to rest, to be followed {task.repeat} "
        f"times, shown in an endless loop. {clear}"
    )
    return motion_page(design.model.robot, design.trajectory, caption, design.limits.obstacles)


def motion_page(
    robot: Robot, motion: Trajectory, caption: str, obstacles: tuple[Obstacle, ...] = ()
) -> MotionPage:
    """Return a page on which a robot repeats a period of a motion.

    Links have the shapes of the description, those to be seen or else those that collide; where it
    states none that can be read, each is the ellipsoid of uniform density that has its inertia.

    Parameters
    ----------
    robot : with its description.
    motion : a period, rad or m.
    caption : what it is, plain text.
    obstacles : that are drawn, in red.

    Returns
    -------
    The page, and what the links are drawn as.

    Raises
    ------
    DesignError
        If Drake's viewer cannot be started.
    """
    try:
        with quiet():
            text, shows = _recorded(robot, motion, obstacles)
    except (RuntimeError, OSError) as error:
        raise DesignError(f"Drake's viewer does not start: {str(error).splitlines()[0]}") from None
    return MotionPage(_framed(text, robot.name, f"{caption} Links are drawn as {shows}."), shows)


def _recorded(robot: Robot, motion: Trajectory, obstacles: tuple[Obstacle, ...]) -> tuple[str, str]:
    """Return the viewer's page with a period of a motion, and what the links are drawn as."""
    from pydrake.geometry import Meshcat, MeshcatAnimation, MeshcatParams, Rgba
    from pydrake.math import RigidTransform

    period = float(motion.period)
    rate = max(min(_RATE, int(_MOST_FRAMES / period)), 1)
    t = np.arange(max(round(rate * period), 1) + 1) / rate
    q = motion.at(t)[0]
    viewer: Any = Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    try:
        viewer.StartRecording(float(rate))
        try:
            shows = _with_shapes(viewer, robot, t, q)
        except DynidentError:
            viewer.Delete()
            shows = ""
        shows = shows or _with_ellipsoids(viewer, robot, t, q)
        viewer.StopRecording()
        for k, one in enumerate(obstacles):
            centre: Any = one.centre
            viewer.SetObject(f"obstacles/{k + 1}", one.shape(), Rgba(0.8, 0.2, 0.1, 0.5))
            viewer.SetTransform(f"obstacles/{k + 1}", RigidTransform(centre))
        recording = viewer.get_mutable_recording()
        recording.set_loop_mode(MeshcatAnimation.LoopMode.kLoopRepeat)
        viewer.PublishRecording()
        _look_at(viewer, robot, q)
        return viewer.StaticHtml(), shows
    finally:
        # The viewer aborts the process if it ends in another thread than it began in. Diagrams that
        # hold it are in reference cycles, which any thread may collect: here they go before it.
        recording = None
        gc.collect()
        viewer = None


def _with_shapes(viewer: Any, robot: Robot, t: np.ndarray, q: np.ndarray) -> str:
    """Record the robot in the shapes of its description; return which, empty where it has none."""
    from pydrake.geometry import MeshcatVisualizer, MeshcatVisualizerParams, Role

    shapes = RobotShapes.of(robot)
    inspector = shapes.scene.model_inspector()
    roles = {Role.kIllustration: "visual", Role.kProximity: "collision"}
    role = next((one for one in roles if inspector.NumGeometriesWithRole(one)), None)
    if role is None:
        return ""
    params = MeshcatVisualizerParams(role=role, prefix="robot")
    MeshcatVisualizer.AddToBuilder(shapes.builder, shapes.scene, viewer, params)
    diagram = shapes.builder.Build()
    whole = diagram.CreateDefaultContext()
    own = shapes.plant.GetMyMutableContextFromRoot(whole)
    others = shapes.plant.GetPositions(own)
    for at, one in zip(t, q, strict=True):
        whole.SetTime(float(at))
        shapes.plant.SetPositions(own, shapes.positions(one, others))
        diagram.ForcedPublish(whole)
    return f"the {roles[role]} geometry of the description"


def _with_ellipsoids(viewer: Any, robot: Robot, t: np.ndarray, q: np.ndarray) -> str:
    """Record the robot as lines from joint to joint, and the ellipsoids of its inertias."""
    from pydrake.geometry import Ellipsoid, Rgba
    from pydrake.math import RigidTransform, RotationMatrix

    # Names of links may be anything: numbers are as good as paths.
    paths = [f"robot/{k + 1}" for k in range(robot.n)]
    grey, bone = Rgba(*_GREY), Rgba(*_BONE)
    for k, (body, phi) in enumerate(zip(robot.bodies, robot.theta.reshape(-1, 10), strict=True)):
        one = solid(body, phi)
        if one.drawable and one.semi_axes.max() > 0:
            axes = np.maximum(one.semi_axes, _THINNEST * one.semi_axes.max())
            turn = one.axes * np.sign(np.linalg.det(one.axes))
            viewer.SetObject(f"{paths[k]}/inertia", Ellipsoid(*axes), grey)
            turned = RotationMatrix.ProjectToRotationMatrix(turn)
            centre: Any = one.centre  # the stubs of Drake take no array
            viewer.SetTransform(f"{paths[k]}/inertia", RigidTransform(turned, centre))
        parent = robot.joints[k].parent
        place = "robot" if parent == -1 else paths[parent]
        ends = np.stack([np.zeros(3), robot.joints[k].p], axis=1)
        viewer.SetLine(f"{place}/to {k + 1}", ends, 4.0, bone)
    for at, posture in zip(t, q, strict=True):
        for path, R, p in zip(paths, *poses(robot, posture), strict=True):
            pose = RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), p)
            viewer.SetTransform(path, pose, float(at))
    return "ellipsoids that have their inertias: the description states no shapes that can be read"


def _look_at(viewer: Any, robot: Robot, q: np.ndarray) -> None:
    """Have everything in view that the joints pass."""
    some = q[:: max(len(q) // 50, 1)]
    points = np.concatenate([np.zeros((1, 3)), poses(robot, some)[1].reshape(-1, 3)])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    reach = max(float(np.linalg.norm(np.ptp(points, axis=0))), 0.3)
    viewer.SetCameraPose(middle + reach * np.array([0.9, -0.9, 0.5]), middle)


def _framed(text: str, title: str, caption: str) -> str:
    """The page with a title, a caption, and a policy by which it may fetch nothing."""
    policy = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
    for mark, new in (
        ("<head>", f"<head>\n{policy}"),
        ("<title>Drake MeshCat</title>", f"<title>{html.escape(title)}</title>"),
        ("<body>", f"<body>\n{_CAPTION.format(html.escape(caption))}"),
    ):
        text = text.replace(mark, new, 1)
    return text
