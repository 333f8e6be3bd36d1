"""Instruments from the simulated closed loop (Janot, Vandanjon and Gautier, IDIM-IV, 2010)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dynident.closed_loop import Controller
from dynident.errors import FitError
from dynident.fitting.instrumental.loop_source import LoopSource
from dynident.fitting.instrumental.source import Guess, prepared
from dynident.model import Model
from dynident.recording import Dataset
from dynident.robot import Robot


@dataclass(frozen=True)
class SimulatedLoop:
    """The robot of the last estimate in the recording's own closed loop.

    The simulated motion has no noise, and is as good an instrument as it is near to the true
    motion. Only the regressor comes from it: the torque stays the measured one.

    Attributes
    ----------
    controller : of the recorded loop: its structure must be the real one's.
    natural_frequency_hz : (n,) or one number; poles that the simulated loop keeps, with the damping
        of the stated gains: at each iteration its gains belong to the inertia of the estimate
        (equations 45 to 47). None: the gains as stated, which are the real loop's; only those of
        the start, if its inertia is not the believed one, are in proportion.
    lift : how base parameters become bodies: "minimum_norm" (nearest to the description, possible
        or not) or "consistent" (the nearest possible robot).
    nominal : the robot inside a computed torque or a feed-forward; None: the description.
    """

    controller: Controller
    natural_frequency_hz: float | Sequence[float] | None = None
    lift: Literal["minimum_norm", "consistent"] = "minimum_norm"
    nominal: Robot | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.controller, Controller):
            what = f"a {type(self.controller).__name__} where a Controller is needed"
            remedy = "give the study's: di.IV(study.controller); it needs a [controller] table"
            raise FitError(what, "instruments", remedy)
        if self.lift not in ("minimum_norm", "consistent"):
            remedy = 'choose "minimum_norm" or "consistent"'
            raise FitError(f"lift = {self.lift!r}", "instruments", remedy)
        if self.natural_frequency_hz is not None:
            given = np.atleast_1d(np.asarray(self.natural_frequency_hz, dtype=float))
            if given.shape not in ((1,), (self.controller.n,)) or not np.all(given > 0):
                remedy = "give one positive number, or one per joint"
                raise FitError(f"natural_frequency_hz = {given.tolist()}", "instruments", remedy)

    @property
    def name(self) -> str:
        """In words."""
        return "simulated closed loop"

    def prepare(self, model: Model, dataset: Dataset, guess: Guess) -> LoopSource:
        """Return the loop of a robot, ready to be simulated at any estimate.

        Raises
        ------
        FitError
            If a recording is shorter than the transient.
        SimulationError
            If a recording has no reference, or the controller does not suit the robot.
        """
        return LoopSource(self, model, prepared(dataset), guess)
