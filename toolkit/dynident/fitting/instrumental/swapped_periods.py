"""Instruments from repetition: the other periods of the same excitation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dynident.errors import FitError
from dynident.fitting.instrumental.source import FixedInstruments, Guess, InstrumentSource, prepared
from dynident.model import Model
from dynident.recording import SIGNALS, Dataset, Recording, periods, require_repetition


@dataclass(frozen=True)
class SwappedPeriods:
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
        told = [r for r in prepared(dataset).recordings if r.period is not None]
        if not told:
            remedy = "state the period of a recording, or choose other instruments"
            raise FitError("no recording repeats with a known period", "instruments", remedy)
        skipped = [r.where for r in dataset.recordings if r.period is None]
        pairs = [_swapped(one) for one in told]
        notes = ("Instruments: the other periods of each recording.",)
        if skipped:
            notes += (f"Without a period, and left out: {', '.join(skipped)}.",)
        measured = replace(dataset, recordings=tuple(one for one, _ in pairs))
        instruments = replace(dataset, recordings=tuple(other for _, other in pairs))
        share = float(np.mean([1.0 + 1.0 / (_count(one) - 1) for one in told]))
        return FixedInstruments(measured, instruments, notes, share)


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
    # Counted from the end, where the motion is settled best.
    rows = slice(recording.samples - count * whole, recording.samples)
    folded = found.fold(recording.q[rows])
    require_repetition(recording.q[rows], found, where)
    others = (folded.sum(axis=0) - folded) / (count - 1)
    own = recording.replace(
        **{
            name: None if (x := getattr(recording, name)) is None else x[rows]
            for name in ("t", *SIGNALS)
        }
    )
    return own, own.replace(q=others.reshape(own.q.shape), v=None, a=None)
