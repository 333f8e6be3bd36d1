"""The feedback that keeps the poles of an iterate's loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dynident.closed_loop import Controller

_POSES = 50


def poses_of(motions: Sequence[np.ndarray]) -> np.ndarray:
    """Return up to 50 poses (P, n), evenly spread over motions (T, n)."""
    stacked = np.concatenate(motions)
    return stacked[:: max(1, len(stacked) // _POSES)]


def stiffness(controller: Controller, nominal_inertias: np.ndarray) -> np.ndarray:
    """Feedback torque per position error, (n,) N m/rad or N/m.

    Parameters
    ----------
    controller : Controller
    nominal_inertias : (n,) of the joints, for a law whose feedback is an acceleration.
    """
    position = controller.feedback().position
    return position * nominal_inertias if controller.law.through_model else position


def retuned(controller: Controller, ratio: np.ndarray) -> Controller:
    """Return the controller with its natural frequencies times a ratio (n,), its damping kept.

    See Janot et al., equations 45 to 47: a proportional gain goes with the square of the natural
    frequency, a derivative gain with itself.
    """
    law = controller.law
    gains = {
        name: tuple(np.array(getattr(controller, name)) * ratio**power)
        for name, power in zip(law.gains, law.powers, strict=True)
    }
    return replace(controller, **gains)
