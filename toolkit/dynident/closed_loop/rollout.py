"""What is to be simulated, and what comes of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.closed_loop.mechanism import Mechanism
from dynident.closed_loop.trajectories import Fourier

LEAD_IN = 2.0
"""s that a motion is simulated before it is recorded, for the loop to settle on it."""


@dataclass(frozen=True, eq=False)
class Task:
    """A mechanism that follows a trajectory.

    Attributes
    ----------
    mechanism : Mechanism
    trajectory : its phase is zero at the first sample.
    duration : s.
    start : s, when the first sample is taken in the session.
    rng : of the encoder's noise; None for none.
    name : for messages.
    """

    mechanism: Mechanism
    trajectory: Fourier
    duration: float
    start: float = 0.0
    rng: np.random.Generator | None = None
    name: str = ""


@dataclass(frozen=True, eq=False)
class Rollout:
    """A simulated motion, at the controller's samples.

    Attributes
    ----------
    t : (T,) s, from the first sample.
    q, v : (T, n) true position and velocity, rad or m.
    q_measured : (T, n) position as the encoder gives it.
    q_ref, v_ref : (T, n) reference.
    u : (T, n) command, held from its sample to the next; N m or N.
    u_before : (n,) command held until the first sample.
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    q_measured: np.ndarray
    q_ref: np.ndarray
    v_ref: np.ndarray
    u: np.ndarray
    u_before: np.ndarray
