"""What instruments are to the estimator, wherever they come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from dynident.model import Model
from dynident.recording import Dataset, uniform, without_ends

ProgressCallback = Callable[[str, float, float], None]
"""(what is being done, how much is done, how much there is to do)."""


def silent(what: str, done: float, total: float) -> None:
    """Show no progress.

    Parameters
    ----------
    what, done, total : as of `ProgressCallback`.
    """


@dataclass(frozen=True, eq=False)
class Guess:
    """What is known before the first iteration.

    Attributes
    ----------
    start : (p,) where the iterations begin.
    others : (p,) values that may be nearer to the truth where the start is none, best first.
    progress : see `ProgressCallback`.
    """

    start: np.ndarray
    others: tuple[np.ndarray, ...] = ()
    progress: ProgressCallback = field(default=silent)


class InstrumentSource(Protocol):
    """Instruments of some recordings, made anew at each estimate if they depend on it.

    Attributes
    ----------
    measured : recordings on a uniform clock, their windows without what is transient.
    notes : caveats.
    noise_share : variance of (measured - instrument) position over that of the encoder's noise.
    iterates : whether the instruments depend on the estimate.
    """

    @property
    def measured(self) -> Dataset: ...

    @property
    def notes(self) -> tuple[str, ...]: ...

    @property
    def noise_share(self) -> float: ...

    @property
    def iterates(self) -> bool: ...

    def at(self, values: np.ndarray) -> Dataset:
        """Return the instruments of an estimate: `measured` with other positions.

        Raises
        ------
        SimulationError
            If the estimate cannot be simulated.
        """
        ...

    def verdict(self) -> str:
        """Return what speaks against the last instruments, in words; empty if nothing does."""
        ...


class Instruments(Protocol):
    """A choice of instruments: a frozen dataclass of its settings. A new one is such a class."""

    @property
    def name(self) -> str:
        """In words."""
        ...

    def prepare(self, model: Model, dataset: Dataset, guess: Guess) -> InstrumentSource:
        """Return the instruments of recordings.

        Parameters
        ----------
        model : whose columns are to be instrumented.
        dataset : the recordings as measured, with their filter.
        guess : where the iterations begin.

        Raises
        ------
        FitError, RecordingError, SimulationError
            If the recordings cannot have such instruments.
        """
        ...


def prepared(dataset: Dataset) -> Dataset:
    """Return the recordings on uniform clocks, without the ends of the filters.

    Instruments then have the same time stamps. Measured and simulated motion end differently: ends
    that a published recipe keeps are of no use here.
    """
    recordings = tuple(uniform(recording) for recording in dataset.recordings)
    return replace(without_ends(dataset), recordings=recordings)
