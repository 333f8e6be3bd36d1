"""Instrumental variables: estimates that are right although the positions are noisy."""

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
