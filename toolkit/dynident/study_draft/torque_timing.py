"""Whether a torque is a command that is held to the next sample, half a sample late on average."""

from __future__ import annotations

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.errors import DynidentError
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from dynident.wiring.wiring_regression import WiringRegression
from dynident.wiring.wiring_rows import rows_of


def looks_held(robot: Robot, recordings: tuple[Recording, ...]) -> bool:
    """Whether torques fit far better as held commands than as measured ones.

    Parameters
    ----------
    robot : as it is described.
    recordings : in the units of the robot; their torques count as measured.

    Returns
    -------
    False also where half a sample is too short to show.
    """
    held = tuple(one.replace(torque="held_command") for one in recordings)
    try:
        (as_measured, rows), (as_held, _) = (_score(robot, some) for some in (recordings, held))
    except DynidentError:
        return False
    return (as_held - as_measured) * rows >= DEFAULTS.wiring.evidence


def _score(robot: Robot, recordings: tuple[Recording, ...]) -> tuple[float, float]:
    """Logarithmic likelihood per row of a fit, and how many rows count."""
    criteria = DEFAULTS.wiring
    rows = rows_of(Dataset(recordings), criteria.rows, criteria.independent_hz)
    n = robot.n
    found = WiringRegression.of(Model(robot), rows).fit(np.arange(n), np.ones(n))
    return found.fit_score, rows.independent
