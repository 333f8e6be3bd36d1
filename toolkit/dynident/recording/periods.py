"""Repetitions of one period side by side, for noise floors and instruments."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dynident.errors import RecordingError

_DRIFT = 0.1
"""Rows by which the last repetition may be out of step with the first."""
_REPEATS = 0.3
"""Difference of two repetitions, relative to the motion, above which nothing repeats."""


@dataclass(frozen=True, eq=False)
class Periods:
    """Which rows of a record are the same instants of a repeated excitation.

    Attributes
    ----------
    index : (P, S) rows; a column holds the same phase in each of the P repetitions.
    rows_per_period : rows in a whole period; S is this, or less where the ends of the record
        (edges that were dropped, say) leave a part of every period without a partner.
    """

    index: np.ndarray
    rows_per_period: int

    @property
    def count(self) -> int:
        """Number of repetitions, P."""
        return self.index.shape[0]

    @property
    def rows(self) -> int:
        """Rows in each repetition, S."""
        return self.index.shape[1]

    def fold(self, x: np.ndarray) -> np.ndarray:
        """Rows of a record as repetitions, (T, ...) -> (P, S, ...)."""
        return x[self.index]


def periods(samples: int, rate_hz: float, period: float, where: str | None = None) -> Periods:
    """Fold a record, as a rule its decimated rows, into repetitions of a period.

    Repetitions are counted from the end, since a motion is least settled where it starts. Two
    ways are open: whole periods only, or one repetition more, where each lacks the same part of
    the period; the one that uses more rows is taken. (16 s with a period of 8 s and 0.05 s dropped
    at each end are 2 repetitions of 7.9 s; 20 s are 2 of 8 s.)

    Parameters
    ----------
    samples : rows, T.
    rate_hz : their rate; a period must be a whole number of them, as with `ParallelFilter`.
    period : s.
    where : file, for messages.

    Returns
    -------
    Periods

    Raises
    ------
    RecordingError
        If the rows are too few for two repetitions of at least half a period each, or a period is
        no whole number of rows.
    """
    exact = period * rate_hz
    whole = round(exact)
    if whole < 2:
        raise RecordingError(
            f"a period of {period:g} s is {exact:.3g} samples at {rate_hz:.6g} Hz",
            where,
            "is it given in s?",
        )
    full, rest = divmod(samples, whole)
    count, length = full, whole
    if rest >= whole / 2 and (full == 1 or (full + 1) * rest > full * whole):
        count, length = full + 1, rest
    if count < 2:
        raise RecordingError(
            f"{samples / rate_hz:.4g} s that are used hold no two periods of {period:g} s",
            where,
            "record longer, raise the cut-offs in [filter] (low ones take rows at the ends), or "
            "leave the period out",
        )
    if abs(exact - whole) * (count - 1) > _DRIFT:
        raise RecordingError(
            f"a period of {period:g} s is {exact:.6g} samples at {rate_hz:.6g} Hz, no whole number",
            where,
            "resample the recording with `uniform`, which heeds its period",
        )
    first = samples - (count - 1) * whole - length
    starts = first + whole * np.arange(count)
    return Periods(starts[:, None] + np.arange(length), whole)


def mismatch(folded: np.ndarray) -> float:
    """How far repetitions differ, relative to how far the signal moves.

    Parameters
    ----------
    folded : (P, S, ...) as from `Periods.fold`.

    Returns
    -------
    0 for an exact repetition, about 1 for a signal that does not repeat; 0 if nothing moves.
    """
    centred = folded - folded.mean(axis=(0, 1))
    moved = float(np.sum(centred**2))
    differs = float(np.sum((folded - folded.mean(axis=0)) ** 2)) * len(folded) / (len(folded) - 1)
    return math.sqrt(differs / moved) if moved else 0.0


def require_repetition(q: np.ndarray, found: Periods, where: str | None = None) -> None:
    """Refuse a period with which the positions do not repeat.

    Parameters
    ----------
    q : (T, n) positions, the rows that were folded.
    found : the repetitions.
    where : file, for messages.

    Raises
    ------
    RecordingError
        If two repetitions differ by more than 30 % of the motion; the message names the time
        after which the motion does repeat, if there is one.
    """
    if (off := mismatch(found.fold(q))) <= _REPEATS:
        return
    samples = _repeats_after(q - q.mean(axis=0))
    hint = ""
    if samples is not None:
        hint = f"; they do after {samples / found.rows_per_period:.4g} times that period"
    raise RecordingError(
        "the positions do not repeat with the given period (its repetitions differ by "
        f"{100 * off:.0f} % of the motion){hint}",
        where,
        "correct the period, or leave it out",
    )


def _repeats_after(x: np.ndarray) -> int | None:
    """Rows after which a motion (T, n) of zero mean repeats to 10 %, if it does."""
    samples = len(x)
    power = np.sum(x**2, axis=1)
    ahead = np.cumsum(power)[::-1]
    behind = np.cumsum(power[::-1])[::-1]
    size = 2 * samples
    spectrum = np.abs(np.fft.rfft(x, size, axis=0)) ** 2
    correlation = np.fft.irfft(spectrum.sum(axis=1), size)[:samples]
    # Squared difference of the motion and itself, shifted, over twice its power.
    differs = (ahead + behind - 2 * correlation) / np.maximum(ahead + behind, 1e-300)
    left = int(np.argmax(differs > 0.5))
    lags = differs[left : samples * 2 // 3]
    if not left or not len(lags) or lags.min() > 0.01:
        return None
    # The first dip as deep as the deepest: later ones are multiples of it.
    start = int(np.argmax(lags <= max(2 * lags.min(), 1e-4)))
    dip = lags[start:]
    stop = int(np.argmax(dip > 0.02)) or len(dip)
    return left + start + int(np.argmin(dip[:stop]))
