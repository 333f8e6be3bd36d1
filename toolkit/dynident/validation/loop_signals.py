"""Measurement, simulation and reference of a recording through the same filters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from dynident.closed_loop import Controller
from dynident.criteria import LoopCriteria
from dynident.errors import RecordingError
from dynident.fitting.sampling import Sampled, sample
from dynident.model import Model
from dynident.recording import (
    Dataset,
    Noise,
    Recording,
    as_points,
    mismatch,
    periods,
    turning_round,
    turns_between,
    within,
    without_ends,
)
from dynident.recording.white_noise import white_variance
from dynident.validation.control_law import law_torque
from dynident.validation.loop_errors import QUANTITIES, LoopRun, Signals

if TYPE_CHECKING:
    from dynident.closed_loop.retrace import Retraced


def filtered_run(
    recording: Recording,
    again: Retraced,
    controller: Controller,
    model: Model,
    dataset: Dataset,
    settling: float,
    criteria: LoopCriteria,
) -> LoopRun:
    """Pass measurement, simulation and reference through the same filters.

    Parameters
    ----------
    recording, again : as it was measured, and its loop as it was simulated.
    controller, model : of the simulated loop.
    dataset : for its filter and the stated noise.
    settling : s to drop at the start.
    criteria : of when periods repeat, for the noise.

    Returns
    -------
    The three at the same instants, with the noise of the measurement.

    Raises
    ------
    RecordingError
        If nothing is left after the settling time, or of the filters' transients.
    """
    assert recording.q_ref is not None
    # Measured and simulated motion end differently: ends that a recipe keeps are of no use here.
    dataset = without_ends(dataset)
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
    noise = _noise(
        recording, dataset, lambda one: law_torque(one, controller, model.robot), criteria
    )
    return LoopRun(
        name=recording.name,
        t=measured.t,
        measured=_signals(measured),
        simulated=_signals(simulated),
        reference=_signals(reference),
        noise=noise,
        saturated=np.asarray(again.saturated, dtype=float),
        law_terms=_law_terms(recording, law, controller, model, dataset),
        encoder_noise=_encoder_noise(recording, again.recording, dataset),
    )


def _law_terms(
    recording: Recording,
    law: np.ndarray,
    controller: Controller,
    model: Model,
    dataset: Dataset,
) -> np.ndarray:
    """What each gain makes of the errors, as one more of it would add to the torque, rms (n,)."""
    square = np.zeros(controller.n)
    free = replace(controller, limit=None)
    if controller.limit is not None:
        law = law_torque(recording, free, model.robot)
    for name in controller.law.gains:
        doubled = replace(free, **{name: tuple(2.0 * x for x in getattr(free, name))})
        term = law_torque(recording, doubled, model.robot) - law
        tau = sample(recording.replace(tau=term), dataset.filter).tau
        square += np.mean(tau**2, axis=0)
    return np.sqrt(square)


def _encoder_noise(recording: Recording, simulated: Recording, dataset: Dataset) -> np.ndarray:
    """Noise of the filtered positions, rms (n,), if that of the raw ones is white.

    From third differences of what the simulation leaves of them: the motion that an imperfect
    model misses is smooth, and leaves next to nothing in them.
    """
    rows = within(recording.t, *(recording.window or (-np.inf, np.inf)), recording.where)
    white = np.sqrt(white_variance((recording.q - simulated.q)[rows]))
    noise = Noise(white, np.zeros(recording.n))
    alone = _stated(recording, noise, lambda one: one.tau)
    assert alone is not None
    return np.sqrt(np.mean(sample(alone, dataset.filter).q ** 2, axis=0))


def _signals(sampled: Sampled, kept: slice | np.ndarray = slice(None)) -> Signals:
    return Signals(sampled.q[kept], sampled.v[kept], sampled.a[kept], sampled.tau[kept])


def _noise(
    recording: Recording,
    dataset: Dataset,
    law: Callable[[Recording], np.ndarray],
    criteria: LoopCriteria,
) -> np.ndarray | None:
    """Noise of the measured quantities, rms (4, n): of repeated periods, else as stated.

    The noise alone passes the filters, so that nothing of what they do to the motion at the ends
    of the record is taken for noise. Its mean is over the rows that repeat.
    """
    alone = _repeated(recording, criteria) or _stated(recording, dataset.noise, law)
    if alone is None:
        return None
    sampled = sample(alone, dataset.filter)
    there = alone.t[np.any(alone.q != 0, axis=1) | np.any(alone.tau != 0, axis=1)]
    kept = np.ones(len(sampled.t), dtype=bool)
    if len(there):
        folded = (sampled.t >= there[0]) & (sampled.t <= there[-1])
        kept = folded if folded.any() else kept
    noise = _signals(sampled, kept)
    return np.array([np.sqrt(np.mean(noise.of(one) ** 2, axis=0)) for one in QUANTITIES])


def _repeated(recording: Recording, criteria: LoopCriteria) -> Recording | None:
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
    turning = turning_round(recording)
    if mismatch(as_points(recording.q, turning)[rows]) > criteria.repeats:
        return None
    grown = np.sqrt(found.count / (found.count - 1))
    changes = {}
    for name in ("q", "tau"):
        measured = getattr(recording, name)
        folded = measured[rows]
        if name == "q":
            folded = folded - turns_between(folded, turning)
        noise = np.zeros_like(measured)
        noise[rows] = (folded - folded.mean(axis=0)) * grown
        changes[name] = noise
    return recording.replace(**changes)


def _stated(
    recording: Recording, noise: Noise | None, law: Callable[[Recording], np.ndarray]
) -> Recording | None:
    """Return a draw of the stated noise, always the same; the torque's with what the law makes."""
    if noise is None:
        return None
    stream = np.random.default_rng(0)
    q = noise.position_std * stream.standard_normal(recording.q.shape)
    tau = noise.torque_std * stream.standard_normal(recording.tau.shape)
    # The controller answers to the noise of the encoder with torque.
    answer = law(recording.replace(q=recording.q + q)) - law(recording)
    return recording.replace(q=q, tau=tau + answer)
