"""Instrumental variables: estimates that are right although the positions are noisy."""

from dynident.fit.history import Convergence, Ending, Round
from dynident.fit.instrumental.estimator import IV
from dynident.fit.instrumental.filtered import Filtered
from dynident.fit.instrumental.periods import SwappedPeriods
from dynident.fit.instrumental.simulated import SimulatedLoop
from dynident.fit.instrumental.source import Instruments

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
