"""How files are read: which columns stand for what, and of which robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.errors import DynidentError
from dynident.recording import Column, Dataset, Recording
from dynident.robot import Robot
from dynident.wiring.regressions.wiring_rows import WiringRows, rows_of


@dataclass(frozen=True, eq=False, kw_only=True)
class Reading:
    """How files are read, and of which robot.

    Attributes
    ----------
    robot : with the direction of gravity.
    columns : ours -> theirs.
    torque_unit : "A" where what stands for torques are currents: their size tells nothing.
    geared : whether columns are of the motors' side of gears.
    stated : whether somebody has said what positions are made of.
    motors : (n, n) turns of the motors, behind their gears, from those of the joints, where a motor
        turns two of them.
    """

    robot: Robot
    columns: dict[str, Column]
    torque_unit: Literal["N m", "A"] = "N m"
    geared: bool = False
    stated: bool = False
    motors: np.ndarray | None = None

    @property
    def may_share_motors(self) -> bool:
        """Whether a motor may turn two joints, and nobody has said that one does.

        Currents of two motors add only with their gains, which nobody knows yet.
        """
        free = self.geared and not self.stated and self.motors is None
        return free and self.torque_unit == "N m"

    def rows(self, recordings: tuple[Recording, ...]) -> WiringRows | None:
        """Return a few hundred rows; None where recordings are too short for the usual filter.

        Parameters
        ----------
        recordings : read so.
        """
        criteria = DEFAULTS.wiring
        try:
            rows = rows_of(Dataset(recordings), criteria.rows, criteria.independent_hz)
        except DynidentError:
            return None
        return replace(rows, motors=self.motors)
