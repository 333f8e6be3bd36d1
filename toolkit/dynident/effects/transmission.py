"""A transmission that gives way: what stands between a motor and its link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Transmission:
    """A spring with damping and play between the motor and the link of one joint.

    The motor's encoder and the recorded torque are on the motor's side. With the deflection
    d = q_motor - q_link, the transmitted torque is K (d - clip(d, -gap / 2, gap / 2)) + D d',
    the damping only where the sides touch.

    Attributes
    ----------
    joint : column of the joint.
    stiffness : K, N m/rad or N/m.
    damping : D, N m s/rad or N s/m.
    gap : rad or m, whole width of the play; 0 for none.
    rotor : kg m^2 or kg, inertia on the motor's side where the model states no rotor inertia there.
    """

    joint: int
    stiffness: float
    damping: float
    gap: float
    rotor: float

    def torque(self, bent: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return the transmitted torque of deflections (T,) and their rates."""
        half = self.gap / 2.0
        touching = np.abs(bent) >= half
        return self.stiffness * (bent - np.clip(bent, -half, half)) + self.damping * rate * touching
