"""Strokes of the inertia pictures: one body, the skeleton, the names beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse, Polygon
from scipy.optimize import linear_sum_assignment

from dynident.reporting.content import GREY
from dynident.reporting.pictures.plots import plain
from dynident.reporting.pictures.solids import Solid
from dynident.robot import Robot
from dynident.robot.poses import poses

IMPOSSIBLE_COLOUR = "#d1102e"
_BONE = "#404040"


@dataclass(frozen=True, eq=False)
class View:
    """An orthographic view: `across` (2, 3) spans the paper, `towards` (3,) leaves it."""

    across: np.ndarray
    towards: np.ndarray

    @staticmethod
    def of(azimuth: float, elevation: float) -> View:
        a, e = np.radians([azimuth, elevation])
        towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return View(np.stack([right, np.cross(towards, right)]), towards)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        return np.asarray(points) @ self.across.T


@dataclass(frozen=True, eq=False)
class Sketch:
    """A drawing of one robot: `axes` of matplotlib, and the view on it."""

    axes: Axes
    eye: View

    def body(self, one: Solid, colour: str) -> None:
        """The ellipsoid with its principal sections; of an impossible body what there is."""
        axes, eye = self.axes, self.eye
        if not one.drawable:
            self.cross(one)
            return
        self.outline(one, colour, "-")
        for line in _meridians(one, eye):
            axes.plot(*line.T, color=colour, linewidth=0.7, alpha=0.7, zorder=4)
        self.spikes(one)
        axes.plot(*eye(one.centre), marker="o", ms=3, color=colour, zorder=5)

    def cross(self, one: Solid) -> None:
        """Mark an impossible body that has no centre of mass, at its joint."""
        axes, eye = self.axes, self.eye
        if one.fault:
            style = {"mfc": IMPOSSIBLE_COLOUR, "mec": "white", "zorder": 6}
            axes.plot(*eye(one.joint), marker="X", ms=13, **style)

    def outline(self, one: Solid, colour: str, line: str) -> None:
        """The shadow of the ellipsoid, filled faintly; hatched if the body is impossible.

        Parameters
        ----------
        one : a drawable body.
        colour, line : of the edge, as matplotlib names them.
        """
        axes, eye = self.axes, self.eye
        shadow = shadow_of(one, eye)
        axes.add_patch(Ellipse(**shadow, facecolor=colour, alpha=0.18, zorder=3))
        if one.fault:
            hatch = {"facecolor": "none", "edgecolor": colour, "linewidth": 0.0, "alpha": 0.35}
            axes.add_patch(Ellipse(**shadow, **hatch, hatch="////", zorder=3))
        edge = {"facecolor": "none", "edgecolor": colour, "linestyle": line, "linewidth": 1.7}
        axes.add_patch(Ellipse(**shadow, **edge, zorder=4))

    def spikes(self, one: Solid) -> None:
        """Dotted lines along the axes whose square is negative, as long as they are imaginary."""
        axes, eye = self.axes, self.eye
        for k in np.flatnonzero(one.imaginary):
            ends = one.centre + np.outer([-1.0, 1.0], one.imaginary[k] * one.axes[:, k])
            axes.plot(*eye(ends).T, color=IMPOSSIBLE_COLOUR, linestyle=":", linewidth=1.8, zorder=5)

    def skeleton(self, robot: Robot, q: np.ndarray) -> None:
        """Bones from joint to joint, a short bar along each axis, and the ground."""
        axes, eye = self.axes, self.eye
        R, p = poses(robot, q)
        reach = max(float(np.linalg.norm(np.ptp(p, axis=0))), 0.1)
        for k, joint in enumerate(robot.joints):
            start = p[joint.parent] if joint.parent != -1 else np.array([p[k][0], p[k][1], 0.0])
            axes.plot(*eye(np.stack([start, p[k]])).T, color=_BONE, linewidth=2.2, zorder=2)
            ends = p[k] + np.outer([-1, 1], 0.03 * reach * (R[k] @ joint.axis))
            axes.plot(*eye(ends).T, color=_BONE, linewidth=6, solid_capstyle="butt", zorder=2)
            if joint.parent == -1:
                plate = 0.07 * reach * np.array([[-1, 0], [1, 0], [1, -0.25], [-1, -0.25]])
                corners = eye(start) + plate
                axes.add_patch(Polygon(corners, facecolor="#b0b0b0", edgecolor="none", zorder=1))

    def labels(self, found: tuple[Solid, ...], x: float, step: float) -> None:
        """Names in a column, at least a step apart, each with a line to its body.

        Parameters
        ----------
        found : the bodies.
        x, step : place of the column and least distance, m on the paper.
        """
        axes, eye = self.axes, self.eye
        at = np.array([eye(one.centre if one.drawable else one.joint) for one in found])
        low, high = axes.get_ylim()
        steps = step * np.arange(len(found))
        heights = np.sort(np.clip(at[:, 1], low + step / 2, high - step / 2)) - steps
        # The nearest heights that are a step apart: those less their steps must not decrease.
        rising = np.maximum.accumulate(heights)
        falling = np.minimum.accumulate(heights[::-1])[::-1]
        places = (
            np.clip((rising + falling) / 2, low + step / 2, high - step / 2 - steps[-1]) + steps
        )
        # The shortest lines in total cross nowhere.
        lengths = np.hypot(x - at[:, :1], places - at[:, 1:])
        for k, place in zip(*linear_sum_assignment(lengths), strict=True):
            one = found[k]
            text = one.body if one.drawable or not one.fault else f"{one.body}: {one.fault}"
            axes.annotate(
                plain(text),
                (float(at[k, 0]), float(at[k, 1])),
                (x, float(places[place])),
                va="center",
                color=IMPOSSIBLE_COLOUR if one.fault else "black",
                zorder=7,
                arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.6, "shrinkB": 0},
            )


def shadow_of(one: Solid, eye: View) -> dict:
    """The shadow of the ellipsoid on the paper, an ellipse, as matplotlib's `Ellipse` wants it."""
    spread = eye(one.axes.T) * one.semi_axes[:, None]
    squares, directions = np.linalg.eigh(spread.T @ spread)
    width, height = 2.0 * np.sqrt(np.clip(squares[::-1], 0.0, None))
    angle = np.degrees(np.arctan2(directions[1, 1], directions[0, 1]))
    return {"xy": tuple(eye(one.centre)), "width": width, "height": height, "angle": angle}


def _meridians(one: Solid, eye: View) -> list[np.ndarray]:
    """The halves towards the eye of the three principal sections."""
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    found = []
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        if one.semi_axes[i] == 0.0 or one.semi_axes[j] == 0.0:
            continue
        # The outward normal is (cos / a_i, sin / a_j); half of the section faces the eye.
        facing = eye.towards @ one.axes
        a, b = one.semi_axes[i], one.semi_axes[j]
        shown = b * np.cos(turn) * facing[i] + a * np.sin(turn) * facing[j] >= 0.0
        points = np.outer(np.cos(turn), a * one.axes[:, i])
        points += np.outer(np.sin(turn), b * one.axes[:, j])
        found.append(np.where(shown[:, None], eye(one.centre + points), np.nan))
    return found


def tips(one: Solid) -> np.ndarray:
    """Ends of the real and of the imaginary semi-axes."""
    reach = (one.semi_axes + one.imaginary) * one.axes
    return np.vstack([one.centre + reach.T, one.centre - reach.T])
