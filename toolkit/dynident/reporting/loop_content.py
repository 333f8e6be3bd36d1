"""What the pictures of a simulated loop show, whichever library draws them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dynident.reporting.content import kept_of
from dynident.validation.loop_errors import QUANTITIES, LoopRun, Quantity
from dynident.validation.validation_result import Validation

REFERENCE_COLOUR = "#2e8b57"
MEASURED = "measured"
SIMULATED = "simulated"


@dataclass(frozen=True, eq=False, kw_only=True)
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
        names = ("t", "measured", "simulated", "yardstick")
        return replace(self, **{name: getattr(self, name)[kept] for name in names})


def loop_trace(validation: Validation, run: LoopRun, joint: int, quantity: Quantity) -> LoopTrace:
    """Return what is drawn of one quantity.

    Parameters
    ----------
    validation : for the units.
    run : one of its recordings.
    joint : place of the joint.
    quantity : "position", "velocity", "acceleration" or "torque".

    Returns
    -------
    The signals in their units.
    """
    unit = validation.units[joint]
    units = {
        "position": unit,
        "velocity": f"{unit}/s",
        "acceleration": f"{unit}/s\u00b2",
        "torque": validation.torque_units[joint],
    }
    noise = None if run.noise is None else float(run.noise[QUANTITIES.index(quantity), joint])
    return LoopTrace(
        quantity=quantity,
        unit=units[quantity],
        t=run.t,
        measured=run.measured.of(quantity)[:, joint],
        simulated=run.simulated.of(quantity)[:, joint],
        yardstick=run.reference.of(quantity)[:, joint],
        yardstick_name="by the control law" if quantity == "torque" else "reference",
        noise=noise,
    )
