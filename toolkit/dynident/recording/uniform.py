"""Jittered time stamps: recordings onto a uniform clock."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from dynident.errors import DynidentWarning, RecordingError
from dynident.recording.recording import SIGNALS, Recording

TOLERANCE = 1e-3
"""Relative jitter up to which a recording counts as uniform."""
_LONGEST_GAP = (20, 0.05)
"""A gap is too long to be bridged if it exceeds both so many samples and so many s."""
_LONGEST_STALE = 5
"""Repeated rows in a run up to which they are a stale reading, not a robot at rest."""


def uniform(recording: Recording) -> Recording:
    """Return the recording on a uniform clock.

    Recordings with a jitter below 1e-3 are returned as they are, unless their period is no whole
    number of samples. Others are interpolated by cubic splines. Before that, rows that repeat
    every position, velocity and torque of the row before are dropped (runs of up to 5): they are
    the same reading logged twice, under a time stamp that is not its own. Longer runs are a robot
    at rest, and stay. Held commands are averaged over each new step instead, which keeps them
    held commands.

    Parameters
    ----------
    recording : T samples.

    Returns
    -------
    Recording
        At the mean rate, or the nearest at which the period is a whole number of samples.

    Raises
    ------
    RecordingError
        If a gap exceeds 20 samples and 0.05 s: what happened there cannot be guessed.

    Warns
    -----
    DynidentWarning
        If it was resampled, naming the jitter and how many rows were dropped. The spread of true
        sampling instants about their stamps becomes noise that no filter undoes.
    """
    jitter = recording.jitter
    jittered = jitter > TOLERANCE
    step = _step(recording)
    if not jittered and step is None:
        return recording
    fresh = _fresh(recording) if jittered else np.ones(recording.samples, dtype=bool)
    t = recording.t[fresh]
    _refuse_gaps(recording, np.flatnonzero(fresh))
    step = step or recording.duration / (recording.samples - 1)
    grid = t[0] + step * np.arange(int(np.floor((t[-1] - t[0]) / step * (1 + 1e-12))) + 1)
    signals = {
        signal: None
        if (x := getattr(recording, signal)) is None
        else _interpolated(t, x[fresh], grid)
        for signal in SIGNALS
    }
    if recording.torque == "held_command":
        signals["tau"] = _held(recording.t, recording.tau, grid)
    if jittered:
        why = f"the time stamps are jittered by {100 * jitter:.3g} % of a step"
        dropped = recording.samples - int(fresh.sum())
        if dropped:
            share = 100 * dropped / recording.samples
            why += f", and {dropped} rows ({share:.2g} %) repeat the reading before"
    else:
        why = f"the period of {recording.period:g} s is no whole number of samples"
    done = f"resampled to {1 / step:.6g} Hz"
    warnings.warn(f"{recording.where}: {why}; {done}", DynidentWarning, stacklevel=2)
    source = recording.provenance
    history = f"{source.filter}, {done}" if source.filter else done
    return recording.replace(t=grid, provenance=replace(source, filter=history), **signals)


def _interpolated(t: np.ndarray, x: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Splines of x (T, n) at other times; columns that are not recorded stay so."""
    found = np.full((len(grid), x.shape[1]), np.nan)
    recorded = np.isfinite(x).all(axis=0)
    found[:, recorded] = CubicSpline(t, x[:, recorded])(grid)
    return found


def _step(recording: Recording) -> float | None:
    """Time step that makes the period a whole number of samples; None if it is one, or none."""
    if recording.period is None:
        return None
    exact = recording.period * recording.rate_hz
    whole = max(1, round(exact))
    repetitions = recording.duration / recording.period
    in_step = abs(exact - whole) * repetitions <= 0.25
    if in_step and recording.jitter <= TOLERANCE:
        return None
    return recording.period / whole


def _fresh(recording: Recording) -> np.ndarray:
    """Rows that are no repetition of the reading before."""
    signals = [x for name in ("q", "v", "a", "tau") if (x := getattr(recording, name)) is not None]
    readings = np.hstack(signals)
    same = np.concatenate([[False], (readings[1:] == readings[:-1]).all(axis=1)])
    edges = np.diff(np.concatenate([[0], same.astype(int), [0]]))
    for start, stop in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        if stop - start > _LONGEST_STALE:
            same[start:stop] = False
    return ~same


def _refuse_gaps(recording: Recording, rows: np.ndarray) -> None:
    gaps = np.diff(recording.t[rows])
    longest = int(np.argmax(gaps))
    samples = gaps[longest] * recording.rate_hz
    if samples > _LONGEST_GAP[0] and gaps[longest] > _LONGEST_GAP[1]:
        raise RecordingError(
            f"{gaps[longest]:.3g} s without samples follow (about {samples:.0f} are missing)",
            recording.row(int(rows[longest])),
            "split the recording there in two",
        )


def _held(t: np.ndarray, u: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Mean of a held command over each step of a new clock, exactly; (len(grid), n)."""
    impulse = np.concatenate(
        [np.zeros((1, u.shape[1])), np.cumsum(u[:-1] * np.diff(t)[:, None], 0)]
    )
    ends = np.append(grid, min(grid[-1] + (grid[-1] - grid[-2]), t[-1]))
    at = np.column_stack([np.interp(ends, t, column) for column in impulse.T])
    steps = np.diff(ends)[:, None]
    held = np.divide(
        np.diff(at, axis=0), steps, where=steps > 0, out=np.zeros((len(grid), u.shape[1]))
    )
    # The clock may end on the recording's last sample, whose command acts from there on.
    return np.where(steps > 0, held, u[-1])
