"""Which way gravity pulls, as the torques tell it: how the base is mounted.

Gravity is no column: under another one other parameters are identifiable, and what a body weighs
goes with its inertia. The regression is repeated with gravity from directions all around, and from
the best of them the direction is refined.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.optimize import minimize

from dynident.criteria import WiringCriteria
from dynident.model import Model
from dynident.wiring.assignment import Assignment
from dynident.wiring.fault import Fault
from dynident.wiring.fault_words import residuals
from dynident.wiring.hypothesis_search import is_better_by_far
from dynident.wiring.wiring_regression import TorqueFit, WiringRegression
from dynident.wiring.wiring_rows import WiringRows

_EARTH = 9.81  # m/s^2, where the study states none
_AXES = tuple(sign * axis for axis in np.eye(3) for sign in (1.0, -1.0))
_AROUND = tuple(
    np.array(d) / np.linalg.norm(d) for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)
)
_SIMPLEX = np.array([[0.0, 0.0], [0.3, 0.0], [0.0, 0.3]])  # rad
_MOST_FITS = 60  # of a refinement: 0.01 rad and better
_SAME_TURN = 0.02
"""Of gravity, by which its part along the first axis may change if a zero is to do the same."""


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

    @property
    def fault(self) -> Fault:
        """The mounting in words, with the line of the study that mends it."""
        said = residuals(self.before, self.after)
        an_axis = np.count_nonzero(self.gravity) == 1
        is_what = "is" if an_axis else "is about"
        what = f"gravity {is_what} {self.shown} in the axes of the description, not"
        where = "Write in the study, above its tables, how the base is mounted"
        if not an_axis:
            where += "; until that is measured, with what the torques say"
        if not self.gravity.any():
            what = "the torques hold no gravity, which was taken off before they were recorded:"
            where = "If so, write in the study, above its tables"
        elif turn := self._turn_of_the_first_joint():
            said += f" (a zero of q.{self.model.robot.names[0]} that is off by {turn} deg is alike)"
        return Fault(
            kind="gravity",
            joints=(),
            what=f"{what} {_shown(self.stated)}",
            evidence=said,
            mend=(f"gravity = {self.shown}",),
            where=where,
        )

    def _turn_of_the_first_joint(self) -> int:
        """Degrees by which a zero of the first joint would do the same; 0 if none does."""
        joint, *others = self.model.robot.joints
        if joint.kind != "revolute" or any(one.parent == -1 for one in others):
            return 0
        axis = joint.R @ joint.axis
        old, new = (g / np.linalg.norm(g) for g in (self.stated, self.gravity))
        if not abs(axis @ (new - old)) < _SAME_TURN:
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
    criteria : by how much it must win, and how far it must be turned: a base that is tilted by less
        is a physical effect, which a diagnosis tells with its interval.

    Returns
    -------
    None where no other gravity wins by far. Where several suit alike, an axis of the description,
    the nearest to the stated gravity.
    """
    stated = model.robot.gravity
    size = float(np.linalg.norm(stated)) or _EARTH
    moved = rows.moved(now.change)

    def fit(gravity: np.ndarray) -> TorqueFit:
        under = replace(model, robot=model.robot.with_gravity(gravity))
        return WiringRegression.of(under, moved).fit(now.torque_of, now.torque_scale)

    def turned(direction: np.ndarray) -> float:
        return float(np.arccos(np.clip(direction @ stated / size, -1.0, 1.0)))

    start = fit(stated)
    scores = [fit(size * one).score for one in _AROUND]
    none = fit(np.zeros(3)).score
    if max(*scores, none) <= start.score:
        return None
    best = _refined(_AROUND[int(np.argmax(scores))], lambda one: fit(size * one).score)
    axes = (one for one in sorted(_AXES, key=turned) if turned(one) >= criteria.least_turn)
    tried = [(g, fit(g)) for g in (*(size * one for one in axes), np.zeros(3))]
    refined = (np.round(size * best, 3), fit(size * best))  # as a study states it
    alike = max(one.score for _, one in (*tried, refined)) - criteria.evidence / rows.independent
    if turned(best) >= criteria.least_turn:
        tried.append(refined)
    suitable = [(g, one) for g, one in tried if one.score >= alike]
    if not suitable:
        return None
    gravity, after = suitable[0]
    found = Mounting(
        model=replace(model, robot=model.robot.with_gravity(gravity)),
        stated=stated,
        before=start,
        after=after,
    )
    # What no fit leaves less of is not mended, whatever became possible by it.
    better = after.misfit < start.misfit and is_better_by_far(after, start, rows, criteria)
    return found if better else None


def _refined(direction: np.ndarray, score: Callable[[np.ndarray], float]) -> np.ndarray:
    """The direction of the highest score, from one that is near it; how near is judged by it."""
    across = np.linalg.svd(direction[None])[2][1:]

    def at(turn: np.ndarray) -> np.ndarray:
        one = direction + turn @ across
        return one / np.linalg.norm(one)

    options = {"initial_simplex": _SIMPLEX, "maxfev": _MOST_FITS, "xatol": 1e-3, "fatol": 1e-3}
    found = minimize(lambda x: -score(at(x)), np.zeros(2), method="Nelder-Mead", options=options)
    return at(found.x)


def _shown(gravity: np.ndarray) -> str:
    return f"[{', '.join(f'{x:.4g}' for x in gravity + 0.0)}]"
