"""Which recorded column belongs to which joint, with which factor: as recorded, or otherwise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from dynident.wiring.fault import FaultKind

DEGREE = float(np.pi / 180)
MILLI = 1e-3
_NEARLY_WHOLE = 5e-3


@dataclass(frozen=True, eq=False, kw_only=True)
class Assignment:
    """Positions and torques of joints, made of recorded columns.

    Joint i has the position `position_scale[i]` times the recorded column `position_of[i]`, and the
    torque likewise.

    Attributes
    ----------
    position_of, torque_of : (n,) numbers of columns.
    position_scale, torque_scale : (n,) factors.
    """

    position_of: np.ndarray
    torque_of: np.ndarray
    position_scale: np.ndarray
    torque_scale: np.ndarray

    @classmethod
    def as_recorded(cls, n: int) -> Assignment:
        """Every column at its own joint."""
        order, ones = np.arange(n), np.ones(n)
        return cls(
            position_of=order, torque_of=order, position_scale=ones, torque_scale=ones.copy()
        )

    @property
    def change(self) -> np.ndarray:
        """The matrix (n, n) that makes positions of joints from recorded ones."""
        return np.diag(self.position_scale) @ np.eye(len(self.position_of))[self.position_of]

    def motors(self, recorded: np.ndarray) -> np.ndarray:
        """The turns of motors from those of joints, each motor in its joint's place and scale.

        With q' = S P q for joints, and m' = S P m for motors m = M q, they are M' in m' = M' q'.

        Parameters
        ----------
        recorded : (n, n) M, turns of the motors behind their gears from those of recorded joints.
        """
        at, scale = self.position_of, self.position_scale
        return scale[:, None] * recorded[np.ix_(at, at)] / scale

    def positions_exchanged(self, i: int, j: int) -> Assignment:
        """The positions of two joints exchanged."""
        at = _exchanged(len(self.position_of), i, j)
        scale = self.position_scale[at]
        return replace(self, position_of=self.position_of[at], position_scale=scale)

    def torques_exchanged(self, i: int, j: int) -> Assignment:
        """The torques of two joints exchanged."""
        at = _exchanged(len(self.torque_of), i, j)
        return replace(self, torque_of=self.torque_of[at], torque_scale=self.torque_scale[at])

    def positions_scaled(self, factor: float, *joints: int) -> Assignment:
        """Positions of these joints multiplied by a factor."""
        return replace(self, position_scale=_scaled(self.position_scale, factor, joints))

    def torques_scaled(self, factor: float, *joints: int) -> Assignment:
        """Torques of these joints multiplied by a factor."""
        return replace(self, torque_scale=_scaled(self.torque_scale, factor, joints))


def _exchanged(n: int, i: int, j: int) -> np.ndarray:
    at = np.arange(n)
    at[[i, j]] = j, i
    return at


def _scaled(scale: np.ndarray, factor: float, joints: tuple[int, ...]) -> np.ndarray:
    found = np.array(scale)
    found[list(joints)] *= factor
    return found


@dataclass(frozen=True, eq=False, kw_only=True)
class Hypothesis:
    """A single fault, and the assignment that mends it.

    Attributes
    ----------
    kind : of the fault.
    joints : numbers of the joints that it is about.
    mended : the assignment without the fault.
    ratios : of the gears of these joints, or factors of their torques, where the fault has any.
    """

    kind: FaultKind
    joints: tuple[int, ...]
    mended: Assignment
    ratios: tuple[float, ...] = ()

    def with_whole_ratios(self) -> Hypothesis:
        """Gears as they are stamped: whole ratios where the ones that were found are near."""
        mended, ratios = self.mended, []
        for joint, ratio in zip(self.joints, self.ratios, strict=True):
            whole = float(round(ratio))
            if not whole or abs(ratio / whole - 1) > _NEARLY_WHOLE:
                whole = ratio
            mended = mended.positions_scaled(ratio / whole, joint)
            if self.kind == "motor_side":
                mended = mended.torques_scaled(whole / ratio, joint)
            ratios.append(whole)
        return replace(self, mended=mended, ratios=tuple(ratios))


def torque_hypotheses(now: Assignment) -> list[Hypothesis]:
    """Faults of torques alone: signs of one or all, two exchanged; the plainest first."""
    n = len(now.torque_of)
    found = [
        Hypothesis(kind="torque_sign", joints=(i,), mended=now.torques_scaled(-1.0, i))
        for i in range(n)
    ]
    if n > 1:
        every = tuple(range(n))
        mended = now.torques_scaled(-1.0, *every)
        found.append(Hypothesis(kind="torque_signs", joints=every, mended=mended))
    for i, j in combinations(range(n), 2):
        mended = now.torques_exchanged(i, j)
        found.append(Hypothesis(kind="torques_exchanged", joints=(i, j), mended=mended))
    return found


def position_hypotheses(
    now: Assignment, revolute: tuple[int, ...], prismatic: tuple[int, ...]
) -> list[list[Hypothesis]]:
    """Faults of positions, in groups that share their motion.

    Parameters
    ----------
    now : what they are faults of.
    revolute, prismatic : numbers of the joints whose positions are angles, and lengths.

    Returns
    -------
    The plainest first.
    """
    n = len(now.position_of)
    groups = []
    units: tuple[tuple[FaultKind, float, tuple[int, ...]], ...] = (
        ("degrees", DEGREE, revolute),
        ("millimetres", MILLI, prismatic),
    )
    for kind, factor, joints in units:
        for some in ([joints] if len(joints) > 1 else []) + [(i,) for i in joints]:
            mended = now.positions_scaled(factor, *some)
            groups.append([Hypothesis(kind=kind, joints=some, mended=mended)])
    for i in range(n):
        mended = now.positions_scaled(-1.0, i)
        groups.append([Hypothesis(kind="position_sign", joints=(i,), mended=mended)])
    for i, j in combinations(range(n), 2):
        positions = now.positions_exchanged(i, j)
        both = positions.torques_exchanged(i, j)
        groups.append(
            [
                Hypothesis(kind="positions_exchanged", joints=(i, j), mended=positions),
                Hypothesis(kind="joints_exchanged", joints=(i, j), mended=both),
            ]
        )
    return groups
