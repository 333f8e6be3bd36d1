"""Instruments from the measurement itself: its other periods, or filtered far more strongly.

In: recordings. Out: the same recordings with other positions, once and for all estimates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from dynident.errors import FitError
from dynident.fitting.instrumental.source import Guess, Instruments, InstrumentSource, prepared
from dynident.model import Model
from dynident.recording import (
    SIGNALS,
    Dataset,
    Recording,
    as_points,
    lowpass,
    periods,
    require_repetition,
    turning_round,
    turns_between,
)


@dataclass(frozen=True, eq=False, kw_only=True)
class FixedInstruments:
    """Instruments that do not depend on the estimate; see `InstrumentSource`."""

    measured: Dataset
    instruments: Dataset
    notes: tuple[str, ...]
    noise_share: float
    iterates: bool = False

    def at(self, values: np.ndarray) -> Dataset:
        """Return the instruments."""
        return self.instruments

    def verdict(self) -> str:
        """Return nothing: there is no loop to doubt."""
        return ""


@dataclass(frozen=True)
class Filtered(Instruments):
    """The measured positions through a low-pass far below the filter of the regressor.

    What noise lies below the cut-off is common to both sides and still biases the estimate; what
    lies above no longer does. For recordings that neither repeat nor have a known controller.

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
        return FixedInstruments(
            measured=measured,
            instruments=replace(measured, recordings=tuple(smooth)),
            notes=notes,
            noise_share=1.0,
        )


@dataclass(frozen=True)
class SwappedPeriods(Instruments):
    """The mean of the other periods in place of each period.

    Noise of one period is independent of that of the others, so what was measured in these is an
    instrument for it. Nothing needs to be known of the controller.
    """

    @property
    def name(self) -> str:
        """In words."""
        return "swapped periods"

    def prepare(self, model: Model, dataset: Dataset, guess: Guess) -> InstrumentSource:
        """Return the recordings that repeat, and their instruments.

        Raises
        ------
        FitError
            If no recording states a period.
        """
        stated = [r for r in prepared(dataset).recordings if r.period is not None]
        if not stated:
            remedy = "state the period of a recording, or choose other instruments"
            raise FitError("no recording repeats with a known period", "instruments", remedy)
        skipped = [r.where for r in dataset.recordings if r.period is None]
        pairs = [_swapped(one) for one in stated]
        notes = ("Instruments: the other periods of each recording.",)
        if skipped:
            notes += (f"Without a period, and left out: {', '.join(skipped)}.",)
        measured = replace(dataset, recordings=tuple(one for one, _ in pairs))
        instruments = replace(dataset, recordings=tuple(other for _, other in pairs))
        share = float(np.mean([1.0 + 1.0 / (_count(one) - 1) for one in stated]))
        return FixedInstruments(
            measured=measured, instruments=instruments, notes=notes, noise_share=share
        )


def _count(recording: Recording) -> int:
    assert recording.period is not None
    return periods(recording.samples, recording.rate_hz, recording.period, recording.where).count


def _swapped(recording: Recording) -> tuple[Recording, Recording]:
    """Return the whole periods of a recording, and the same rows from the other periods."""
    assert recording.period is not None
    rate, where = recording.rate_hz, recording.where
    whole = round(recording.period * rate)
    count = recording.samples // whole
    if count < 2:
        remedy = "record two periods or more, or choose other instruments"
        raise FitError(f"it holds no two whole periods of {recording.period:g} s", where, remedy)
    found = periods(count * whole, rate, recording.period, where)
    # Counted from the end, where the transient has decayed furthest.
    rows = slice(recording.samples - count * whole, recording.samples)
    folded = found.fold(recording.q[rows])
    turning = turning_round(recording)
    require_repetition(as_points(recording.q[rows], turning), found, where)
    turns = turns_between(folded, turning)
    folded = folded - turns  # the mean of angles that are whole turns apart may be any angle
    others = (folded.sum(axis=0) - folded) / (count - 1) + turns
    own = recording.replace(
        **{
            name: None if (x := getattr(recording, name)) is None else x[rows]
            for name in ("t", *SIGNALS)
        }
    )
    return own, own.replace(q=others.reshape(own.q.shape), v=None, a=None)
