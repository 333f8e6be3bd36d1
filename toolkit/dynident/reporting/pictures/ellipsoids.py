"""Matplotlib pictures of inertias: the ellipsoids of uniform density that links amount to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import ArrayLike

from dynident.errors import DynidentError
from dynident.reporting.content import AFTER_COLOUR, BEFORE_COLOUR, GREY
from dynident.reporting.pictures.plots import Picture, plain
from dynident.reporting.pictures.solids import Solid, solid, solids
from dynident.reporting.pictures.strokes import (
    IMPOSSIBLE_COLOUR,
    Sketch,
    View,
    tips,
)
from dynident.robot import Robot
from dynident.robot.poses import poses

_LINES = ("-", "-", "--", "-.")
_COLOURS = (BEFORE_COLOUR, AFTER_COLOUR, "#2e8b57", GREY)


def inertia_ellipsoids(
    robots: Mapping[str, Robot],
    q: ArrayLike | None = None,
    view: tuple[float, float] = (-62.0, 14.0),
) -> Figure:
    """Robots side by side, each moving body as the uniform ellipsoid that has its inertia.

    The ellipsoid has the mass, centre of mass and principal second moments of the body. Bodies that
    no mass distribution can have are red: where a mean square extent is negative the ellipsoid is
    flattened to a disc (or a line), and a dotted spike of the length sqrt(5 |mean square|) stands
    on it; bodies without a positive mass are marked by a cross at their joint.

    Parameters
    ----------
    robots : by name; with the same bodies.
    q : (n,) posture, rad or m; default zero, or the middle of the limits where zero is outside.
    view : azimuth and elevation of the eye, degrees.

    Returns
    -------
    Figure with a panel for each robot.

    Raises
    ------
    DynidentError
        If there is no robot, the robots have different bodies, or q has another length.
    """
    first = _same_bodies(robots)
    posture = _posture(first, q)
    eye = View.of(*view)
    every = {name: solids(robot, posture) for name, robot in robots.items()}
    low, high = _extent(first, posture, [s for f in every.values() for s in f], eye)
    # Room for the labels, which stand in a column at the right.
    wide, tall = high - low
    room = 0.3 * wide
    width = min(9.5, 0.5 + 4.5 * len(robots))
    height = float(np.clip(width / len(robots) * tall / (wide + room), 3.0, 7.0)) + 0.8
    figure = Picture(figsize=(width, height), layout="constrained")
    grid = figure.subplots(1, len(robots), squeeze=False).ravel()
    for axes, (name, robot), found in zip(grid, robots.items(), every.values(), strict=True):
        axes.set_xlim(low[0], high[0] + room)
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal")
        axes.set_axis_off()
        broken = sum(bool(one.fault) for one in found)
        count = f"{broken} of {len(found)} bodies impossible" if broken else "all bodies possible"
        axes.set_title(f"{plain(name)}: {count}", fontsize="large")
        sketch = Sketch(axes, eye)
        sketch.skeleton(robot, posture)
        for one in sorted(found, key=lambda s: float(np.nan_to_num(s.centre) @ eye.towards)):
            sketch.body(one, IMPOSSIBLE_COLOUR if one.fault else AFTER_COLOUR)
        sketch.labels(found, high[0] + 0.1 * wide, min(0.07 * tall, tall / len(found)))
    blue: dict[str, Any] = {"facecolor": "#d3e5f3", "edgecolor": AFTER_COLOUR}
    _legend(figure, [Patch(**blue, label="possible body")], [s for f in every.values() for s in f])
    return figure


def inertia_sections(robots: Mapping[str, Robot], plane: str = "xz") -> Figure:
    """A panel for each moving body: the outlines of its ellipsoid in several robots.

    Each panel has its own scale. The outline is the ellipsoid's shadow on a coordinate plane of
    the body's joint frame, whose origin is the cross; see `inertia_ellipsoids` for what an
    impossible body is drawn as. The worst mean square extent is written above it.

    Parameters
    ----------
    robots : by name; with the same bodies.
    plane : two of "x", "y", "z": the horizontal and the vertical axis.

    Raises
    ------
    DynidentError
        If there is no robot, the robots have different bodies, or there is no such plane.
    """
    first = _same_bodies(robots)
    if len(plane) != 2 or not set(plane) <= set("xyz") or plane[0] == plane[1]:
        raise DynidentError(f"no plane '{plane}'", remedy='write two of x, y, z, as in "xz"')
    across = np.eye(3)[["xyz".index(axis) for axis in plane]]
    eye = View(across, np.cross(*across))
    every = {
        name: [solid(*one) for one in zip(r.bodies, r.theta.reshape(-1, 10), strict=True)]
        for name, r in robots.items()
    }
    columns = min(first.n, 4)
    rows = -(-first.n // columns)
    figure = Picture(figsize=(2.35 * columns, 0.5 + 2.6 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid[first.n :]:
        axes.set_visible(False)
    for axes, *shown in zip(grid[: first.n], *every.values(), strict=True):
        _panel(Sketch(axes, eye), shown)
        axes.set_xlabel(f"{plane[0]} (m)")
        axes.set_ylabel(f"{plane[1]} (m)")
    handles = []
    for k, (name, found) in enumerate(every.items()):
        colour = IMPOSSIBLE_COLOUR if all(one.fault for one in found) else _colour(k)
        handles.append(Line2D([], [], color=colour, linestyle=_line(k), label=plain(name)))
    _legend(figure, handles, [one for found in every.values() for one in found])
    return figure


def _panel(sketch: Sketch, shown: list[Solid]) -> None:
    """One body in several robots."""
    axes, eye = sketch.axes, sketch.eye
    points = [np.zeros((1, 2))]
    for k, one in enumerate(shown):
        if not one.drawable:
            sketch.cross(one)
            continue
        colour = IMPOSSIBLE_COLOUR if one.fault else _colour(k)
        sketch.outline(one, colour, _line(k))
        sketch.spikes(one)
        axes.plot(*eye(one.centre), marker="o", ms=3, color=colour, zorder=5)
        points.append(eye(tips(one)))
    low, high = np.min(np.vstack(points), axis=0), np.max(np.vstack(points), axis=0)
    middle, half = (low + high) / 2, max(0.56 * float(np.max(high - low)), 1e-3)
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_aspect("equal")
    axes.plot(0, 0, marker="+", ms=9, color="#404040", zorder=5)
    axes.spines[["top", "right"]].set_visible(False)
    axes.locator_params(nbins=4)
    fault = next((one.fault for one in shown if one.fault), "")
    # Two lines in any case, so that all panels of a row are of one size.
    axes.set_title(f"{plain(shown[0].body)}\n", fontsize="medium")
    axes.text(
        0.5,
        1.02,
        fault,
        transform=axes.transAxes,
        ha="center",
        fontsize="small",
        color=IMPOSSIBLE_COLOUR,
    )


def _legend(figure: Figure, handles: list, found: Sequence[Solid]) -> None:
    """Below everything; what impossible bodies are drawn as only if there are some."""
    if any(one.fault for one in found):
        red: dict[str, Any] = {
            "facecolor": "#f6d0d6",
            "edgecolor": IMPOSSIBLE_COLOUR,
            "hatch": "////",
        }
        handles = [*handles, Patch(**red, label="impossible body, what there is of it")]
    if any(np.any(one.imaginary) for one in found):
        spike = {"color": IMPOSSIBLE_COLOUR, "linestyle": ":", "linewidth": 1.8}
        handles = [*handles, Line2D([], [], **spike, label="imaginary semi-axis")]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)


def _colour(k: int) -> str:
    return _COLOURS[k % len(_COLOURS)]


def _line(k: int) -> Any:
    return _LINES[k % len(_LINES)]


def _extent(
    robot: Robot, q: np.ndarray, found: list[Solid], eye: View
) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the picture: skeleton and bodies, what is out of all proportion cut off."""
    _, p = poses(robot, q)
    bones = eye(np.vstack([p, np.zeros((1, 3))]))
    span = max(float(np.max(np.ptp(bones, axis=0))), 0.1)
    low, high = bones.min(axis=0), bones.max(axis=0)
    ends = [eye(tips(one)) for one in found if one.drawable]
    every = np.vstack([bones, *ends])
    low = np.maximum(every.min(axis=0), low - 0.7 * span) - 0.04 * span
    return low, np.minimum(every.max(axis=0), high + 0.7 * span) + 0.04 * span


def _same_bodies(robots: Mapping[str, Robot]) -> Robot:
    if not robots:
        raise DynidentError("no robot to draw", remedy='pass them by name: {"before": robot}')
    first = next(iter(robots.values()))
    for name, robot in robots.items():
        if robot.bodies != first.bodies:
            remedy = f"the first has {', '.join(first.bodies)}"
            raise DynidentError(f"'{name}' has other bodies", remedy=remedy)
    return first


def _posture(robot: Robot, q: ArrayLike | None) -> np.ndarray:
    if q is not None:
        posture = np.asarray(q, dtype=float)
        if posture.shape != (robot.n,) or not np.all(np.isfinite(posture)):
            what = f"q has shape {posture.shape}, or is not finite"
            raise DynidentError(what, remedy=f"give {robot.n} joint positions, in rad or m")
        return posture
    return np.array(
        [0.0 if j.lower <= 0.0 <= j.upper else (j.lower + j.upper) / 2 for j in robot.joints]
    )
