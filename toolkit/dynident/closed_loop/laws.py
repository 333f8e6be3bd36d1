"""The laws of feedback that a controller may have: a new kind is one entry of `LAWS`.

Every law is a torque (or, through the model, an acceleration) that is linear in the errors of
position, of its integral and of velocity. What a kind adds is how its gains make these three, and
whether the result goes through the nominal robot.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from dynident.closed_loop.controllers import Controller


@dataclass(frozen=True, eq=False)
class Feedback:
    """position (q_ref - q) + integral (its integral) + speed (follow v_ref - v).

    Attributes
    ----------
    position, integral, speed : (n,) gains, in N m/rad, N m/(rad s) and N m s/rad (N/m, ... for
        prismatic joints); of a law through the model 1/s^2, 1/s^3 and 1/s.
    follow : 1 where the reference's velocity is followed, else 0.
    """

    position: np.ndarray
    integral: np.ndarray
    speed: np.ndarray
    follow: float


@dataclass(frozen=True)
class Law:
    """One kind of controller.

    Attributes
    ----------
    gains : the names of its gains.
    powers : of a natural frequency that each gain goes with, its damping kept.
    feedback : what they make of the errors.
    through_model : whether the feedback is an acceleration, to which that of the reference is
        added before the nominal robot's inverse dynamics turns it into a torque.
    """

    gains: tuple[str, ...]
    powers: tuple[int, ...]
    feedback: Callable[[Controller], Feedback]
    through_model: bool = False


def _parallel(controller: Controller) -> Feedback:
    kp, kd = np.array(controller.kp), np.array(controller.kd)
    ki = np.array(controller.ki) if controller.ki else np.zeros(len(kp))
    return Feedback(kp, ki, kd, float(controller.velocity_reference))


def _cascade(controller: Controller) -> Feedback:
    # kv (kp e - v) is a PD law without reference velocity.
    kp, kv = np.array(controller.kp), np.array(controller.kv)
    return Feedback(kv * kp, np.zeros(len(kp)), kv, 0.0)


LAWS: dict[str, Law] = {
    "pd": Law(("kp", "kd"), (2, 1), _parallel),
    "pid": Law(("kp", "ki", "kd"), (2, 3, 1), _parallel),
    "cascade": Law(("kp", "kv"), (1, 1), _cascade),
    "computed_torque": Law(("kp", "kd"), (2, 1), _parallel, through_model=True),
}
"""The kinds by name."""
GAINS = tuple(dict.fromkeys(name for law in LAWS.values() for name in law.gains))
"""The names of all gains."""
