"""Instrumental variables: estimates that are right although the positions are noisy.

In: a model, recordings, and a choice of `Instruments` (the simulated loop, the other periods, or
filtered measurements). Out: an estimate with the history of its iterations and a covariance that
carries the noise of encoders and torque. Janot, Vandanjon and Gautier, "An instrumental variable
approach for rigid industrial robots identification" (preprint 2010).
"""

from dynident.fitting.history import Convergence, Ending, Round
from dynident.fitting.instrumental.estimator import IV
from dynident.fitting.instrumental.measured_instruments import Filtered, SwappedPeriods
from dynident.fitting.instrumental.simulated_loop import SimulatedLoop
from dynident.fitting.instrumental.source import Instruments

__all__ = [
    "IV",
    "Convergence",
    "Ending",
    "Filtered",
    "Instruments",
    "Round",
    "SimulatedLoop",
    "SwappedPeriods",
]
