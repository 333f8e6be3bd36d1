"""Where joints count from: encoders whose zero is a quarter turn or more off the description's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.robot import Robot
from dynident.wiring.wiring_regression import TorqueFit
from dynident.wiring.wiring_rows import WiringRows

QUARTER = np.pi / 2


def guess_zeros(
    robot: Robot, rows: WiringRows, fit: Callable[[Robot, WiringRows], TorqueFit]
) -> tuple[tuple[int, ...], TorqueFit, TorqueFit]:
    """Turn zeros by quarter turns, one joint after the other, while the torques fit far better.

    Smaller errors are not looked for here: the diagnosis has an effect for them.

    Parameters
    ----------
    robot : as it is described; of its joints only those that turn.
    rows : of recordings in the units of the robot.
    fit : of the equations of motion.

    Returns
    -------
    quarters : (n) whole numbers; ours = theirs + quarters * pi/2.
    start, best : fits without and with them.
    """
    criteria = DEFAULTS.wiring

    def at(quarters: tuple[int, ...]) -> TorqueFit:
        return fit(robot, replace(rows, q=rows.q + QUARTER * np.array(quarters)))

    found = (0,) * robot.n
    start = now = at(found)
    while True:
        tried = [
            (other, at(other))
            for j in range(robot.n)
            if robot.kinds[j] == "revolute"
            for turn in (1, -1, 2)
            if abs((other := (*found[:j], found[j] + turn, *found[j + 1 :]))[j]) <= 2
        ]
        if not tried:
            break
        other, best = max(tried, key=lambda one: one[1].score)
        gain = best.score - now.score
        if gain < criteria.gain or gain * rows.independent < criteria.evidence:
            break
        if np.mean(best.unexplained) >= np.mean(now.unexplained):
            break
        found, now = other, best
    return found, start, now
