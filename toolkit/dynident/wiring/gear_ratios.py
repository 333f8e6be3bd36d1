"""Gears between what was recorded and the joint: ratios of positions and of torques."""

from __future__ import annotations

import numpy as np

from dynident.criteria import WiringCriteria
from dynident.model import Model
from dynident.wiring.assignment import Assignment, Hypothesis
from dynident.wiring.fault import FaultKind
from dynident.wiring.regressions.wiring_regression import TorqueFit, WiringRegression
from dynident.wiring.regressions.wiring_rows import WiringRows

_ROWS = 160  # for a look at many ratios
_COARSE = tuple(float(x) for x in np.geomspace(3.0, 1200.0, 18))
_RATIOS = tuple(float(x) for x in np.geomspace(2.0, 400.0, 42))
_STEPS = 14  # of the refinement of a ratio
_GOLDEN = (np.sqrt(5) - 1) / 2

_USUAL_ROOM = 4.0  # rad that a joint has room to turn through, where its limits say nothing
_WIDE = tuple(sign * float(x) for x in np.geomspace(0.3, 3.0, 15) for sign in (1.0, -1.0))
_NARROW = tuple(float(x) for x in np.linspace(0.88, 1.12, 13))
_FINE = tuple(float(x) for x in np.linspace(0.985, 1.015, 11))

Tried = tuple[Hypothesis, TorqueFit]


def torque_scale_hypotheses(
    regression: WiringRegression, now: Assignment, start: TorqueFit
) -> list[Tried]:
    """Each torque on another scale: of another unit, or of the motor side of a gear.

    Parameters
    ----------
    regression : along the motion.
    now, start : the assignment, and its fit.

    Returns
    -------
    The best factor of each joint.
    """
    found: list[Tried] = []
    for joint in range(len(now.torque_of)):

        def at(log: float, joint: int = joint) -> Tried:
            factor = float(np.exp(log))
            mended = now.torques_scaled(factor, joint)
            fit = regression.fit(mended.torque_of, mended.torque_scale)
            one = Hypothesis(kind="torque_scale", joints=(joint,), mended=mended, ratios=(factor,))
            return one, fit

        factors = [*_COARSE, *(1 / x for x in _COARSE)]
        coarse = max((at(float(np.log(f))) for f in factors), key=lambda one: one[1].score)
        if coarse[1].score > start.score + 0.02:
            step = np.log(_COARSE[1] / _COARSE[0])
            coarse = _refined(at, float(np.log(coarse[0].ratios[0])), step)
        found.append(coarse)
    return found


def motor_side_hypotheses(
    model: Model, rows: WiringRows, now: Assignment, start: TorqueFit, criteria: WiringCriteria
) -> list[Tried]:
    """Positions on the motor side of a gear, their torques as recorded or there as well.

    Joints are looked at that turn farther than they can, or all where the fit is poor.

    Parameters
    ----------
    model : the robot.
    rows, now, start : the rows, the assignment and its fit.
    criteria : what counts as poor.

    Returns
    -------
    The best ratio of each joint that was looked at, and that of several together.
    """
    far = [j for j in range(model.robot.n) if turns_too_far(model, rows, now, j, criteria)]
    joints = far
    if not far and np.sqrt(np.mean(start.unexplained)) > criteria.poor_fit:
        joints = list(range(model.robot.n))
    gears = _Gears(model, rows.thinned(_ROWS))
    # Where nothing but a poor fit asks for gears, as a rule there are none: a quicker look.
    grid = _RATIOS if far else _RATIOS[::3]
    found = [gears.best(now, joint, grid) for joint in joints]
    if len(far) > 1:
        found.append(gears.together(now, far))
    whole = _Gears(model, rows)
    return [whole.fitted(one.with_whole_ratios()) for one, _ in found]


class _Gears:
    """Fits of positions and torques on the motor side of gears."""

    def __init__(self, model: Model, rows: WiringRows) -> None:
        self.model, self.rows = model, rows

    def fitted(self, one: Hypothesis) -> Tried:
        """The hypothesis with its fit."""
        regression = WiringRegression.of(self.model, self.rows.moved(one.mended.change))
        return one, regression.fit(one.mended.torque_of, one.mended.torque_scale)

    def at(self, now: Assignment, joint: int, ratio: float) -> Tried:
        """The better of both: the position alone on the motor side, or the torque with it."""
        position = now.positions_scaled(1 / ratio, joint)
        both = position.torques_scaled(ratio, joint)
        regression = WiringRegression.of(self.model, self.rows.moved(position.change))
        tried: list[Tried] = []
        sides: tuple[tuple[FaultKind, Assignment], ...] = (
            ("motor_side", both),
            ("motor_side_position", position),
        )
        for kind, mended in sides:
            one = Hypothesis(kind=kind, joints=(joint,), mended=mended, ratios=(ratio,))
            tried.append((one, regression.fit(mended.torque_of, mended.torque_scale)))
        return max(tried, key=_score)

    def best(self, now: Assignment, joint: int, grid: tuple[float, ...]) -> Tried:
        """The best ratio of one joint, of either sense."""
        signed = [sign * ratio for ratio in grid for sign in (1.0, -1.0)]
        coarse = max((self.at(now, joint, ratio) for ratio in signed), key=_score)
        ratio = coarse[0].ratios[0]
        sign, step = np.sign(ratio), np.log(grid[1] / grid[0])
        found = _refined(
            lambda log: self.at(now, joint, float(sign * np.exp(log))), np.log(abs(ratio)), step
        )
        return max(coarse, found, key=_score)

    def together(self, now: Assignment, joints: list[int]) -> Tried:
        """Ratios of several joints, one after the other until none changes the fit."""
        ratios = {j: self._to_fit_in(now, j) for j in joints}
        everywhere = tuple(joints)

        def hypothesis() -> Tried:
            mended = now
            for j, ratio in ratios.items():
                mended = mended.positions_scaled(1 / ratio, j).torques_scaled(ratio, j)
            given = tuple(ratios[j] for j in joints)
            return self.fitted(
                Hypothesis(kind="motor_side", joints=everywhere, mended=mended, ratios=given)
            )

        found = hypothesis()
        for factors in (_WIDE, _WIDE, _NARROW, _FINE):
            for j in reversed(joints):
                usual, best = ratios[j], ratios[j]
                for factor in factors:
                    ratios[j] = usual * factor
                    tried = hypothesis()
                    if tried[1].score > found[1].score:
                        found, best = tried, ratios[j]
                ratios[j] = best
        return found

    def _to_fit_in(self, now: Assignment, joint: int) -> float:
        """The ratio with which a joint turns through half of its room."""
        limits = self.model.robot.joints[joint]
        room = min(limits.upper - limits.lower, _USUAL_ROOM)
        column = self.rows.q[:, now.position_of[joint]] * now.position_scale[joint]
        return float(np.ptp(column)) / (0.5 * room)


def _score(tried: Tried) -> float:
    return tried[1].score


def turns_too_far(
    model: Model, rows: WiringRows, now: Assignment, joint: int, criteria: WiringCriteria
) -> bool:
    """Whether a joint travels farther than its limits let it, or than any arm turns.

    Parameters
    ----------
    model : with the limits.
    rows, now : the positions, as they are assigned.
    joint : its number.
    criteria : how far is too far.

    Returns
    -------
    True if it does.
    """
    column = rows.q[:, now.position_of[joint]] * now.position_scale[joint]
    travel = float(np.ptp(column))
    limits = model.robot.joints[joint]
    room = limits.upper - limits.lower
    if np.isfinite(room) and room > 0:
        return travel > criteria.beyond_limits * room
    # How far a continuous joint travels says nothing of its unit: the torques alone do.
    return model.robot.stated_kinds[joint] == "revolute" and travel > criteria.widest_turn


def _refined(at, middle: float, reach: float) -> Tried:
    """Golden section for the logarithm of a factor, about the best of a grid."""
    low, high = middle - reach, middle + reach
    left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    one, two = at(left), at(right)
    best = max(at(middle), one, two, key=lambda x: x[1].score)
    for _ in range(_STEPS):
        if one[1].score >= two[1].score:
            high, right, two = right, left, one
            left = high - _GOLDEN * (high - low)
            one = at(left)
        else:
            low, left, one = left, right, two
            right = low + _GOLDEN * (high - low)
            two = at(right)
        best = max(best, one, two, key=lambda x: x[1].score)
    return best
