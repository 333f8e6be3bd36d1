"""A recorded loop and its simulation side by side, and the errors between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from dynident.tables import finite

Quantity = Literal["position", "velocity", "acceleration", "torque"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)

Status = Literal["no_reference", "too_short", "failed"]


@dataclass(frozen=True, eq=False)
class Signals:
    """A motion and its torque, filtered and decimated, (T, n) each, SI units.

    Attributes
    ----------
    position, velocity, acceleration : rad or m, and per s and s^2.
    torque : N m or N.
    """

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    torque: np.ndarray

    def of(self, quantity: Quantity) -> np.ndarray:
        """One of them, (T, n)."""
        return getattr(self, quantity)


@dataclass(frozen=True, eq=False)
class LoopRun:
    """A recording and the simulation of its loop, at the same instants.

    Attributes
    ----------
    name : of the recording.
    t : (T,) s, on the recording's clock.
    measured, simulated : what was recorded, and what the identified robot did.
    reference : the reference motion; its torque is what the control law gives for the recorded
        positions, no model of the robot involved.
    noise : (4, n) noise of the measured quantities, rms; None where it is unknown.
    saturated : (n,) share of the samples at which the simulated command was at its limit.
    law_terms : (n,) N m or N, what the gains of the control law make of the errors, each on its
        own: root of the sum of their mean squares. Larger than the torque where they cancel.
    encoder_noise : (n,) rad or m, rms; from what the simulation leaves of the measured positions.
    """

    name: str
    t: np.ndarray
    measured: Signals
    simulated: Signals
    reference: Signals
    noise: np.ndarray | None
    saturated: np.ndarray
    law_terms: np.ndarray
    encoder_noise: np.ndarray


@dataclass(frozen=True)
class Skipped:
    """A recording whose loop was not simulated, and why.

    Attributes
    ----------
    name : of the recording.
    status : "no_reference" (it has no column q_ref), "too_short" (the loop settles after its end)
        or "failed" (the loop cannot be simulated).
    reason : in words.
    """

    name: str
    status: Status
    reason: str


@dataclass(frozen=True, eq=False)
class Errors:
    """Norm of a difference over norm of the measurement, over all recordings.

    Attributes
    ----------
    joints : (4, n) joint by joint, rows in the order of `QUANTITIES`; NaN where a joint has no
        such quantity to measure.
    overall : (4,) of all joints together; where some are in rad and others in m, the root mean
        square of the joints' errors.
    """

    joints: np.ndarray
    overall: np.ndarray

    def of(self, quantity: Quantity) -> float:
        """The error over all joints in one quantity."""
        return float(self.overall[QUANTITIES.index(quantity)])

    def at(self, joint: int) -> dict[str, float | None]:
        """Errors of a joint by quantity, as JSON has them."""
        return _named(self.joints[:, joint])

    def to_dict(self) -> dict[str, float | None]:
        """Errors over all joints by quantity, as JSON has them."""
        return _named(self.overall)


def _named(values: np.ndarray) -> dict[str, float | None]:
    return {one: finite(float(x)) for one, x in zip(QUANTITIES, values, strict=True)}
