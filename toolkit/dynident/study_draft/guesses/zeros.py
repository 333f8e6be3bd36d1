"""Where joints count from: encoders whose zero is a quarter turn or more off the description's."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.robot import Robot
from dynident.tables import percent
from dynident.wiring.regressions.wiring_regression import TorqueFit
from dynident.wiring.regressions.wiring_rows import WiringRows

QUARTER = np.pi / 2
_WIDTH = 0.05  # rad/s or m/s, over which dry friction reverses
_SIZE = 3.0  # times the described torque, or a part of it, that bodies differ from theirs by
_PREFERRED = 3.0
"""Logarithmic likelihood by which a fit has to prefer, too, what the described bodies want: of the
last joint it prefers nothing, and a described centre of mass may be wrong."""
_LEAST = 1e-5  # share of the torque's power below which a residual is as good as none

Quarters = tuple[int, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class ZerosGuess:
    """Zeros of joints, in quarter turns, and fits with and without them.

    Attributes
    ----------
    quarters : (n) whole numbers; ours = theirs + quarters * pi/2.
    start, best : fits of the equations of motion without and with them.
    described : share of the torque that the described bodies leave without and with them.
    """

    quarters: Quarters
    start: TorqueFit
    best: TorqueFit
    described: tuple[float, float]

    @property
    def evidence(self) -> str:
        """What the described bodies show, in words."""
        before, after = (percent(one) for one in self.described)
        though = ", though" if self.described[1] > self.described[0] else ";"
        return (
            f"{though} the bodies as described, scaled joint by joint, with friction and rotors, "
            f"leave {after} instead of {before}"
        )


def guess_zeros(
    robot: Robot,
    rows: WiringRows,
    fit: Callable[[Robot, WiringRows], TorqueFit],
    torque_unit: Literal["N m", "A"] = "N m",
) -> ZerosGuess:
    """Turn zeros by quarter turns, a joint or two at a time, while the torques fit far better.

    Fits of the equations of motion come first. They tell little of a zero that turns nothing but
    bodies whose masses are as free as they are; the bodies as described tell more, and are heard
    where a fit prefers the same. Smaller errors are not looked for here: the diagnosis has an
    effect for them.

    Parameters
    ----------
    robot : as it is described; of its joints only those that turn.
    rows : of recordings in the units of the robot.
    fit : of the equations of motion.
    torque_unit : "A" where drives have gains that are not known.

    Returns
    -------
    The zeros, none of them moved where nothing wins by far.
    """
    criteria = DEFAULTS.wiring
    enough = max(criteria.gain, criteria.evidence / rows.independent)

    def at(quarters: Quarters) -> WiringRows:
        return replace(rows, q=rows.q + QUARTER * np.array(quarters))

    def by_fit(quarters: Quarters, now: TorqueFit) -> tuple[Quarters, TorqueFit] | None:
        """The move that a fit prefers by far; of two joints together where none of one is."""
        for moves in (_turned(robot, quarters), _turned_in_pairs(robot, quarters)):
            tried = [(one, fit(robot, at(one))) for one in moves]
            other, best = max(tried, key=lambda one: one[1].score, default=(quarters, now))
            less = np.mean(best.unexplained) < np.mean(now.unexplained)
            if less and best.score - now.score >= enough:
                return other, best
        return None

    def by_description(quarters: Quarters, now: TorqueFit) -> tuple[Quarters, TorqueFit] | None:
        """The move that the described bodies prefer by far, and a fit as well."""
        here = _left(robot, at(quarters), torque_unit)
        tried = [(one, _left(robot, at(one), torque_unit)) for one in _turned(robot, quarters)]
        other, left = min(tried, key=lambda one: _cost(one[1]), default=(quarters, here))
        # Nothing that fits badly shows a zero.
        if _cost(here) - _cost(left) < enough or np.sqrt(np.mean(left)) > criteria.poor_fit:
            return None
        best = fit(robot, at(other))
        return (other, best) if (best.score - now.score) * rows.independent >= _PREFERRED else None

    found: Quarters = (0,) * robot.n
    start = now = fit(robot, at(found))
    for search in (by_fit, by_description):
        while (better := search(found, now)) is not None:
            found, now = better
    first, left = (_left(robot, one, torque_unit) for one in (rows, at(found)))
    shares = tuple(float(np.sqrt(np.mean(one))) for one in (first, left))
    return ZerosGuess(quarters=found, start=start, best=now, described=(shares[0], shares[1]))


def _turned(robot: Robot, quarters: Quarters) -> Iterator[Quarters]:
    """Each joint a quarter turn further, back, or half a turn."""
    for j, kind in enumerate(robot.kinds):
        if kind == "revolute":
            yield from _moved(quarters, *({j: turn} for turn in (1, -1, 2)))


def _turned_in_pairs(robot: Robot, quarters: Quarters) -> Iterator[Quarters]:
    """Each joint and the one before it, either way: an arm that is folded at zero."""
    for j, joint in enumerate(robot.joints):
        k = joint.parent
        if k >= 0 and robot.kinds[j] == robot.kinds[k] == "revolute":
            pairs = ({j: one, k: other} for one in (1, -1) for other in (1, -1))
            yield from _moved(quarters, *pairs)


def _moved(quarters: Quarters, *moves: Mapping[int, int]) -> Iterator[Quarters]:
    for move in moves:
        one = tuple(count + move.get(j, 0) for j, count in enumerate(quarters))
        if max(map(abs, one)) <= 2:
            yield one


def _left(robot: Robot, rows: WiringRows, torque_unit: Literal["N m", "A"]) -> np.ndarray:
    """Share of each torque's power, (n), that the described bodies leave, friction allowed for."""
    described = robot.inverse_dynamics(rows.q, rows.v, rows.a)
    found = np.ones(robot.n)
    motors = np.eye(robot.n) if rows.motors is None else rows.motors
    for j in range(robot.n):
        y = rows.tau[:, j]
        at = motors[motors[:, j] != 0]  # those that act here
        v, a = rows.v @ at.T, rows.a @ at.T
        own = np.column_stack([v, np.tanh(v / _WIDTH), a, np.ones_like(y)])
        basis = np.linalg.qr(own / np.maximum(np.linalg.norm(own, axis=0), 1e-300))[0]
        x, rest = (one - basis @ (basis.T @ one) for one in (described[:, j], y))
        size = float(x @ x)
        factor = float(x @ rest) / size if size > _LEAST * float(rest @ rest) else 0.0
        # Of another sign or size it is chance; gains of drives may have any.
        if torque_unit == "A" or 1 / _SIZE <= factor <= _SIZE:
            rest = rest - factor * x
        found[j] = float(rest @ rest) / max(float(y @ y), 1e-300)
    return found


def _cost(left: np.ndarray) -> float:
    """Negative logarithmic likelihood per row."""
    return 0.5 * float(np.sum(np.log(np.maximum(left, _LEAST))))
