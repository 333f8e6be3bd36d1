"""How late torques are: a command that is held is half a sample late on average, a delay more."""

from __future__ import annotations

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.errors import DynidentError
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from dynident.wiring.wiring_regression import WiringRegression
from dynident.wiring.wiring_rows import rows_of

_DELAYS = (1, 2, 4)  # samples


def samples_late(robot: Robot, recordings: tuple[Recording, ...]) -> float:
    """Samples by which torques act later than they are recorded: 0, 0.5 of a held command, or more.

    Parameters
    ----------
    robot : as it is described.
    recordings : in the units of the robot; their torques count as measured.

    Returns
    -------
    0 also where half a sample is too short to show.
    """
    late = {0.5: tuple(one.replace(torque="held_command") for one in recordings)}
    late |= {float(k): tuple(_delayed(one, k) for one in recordings) for k in _DELAYS}
    try:
        now, rows = _score(robot, recordings)
        scores = {samples: _score(robot, some)[0] for samples, some in late.items()}
    except DynidentError:
        return 0.0
    enough = DEFAULTS.wiring.evidence / rows
    if scores[0.5] - now < enough:
        return 0.0
    best = max(_DELAYS, key=lambda k: scores[k])
    return float(best) if scores[best] - scores[0.5] >= enough else 0.5


def _delayed(one: Recording, samples: int) -> Recording:
    tau = np.concatenate([np.repeat(one.tau[:1], samples, axis=0), one.tau[:-samples]])
    return one.replace(tau=tau)


def _score(robot: Robot, recordings: tuple[Recording, ...]) -> tuple[float, float]:
    """Logarithmic likelihood per row of a fit, and how many rows count."""
    criteria = DEFAULTS.wiring
    rows = rows_of(Dataset(recordings), criteria.rows, criteria.independent_hz)
    n = robot.n
    found = WiringRegression.of(Model(robot), rows).fit(np.arange(n), np.ones(n))
    return found.fit_score, rows.independent
