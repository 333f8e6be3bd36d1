"""What the pictures of a simulated loop show, whichever library draws them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.errors import DynidentError
from dynident.reporting.content import kept_of
from dynident.validation.loop_run import QUANTITIES, LoopRun, Quantity
from dynident.validation.loop_validation import Validation

REFERENCE_COLOUR = "#2e8b57"
MEASURED = "measured"
SIMULATED = "simulated"


@dataclass(frozen=True, eq=False)
class LoopTrace:
    """One quantity of one joint in one recording, (T,) each, SI units.

    Attributes
    ----------
    quantity, unit, t : what is drawn, and s.
    measured, simulated : of the recording, and of the identified robot in its loop.
    yardstick : the reference; of the torque, what the control law gives.
    yardstick_name : its name in the legend.
    noise : rms of the measurement's noise; None where it is unknown.
    """

    quantity: Quantity
    unit: str
    t: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray
    yardstick: np.ndarray
    yardstick_name: str
    noise: float | None

    def thinned(self, points: int) -> LoopTrace:
        """The same picture with about so many samples at most; extremes are kept."""
        differences = (self.measured - self.simulated, self.measured - self.yardstick)
        kept = kept_of((self.measured, *differences), points)
        return LoopTrace(
            self.quantity,
            self.unit,
            self.t[kept],
            self.measured[kept],
            self.simulated[kept],
            self.yardstick[kept],
            self.yardstick_name,
            self.noise,
        )


def loop_trace(validation: Validation, run: LoopRun, joint: int, quantity: Quantity) -> LoopTrace:
    """Return what is drawn of one quantity."""
    unit = validation.units[joint]
    units = {
        "position": unit,
        "velocity": f"{unit}/s",
        "acceleration": f"{unit}/s\u00b2",
        "torque": validation.torque_units[joint],
    }
    noise = None if run.noise is None else float(run.noise[QUANTITIES.index(quantity), joint])
    return LoopTrace(
        quantity,
        units[quantity],
        run.t,
        run.measured.of(quantity)[:, joint],
        run.simulated.of(quantity)[:, joint],
        run.reference.of(quantity)[:, joint],
        "by the control law" if quantity == "torque" else "reference",
        noise,
    )


def run_of(validation: Validation, recording: str | None = None) -> LoopRun:
    """Return the run of a recording; the first without its name.

    Raises
    ------
    DynidentError
        If the loop of no recording, or not of this one, was simulated.
    """
    if not validation.runs:
        raise DynidentError("no loop was simulated, so that there is nothing to draw")
    for run in validation.runs:
        if recording in (None, run.name):
            return run
    valid = ", ".join(run.name for run in validation.runs)
    raise DynidentError("was not simulated", f"recording '{recording}'", f"recordings: {valid}")


def joint_of(validation: Validation, joint: str) -> int:
    """Return the place of a joint.

    Raises
    ------
    DynidentError
        If there is no such joint.
    """
    if joint not in validation.joints:
        valid = ", ".join(validation.joints)
        raise DynidentError(f"no joint '{joint}'", remedy=f"joints: {valid}")
    return validation.joints.index(joint)
