"""What the drives measure of a motion, and what is recorded of their torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.errors import SimulationError

PerJoint = float | Sequence[float]


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """Noise and resolution of position and torque; a single number stands for every joint.

    Attributes
    ----------
    position_std : rad or m, white noise of each position sample.
    position_resolution : rad or m, one step of the encoder; 0 for none.
    torque_std : N m or N, white noise of each recorded torque.
    torque_resolution : N m or N, one step of the record; 0 for none.
    temperature_std : K, white noise of the motors' recorded temperatures; None where they are not
        recorded.
    """

    position_std: PerJoint = 0.0
    position_resolution: PerJoint = 0.0
    torque_std: PerJoint = 0.0
    torque_resolution: PerJoint = 0.0
    temperature_std: PerJoint | None = None

    def each(self, name: str, n: int) -> np.ndarray:
        """Return an attribute for each of n joints, (n,).

        Raises
        ------
        SimulationError
            If it is negative, not finite, or of another number of joints.
        """
        given = getattr(self, name)
        value = np.atleast_1d(np.asarray(0.0 if given is None else given, dtype=float))
        where = f"sensors.{name}"
        if value.shape not in ((1,), (n,)):
            remedy = "give one number, or one per joint"
            raise SimulationError(f"{value.size} values for {n} joints", where, remedy)
        if not (np.isfinite(value).all() and (value >= 0).all()):
            raise SimulationError(f"{value.tolist()}", where, "choose numbers of 0 or above")
        return np.broadcast_to(value, (n,)).copy()


def delayed(tau: np.ndarray, t: np.ndarray, delay: np.ndarray, period: float) -> np.ndarray:
    """Return torques (T, n) as they were some time before (n,) s; after it where that is negative.

    Between samples they are interpolated: a measured torque is taken to be straight, and a held
    one is averaged over each step, which is the same. What lies outside the record is taken a
    period further inside, or from its end where it is shorter.

    Parameters
    ----------
    tau : (T, n) N m or N.
    t : (T,) s, ascending.
    delay : (n,) s.
    period : s, after which the motion repeats.
    """
    late = np.empty_like(tau)
    for joint, d in enumerate(delay):
        at = t - d
        at = np.where(at < t[0], at + period, np.where(at > t[-1], at - period, at))
        late[:, joint] = np.interp(at, t, tau[:, joint]) if d else tau[:, joint]
    return late


def rounded(x: np.ndarray, resolution: np.ndarray) -> np.ndarray:
    """Return x (..., n) in whole steps of a resolution (n,); a resolution of 0 leaves it alone."""
    if not np.any(resolution > 0):
        return x
    step = np.where(resolution > 0, resolution, 1.0)
    # The last rounding removes the tail that the product leaves in the decimals (0.1 * 3).
    return np.where(resolution > 0, np.round(np.round(x / step) * step, 12), x)
