"""Measurement, simulation and reference of a recording through the same filters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dynident.closed_loop import Controller
from dynident.diagnose.control_law import law_torque
from dynident.diagnose.loop_run import QUANTITIES, LoopRun, Signals
from dynident.diagnose.noise import differences
from dynident.errors import RecordingError
from dynident.fit.sampling import Sampled, sample
from dynident.model import Model
from dynident.recording import Dataset, Noise, Recording, mismatch, periods

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
    return LoopRun(
        recording.name,
        measured.t,
        _signals(measured),
        _signals(simulated),
        _signals(reference),
        _noise(recording, measured, dataset),
        np.asarray(again.saturated, dtype=float),
    )


def _signals(sampled: Sampled) -> Signals:
    return Signals(sampled.q, sampled.v, sampled.a, sampled.tau)


def _noise(recording: Recording, measured: Sampled, dataset: Dataset) -> np.ndarray | None:
    """Noise of the measured quantities, rms (4, n): of repeated periods, else as stated."""
    signals = _signals(measured)
    if recording.period is not None:
        try:
            found = periods(len(measured.t), measured.rate_hz, recording.period, recording.where)
        except RecordingError:
            found = None
        if found is not None and mismatch(found.fold(measured.q)) <= _REPEATS:
            return np.array([_spread(found.fold(signals.of(one))) for one in QUANTITIES])
    if dataset.noise is None:
        return None
    noisy = _signals(sample(_with_noise(recording, dataset.noise), dataset.filter))
    return np.array(
        [np.sqrt(np.mean((noisy.of(x) - signals.of(x)) ** 2, axis=0)) for x in QUANTITIES]
    )


def _spread(folded: np.ndarray) -> np.ndarray:
    """Root mean square (n,) of what differs from period to period, (P, S, n)."""
    n = folded.shape[2]
    return np.array(
        [np.sqrt(np.mean(differences(folded[..., j], "repeated") ** 2)) for j in range(n)]
    )


def _with_noise(recording: Recording, noise: Noise) -> Recording:
    """Return a recording with one more draw of the stated noise, always the same."""
    stream = np.random.default_rng(0)
    q = recording.q + noise.position_std * stream.standard_normal(recording.q.shape)
    tau = recording.tau + noise.torque_std * stream.standard_normal(recording.tau.shape)
    return recording.replace(q=q, tau=tau)
