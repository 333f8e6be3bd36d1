"""Measurement, simulation and reference of a recording through the same filters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dynident.closed_loop import Controller
from dynident.diagnose.control_law import law_torque
from dynident.diagnose.loop_run import QUANTITIES, LoopRun, Signals
from dynident.errors import RecordingError
from dynident.fit.sampling import LEAST_ROWS, Sampled, sample
from dynident.model import Model
from dynident.recording import Dataset, Noise, Recording, away_from_edges, mismatch, periods

if TYPE_CHECKING:
    from dynident.closed_loop.retrace import Retraced

_REPEATS = 0.3
"""Mismatch of two periods, relative to the motion, above which nothing repeats."""


def filtered_run(
    recording: Recording,
    again: Retraced,
    controller: Controller,
    model: Model,
    dataset: Dataset,
    settling: float,
) -> LoopRun:
    """Pass measurement, simulation and reference through the same filters."""
    assert recording.q_ref is not None
    first = recording.t[0] + settling
    window = (first, np.inf)
    if recording.window is not None:
        window = (max(first, recording.window[0]), recording.window[1])
    if not window[0] < window[1]:
        raise RecordingError("its window ends before the loop has settled", recording.where)
    recording = recording.replace(window=window)
    measured = sample(recording, dataset.filter)
    simulated = sample(again.recording.replace(window=window), dataset.filter)
    law = law_torque(recording, controller, model.robot)
    reference = sample(recording.replace(q=recording.q_ref, tau=law), dataset.filter)
    kept = _inside(measured)
    return LoopRun(
        recording.name,
        measured.t[kept],
        _signals(measured, kept),
        _signals(simulated, kept),
        _signals(reference, kept),
        _noise(recording, dataset, kept),
        np.asarray(again.saturated, dtype=float),
    )


def _inside(sampled: Sampled) -> np.ndarray:
    """Rows for which the filter saw nothing beyond the record's ends, (T,) bool.

    There it makes up what it does not know from the last sample, noise and all. A record too short
    for that keeps every row.
    """
    inside = away_from_edges(sampled.motion.t, sampled.parallel.transient)
    first, last = sampled.motion.t[inside][[0, -1]] if inside.any() else (np.inf, -np.inf)
    kept = (sampled.t >= first) & (sampled.t <= last)
    return kept if kept.sum() >= LEAST_ROWS else np.ones(len(kept), dtype=bool)


def _signals(sampled: Sampled, kept: np.ndarray) -> Signals:
    return Signals(sampled.q[kept], sampled.v[kept], sampled.a[kept], sampled.tau[kept])


def _noise(recording: Recording, dataset: Dataset, kept: np.ndarray) -> np.ndarray | None:
    """Noise of the measured quantities, rms (4, n): of repeated periods, else as stated.

    The noise alone passes the filters, so that nothing of what they do to the motion at the ends
    of the record is taken for noise.
    """
    alone = _repeated(recording) or _stated(recording, dataset.noise)
    if alone is None:
        return None
    noise = _signals(sample(alone, dataset.filter), kept)
    return np.array([np.sqrt(np.mean(noise.of(one) ** 2, axis=0)) for one in QUANTITIES])


def _repeated(recording: Recording) -> Recording | None:
    """Return what differs from period to period within the recording's window, if it repeats."""
    if recording.period is None:
        return None
    low, high = recording.window or (-np.inf, np.inf)
    inside = np.flatnonzero((recording.t >= low) & (recording.t < high))
    try:
        found = periods(len(inside), recording.rate_hz, recording.period, recording.where)
    except RecordingError:
        return None
    rows = inside[found.index]
    if mismatch(recording.q[rows]) > _REPEATS:
        return None
    grown = np.sqrt(found.count / (found.count - 1))
    changes = {}
    for name in ("q", "tau"):
        measured = getattr(recording, name)
        folded = measured[rows]
        noise = np.zeros_like(measured)
        noise[rows] = (folded - folded.mean(axis=0)) * grown
        changes[name] = noise
    return recording.replace(**changes)


def _stated(recording: Recording, noise: Noise | None) -> Recording | None:
    """Return a draw of the stated noise, always the same."""
    if noise is None:
        return None
    stream = np.random.default_rng(0)
    q = noise.position_std * stream.standard_normal(recording.q.shape)
    tau = noise.torque_std * stream.standard_normal(recording.tau.shape)
    return recording.replace(q=q, tau=tau)
