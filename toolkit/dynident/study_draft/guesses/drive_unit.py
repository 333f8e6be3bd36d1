"""Whether columns that nothing names torques are rather currents: by their size, joint by joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.errors import DynidentError
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from dynident.tables import number
from dynident.wiring.regressions.wiring_rows import rows_of

_SHOWN = 0.5
"""Share of what friction leaves that the described torque has to explain, for a size to count."""
_FACTOR = 2.5
"""Descriptions err by less: masses of a data sheet by a third, those of a drawing by a tenth."""
_LEAST = 2  # joints


@dataclass(frozen=True, kw_only=True)
class DriveSizes:
    """Described torque per unit of what was recorded.

    Attributes
    ----------
    joints : names of the joints at which it shows.
    sizes : N m per unit at each.
    """

    joints: tuple[str, ...]
    sizes: tuple[float, ...]

    @property
    def are_newton_metres(self) -> bool:
        """Whether they are about one, or show at too few joints to tell."""
        if len(self.joints) < _LEAST:
            return True
        # Half of the joints may be described badly; N mm are seen elsewhere.
        usual = float(np.median(np.log(np.abs(self.sizes))))
        return min(abs(usual), abs(usual - np.log(1e-3))) < np.log(_FACTOR)

    @property
    def reason(self) -> str:
        """What shows, in words."""
        shown = ", ".join(
            f"{joint} {number(size, 2)}"
            for joint, size in zip(self.joints, self.sizes, strict=True)
        )
        return f"the described robot needs {shown} N m for each unit of these columns"


def drive_sizes(robot: Robot, recordings: Sequence[Recording]) -> DriveSizes:
    """Compare recorded torques with those of the described robot, friction allowed for.

    Parameters
    ----------
    robot : as it is described.
    recordings : of it.

    Returns
    -------
    The sizes at the joints whose torque the description explains.
    """
    criteria = DEFAULTS.wiring
    try:
        rows = rows_of(Dataset(tuple(recordings)), criteria.rows, criteria.independent_hz)
    except DynidentError:
        return DriveSizes(joints=(), sizes=())
    described = robot.inverse_dynamics(rows.q, rows.v, rows.a)
    joints, sizes = [], []
    for j, name in enumerate(robot.names):
        v, a = rows.v[:, j], rows.a[:, j]
        # What a drive needs for itself: rotor, friction, offset.
        own = np.column_stack([a, v, np.sign(v), np.ones_like(v)])
        basis = np.linalg.qr(own / np.maximum(np.linalg.norm(own, axis=0), 1e-300))[0]
        x, y = (one - basis @ (basis.T @ one) for one in (described[:, j], rows.tau[:, j]))
        both = float(x @ x) * float(y @ y)
        if both and (x @ y) ** 2 >= _SHOWN * both:
            joints.append(name)
            sizes.append(float((x @ x) / (x @ y)))
    return DriveSizes(joints=tuple(joints), sizes=tuple(sizes))
