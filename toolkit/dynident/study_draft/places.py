"""Whether columns say where a robot stands: what follows from its positions is no torque.

Logs have positions more than once: of the motors, in other units and perhaps mixed by coupled
gears, and of the tool. As a torque would be, they are explained by the motion; a torque, though,
holds friction, which changes its sign with the speed, and takes accelerations.
"""

from __future__ import annotations

import numpy as np

from dynident.robot import Robot
from dynident.robot.poses import poses

_ROWS = 400  # of a motion that are looked at
_MISSED = 0.01  # of how far a column goes, that positions leave of it at most
_SAME = 3  # columns that are: of a tool, whose angles are no sums of what is known, three


class Places:
    """What a motion says of places: positions, and where the last link is.

    Parameters
    ----------
    robot : as it is described.
    q : (T, n) rad or m.
    """

    def __init__(self, robot: Robot, q: np.ndarray) -> None:
        self._rows = np.linspace(0, len(q) - 1, min(len(q), _ROWS)).astype(int)
        some, tip = q[self._rows], robot.tip
        R, p = poses(robot, some)
        turned = R[:, tip].reshape(len(some), 9)
        # Whatever the base, the tool, and the units: each column is a sum of these.
        self._known = np.column_stack([np.ones(len(some)), some, turned, p[:, tip]])

    def tell(self, columns: np.ndarray) -> bool:
        """Whether as many of them follow from the positions as do of a tool, or all that move.

        Parameters
        ----------
        columns : (T, n) of the same rows.
        """
        x = columns[self._rows] - columns[self._rows].mean(axis=0)
        size = np.linalg.norm(x, axis=0)
        moving = size > 0
        left = x - self._known @ np.linalg.lstsq(self._known, x, rcond=None)[0]
        same = np.linalg.norm(left, axis=0) <= _MISSED * size
        return bool(np.sum(same & moving) >= min(_SAME, np.sum(moving)))
