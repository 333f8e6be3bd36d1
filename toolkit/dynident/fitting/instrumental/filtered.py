"""Instruments from the measurement itself, filtered far more strongly."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from dynident.errors import FitError
from dynident.fitting.instrumental.source import FixedInstruments, Guess, InstrumentSource, prepared
from dynident.model import Model
from dynident.recording import Dataset, lowpass


@dataclass(frozen=True)
class Filtered:
    """The measured positions through a low-pass far below the filter of the regressor.

    What noise lies below the cut-off is common to both sides and still biases the estimate; what
    lies above no longer does. For recordings that neither repeat nor tell their controller.

    Attributes
    ----------
    cutoff_hz : of a zero-phase Butterworth filter of order 4.
    """

    cutoff_hz: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.cutoff_hz) and self.cutoff_hz > 0):
            raise FitError(f"cutoff_hz = {self.cutoff_hz!r}", "instruments", "choose it above 0")

    @property
    def name(self) -> str:
        """In words."""
        return f"measurements below {self.cutoff_hz:g} Hz"

    def prepare(self, model: Model, dataset: Dataset, guess: Guess) -> InstrumentSource:
        """Return the recordings and their instruments.

        Raises
        ------
        RecordingError
            If the cut-off does not suit a recording.
        """
        measured = prepared(dataset)
        smooth = [
            r.replace(q=lowpass(r.q, r.rate_hz, self.cutoff_hz, where=r.where), v=None, a=None)
            for r in measured.recordings
        ]
        notes = (
            f"Instruments: the measured positions below {self.cutoff_hz:g} Hz. Noise below that is "
            "common to both sides and still biases the estimate.",
        )
        return FixedInstruments(measured, replace(measured, recordings=tuple(smooth)), notes, 1.0)
