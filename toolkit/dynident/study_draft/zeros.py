"""Where joints count from: encoders whose zero is a quarter turn or more off the description's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.errors import DynidentError
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from dynident.tables import percent
from dynident.wiring.wiring_regression import TorqueFit, WiringRegression
from dynident.wiring.wiring_rows import WiringRows, rows_of

QUARTER = np.pi / 2


@dataclass(frozen=True, kw_only=True)
class ZeroGuess:
    """Quarter turns between the recorded and the described zero of each joint.

    Attributes
    ----------
    quarters : (n) whole numbers; ours = theirs + quarters * pi/2.
    evidence : what shows it; empty where nothing is off.
    """

    quarters: tuple[int, ...]
    evidence: str = ""


def guess_zeros(robot: Robot, recordings: tuple[Recording, ...]) -> ZeroGuess:
    """Turn zeros by quarter turns, one joint after the other, while the torques fit far better.

    Smaller errors are not looked for here: the diagnosis has an effect for them.

    Parameters
    ----------
    robot : as it is described; of its joints only those that turn.
    recordings : in the units of the robot.
    """
    n, criteria = robot.n, DEFAULTS.wiring
    none = ZeroGuess(quarters=(0,) * n)
    try:
        rows = rows_of(Dataset(recordings), criteria.rows, criteria.independent_hz)
    except DynidentError:
        return none  # too short for the usual filter: nothing is said
    model = Model(robot)
    found = [0] * n
    first = now = _fit(model, rows, found)
    while True:
        tried = [
            (other, _fit(model, rows, other))
            for j in range(n)
            if robot.kinds[j] == "revolute"
            for turn in (1, -1, 2)
            if abs((other := _turned(found, j, turn))[j]) <= 2
        ]
        best = max(tried, key=lambda one: one[1].score, default=None)
        if best is None:
            break
        gain = best[1].score - now.score
        if gain < criteria.gain or gain * rows.independent < criteria.evidence:
            break
        found, now = best
    if not any(found):
        return none
    left = [percent(float(np.sqrt(np.mean(one.unexplained)))) for one in (first, now)]
    evidence = f"a fit then leaves {left[1]} of the torque instead of {left[0]}"
    return ZeroGuess(quarters=tuple(found), evidence=evidence)


def _turned(quarters: list[int], joint: int, turn: int) -> list[int]:
    return [one + turn * (j == joint) for j, one in enumerate(quarters)]


def _fit(model: Model, rows: WiringRows, quarters: list[int]) -> TorqueFit:
    moved = replace(rows, q=rows.q + QUARTER * np.array(quarters))
    n = model.robot.n
    return WiringRegression.of(model, moved).fit(np.arange(n), np.ones(n))
