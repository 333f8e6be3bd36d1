"""Which way gravity pulls, as the torques tell it: how the base is mounted.

Gravity is no column: under another one other parameters are identifiable, and what a body weighs
goes with its inertia. The regression is repeated with gravity from directions all around, and from
the best of them the direction is refined. Joints whose axes are parallel, or a single one, feel the
part across them alone, which a spring or a counterweight makes smaller, too: there gravity is
only turned about these axes, or taken off.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.optimize import minimize

from dynident.criteria import WiringCriteria
from dynident.effects.bodies.turn import turn_about
from dynident.model import Model
from dynident.robot import Robot
from dynident.robot.tree import GRAVITY, Joint
from dynident.wiring.assignment import Assignment
from dynident.wiring.fault import Fault
from dynident.wiring.fault_words import residuals
from dynident.wiring.hypothesis_search import mends
from dynident.wiring.regressions.any_gravity import AnyGravity
from dynident.wiring.regressions.wiring_regression import TorqueFit
from dynident.wiring.regressions.wiring_rows import WiringRows

_AXES = tuple(sign * axis for axis in np.eye(3) for sign in (1.0, -1.0))
_AROUND = tuple(
    np.array(d) / np.linalg.norm(d) for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)
)
_TURNS = tuple(np.deg2rad(range(0, 360, 15)))  # about parallel axes
_REACH = 0.2  # rad, of the first steps of a refinement
_MOST_FITS = 60  # of a refinement: 0.01 rad and better
_PARALLEL = 0.02  # rad between axes that count as one
_FALLS, _RISES = 0.5, 2.0
"""Times a joint's squared residual that another gravity must leave somewhere, and nowhere: springs
that balance more than the weight make it leave half at best, or more at other joints."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Mounting:
    """Another gravity, which suits the torques far better.

    Attributes
    ----------
    model : under it.
    stated : (3,) m/s^2, what it stands in place of.
    before, after : the fits.
    """

    model: Model
    stated: np.ndarray
    before: TorqueFit
    after: TorqueFit

    @property
    def gravity(self) -> np.ndarray:
        """(3,) m/s^2, in the axes of the description."""
        return self.model.robot.gravity

    @property
    def shown(self) -> str:
        """Gravity as a study file has it."""
        return _shown(self.gravity)

    def suits(self, fit: TorqueFit) -> bool:
        """Whether a fit under it leaves far less than before at a joint, and far more at none."""
        ratio = fit.unexplained / np.maximum(self.before.unexplained, np.finfo(float).tiny)
        return bool(ratio.min() < _FALLS and ratio.max() < _RISES)

    @property
    def turn(self) -> float:
        """Angle between the two, rad; infinite where one of them is none."""
        if not (self.stated.any() and self.gravity.any()):
            return np.inf
        return _angle(self.stated, self.gravity)

    @property
    def fault(self) -> Fault:
        """The mounting in words, with the line of the study that mends it."""
        said = residuals(self.before, self.after)
        if not self.gravity.any():
            what = (
                f"the torques hold no gravity, where the study says {_shown(self.stated)}: it was "
                "taken off before they were recorded, is balanced, or pulls along the axes"
            )
            where = "If so, write in the study, above its tables"
        else:
            an_axis = np.count_nonzero(self.gravity) == 1
            what = (
                f"gravity is {'' if an_axis else 'about '}{self.shown} in the axes of the "
                f"description, not {_shown(self.stated)}"
            )
            where = "Write in the study, above its tables, how the base is mounted"
            if not an_axis:
                where += "; until that is measured, with what the torques say"
            if turn := self._turn_of_the_first_joint():
                (joint,) = (one.name for one in self.model.robot.joints if one.parent < 0)
                said += f" (a zero of q.{joint} that is off by {turn} deg is alike)"
        return Fault(
            kind="gravity",
            joints=(),
            what=what,
            evidence=said,
            mend=(f"gravity = {self.shown}",),
            where=where,
        )

    def _turn_of_the_first_joint(self) -> int:
        """Degrees by which a zero of the first joint would do the same; 0 if none does."""
        roots = [one for one in self.model.robot.joints if one.parent < 0]
        if len(roots) > 1 or roots[0].kind != "revolute":
            return 0
        (joint,) = roots
        axis, old, new = joint.R @ joint.axis, self.stated, self.gravity
        if not old.any() or abs(axis @ (new - old)) > _PARALLEL * np.linalg.norm(old):
            return 0
        return abs(round(float(np.degrees(np.arctan2(axis @ np.cross(old, new), old @ new)))))


def mounting(
    model: Model, rows: WiringRows, now: Assignment, criteria: WiringCriteria
) -> Mounting | None:
    """Look for a gravity that suits the torques far better than the stated one.

    Parameters
    ----------
    model : of which the robot, its gravity and the width of friction count.
    rows, now : the rows, and what belongs to which joint.
    criteria : by how much it must win, and from which turn on a study has it wrong.

    Returns
    -------
    None where no other gravity wins by far. Where several suit alike, one that is turned by less
    than that (a tilted base), or none, or an axis of the description, the nearest to the stated.
    """
    stated = model.robot.gravity
    size = float(np.linalg.norm(stated)) or float(np.linalg.norm(GRAVITY))
    under = AnyGravity.of(model, rows.moved(now.change))

    def fit(gravity: np.ndarray) -> TorqueFit:
        return under.regression(gravity).fit(now.torque_of, now.torque_scale)

    reference = stated if stated.any() else np.array(GRAVITY)
    start = fit(stated)
    axis = _common_axis(model.robot)
    directions = _AROUND if axis is None else _about(axis, reference)
    scores = [fit(size * one).score for one in directions]
    if max(*scores, fit(np.zeros(3)).score) <= start.score:
        return None
    best = directions[int(np.argmax(scores))]
    near = [reference / size] if stated.any() else []
    refined = [_refined(one, axis, lambda x: fit(size * x).score) for one in (*near, best)]
    axes = [one for one in _AXES if any(np.allclose(one, each) for each in directions)]

    def turn(one: np.ndarray) -> float:
        return _angle(one, reference)

    tilted = [one for one in refined if near and turn(one) < criteria.least_turn]
    nearest = [x for some in (axes, refined) for x in sorted(some, key=turn)]
    turned = [one for one in nearest if not near or turn(one) >= criteria.least_turn]
    tried = [np.round(size * one, 3) for one in (*tilted, np.zeros(3), *turned)]
    fits = [fit(one) for one in tried]
    alike = max(one.score for one in fits) - criteria.evidence / rows.independent
    gravity, after = next(x for x in zip(tried, fits, strict=True) if x[1].score >= alike)
    found = Mounting(
        model=replace(model, robot=model.robot.with_gravity(gravity)),
        stated=stated,
        before=start,
        after=after,
    )
    return found if mends(after, start, rows, criteria) else None


def _common_axis(robot: Robot) -> np.ndarray | None:
    """The axis (3,) about which all revolute joints turn, in the world; None where they differ."""

    def frame(joint: Joint) -> np.ndarray:
        return joint.R if joint.parent < 0 else frame(robot.joints[joint.parent]) @ joint.R

    axes = [frame(one) @ one.axis for one in robot.joints if one.kind == "revolute"]
    if axes and all(np.linalg.norm(np.cross(axes[0], one)) < _PARALLEL for one in axes):
        return axes[0]
    return None


def _about(axis: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, ...]:
    """Directions (3,) of a gravity that is turned about an axis."""
    down = reference / np.linalg.norm(reference)
    return tuple(turn_about(axis, turn) @ down for turn in _TURNS)


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    """Angle between two directions, rad."""
    cosine = one @ other / (np.linalg.norm(one) * np.linalg.norm(other))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _refined(
    direction: np.ndarray, axis: np.ndarray | None, score: Callable[[np.ndarray], float]
) -> np.ndarray:
    """The direction of the highest score, from one that is near it; how near is judged by it.

    Parameters
    ----------
    direction : (3,) where it begins.
    axis : (3,) about which it turns; None for any.
    score : of a direction.
    """
    across = np.linalg.svd(direction[None])[2][1:]

    def at(turn: np.ndarray) -> np.ndarray:
        if axis is not None:
            return turn_about(axis, float(turn[0])) @ direction
        one = direction + turn @ across
        return one / np.linalg.norm(one)

    many = len(across) if axis is None else 1
    simplex = np.vstack([np.zeros(many), _REACH * np.eye(many)])
    options = {"initial_simplex": simplex, "maxfev": _MOST_FITS, "xatol": 1e-3, "fatol": 1e-3}
    found = minimize(lambda x: -score(at(x)), np.zeros(many), method="Nelder-Mead", options=options)
    return at(found.x)


def _shown(gravity: np.ndarray) -> str:
    return f"[{', '.join(f'{x:.4g}' for x in gravity + 0.0)}]"
