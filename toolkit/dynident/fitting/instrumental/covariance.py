"""The covariance of an instrumental variable estimate.

White encoder noise reaches the residual as a second difference: its rows are strongly correlated,
and the textbook covariance, which takes them as independent, is 20 to 100 times too wide. Here the
noise is carried to the estimate by the adjoint of what was done to it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dynident.fitting.instrumental.noise_level import NoiseLevel
from dynident.fitting.instrumental.normal_equations import InstrumentalSolution
from dynident.fitting.instrumental.torque_jacobians import torque_jacobians
from dynident.fitting.sampling import Sampled, sample
from dynident.fitting.uncertainty.cluster_sandwich import BlockScores, time_blocks
from dynident.model import Model
from dynident.recording import Dataset, central_difference, held_torque_adjoint, lowpass

_BLOCK = 8192


def carried_covariance(
    model: Model,
    values: np.ndarray,
    instruments: Dataset,
    solution: InstrumentalSolution,
    noise: NoiseLevel,
) -> np.ndarray:
    """Return the covariance (p, p) with the noise carried through derivatives and filters.

    C = G [sn^2 S'S + st^2 T'T] G' with G = (V' O^-1 W)^-1, Vw the weighted instruments behind the
    filters' adjoint, S = D2' M' Vw + D1' (dtau/dv)' Vw + (dtau/dq)' Vw for the encoders (D1 and D2
    the difference operators with the low-pass of the positions) and T the averaging of the torque.
    Derivatives are taken along the instruments' motion.

    Parameters
    ----------
    model : Model
    values : (p,) the estimate.
    instruments : recordings behind V.
    solution : the estimate's weights and inverse.
    noise : per raw sample.
    """
    kept = list(solution.basis.independent)
    total = np.zeros((len(kept), len(kept)))
    for recording in instruments.recordings:
        sampled = sample(recording, instruments.filter)
        for encoders, drives in _carried(model, values, sampled, solution.weights, kept, noise):
            for j in range(model.robot.n):
                total += noise.position_std[j] ** 2 * encoders[:, j].T @ encoders[:, j]
                total += noise.torque_std[j] ** 2 * drives[:, j].T @ drives[:, j]
    covariance = np.zeros((model.size, model.size))
    covariance[np.ix_(kept, kept)] = solution.gain @ total @ solution.gain.T
    return covariance


def textbook_covariance(
    model: Model, solution: InstrumentalSolution, variance: float
) -> np.ndarray:
    """Return the covariance (p, p) that takes the errors of the rows as independent.

    variance * (V' O^-1 W)^-1 V' O^-1 V (W' O^-1 V)^-1, the textbook's for independent rows.

    Parameters
    ----------
    model : of p parameters.
    solution : the estimate's inverse and instruments.
    variance : of a weighted row's error.
    """
    kept = list(solution.basis.independent)
    covariance = np.zeros((model.size, model.size))
    inner = solution.gain @ solution.crossed @ solution.gain.T
    covariance[np.ix_(kept, kept)] = variance * inner
    return covariance


def _carried(
    model: Model,
    values: np.ndarray,
    sampled: Sampled,
    weights: np.ndarray,
    kept: list[int],
    noise: NoiseLevel,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield what a unit of encoder and of torque noise does to V' O^-1 e, (T, n, r) each."""
    motion, parallel, rate = sampled.motion, sampled.parallel, sampled.motion.rate_hz
    cutoff, order = parallel.filter.position_cutoff_hz, parallel.filter.order
    # Each filter is passed twice: forth to the rows, and back.
    margin = 2 * parallel.overlap + (round(2 * rate / cutoff) if cutoff else 0) + 8 + order
    kept_rows = parallel.rows(motion.samples)[sampled.kept]
    known = sampled.whole_columns(model, values)
    for start in range(0, motion.samples, _BLOCK):
        stop = min(start + _BLOCK, motion.samples)
        first, last = max(0, start - margin), min(motion.samples, stop + margin)
        raw = slice(first, last)
        # Samples that are only differentiated: the first and the last rows have their noise.
        before = motion.first if start == 0 else 0
        after = sampled.recording.samples - motion.first - motion.samples
        after = after if stop == motion.samples else 0
        ends = ((before, after), (0, 0), (0, 0))
        core = slice(start - first, stop - first + before + after)
        block = model.with_regressor(sampled.block(model, raw))
        here = {label: own[raw] for label, own in known.items()}
        V = model.columns(block, values, here)[:, :, kept]
        weighted = np.zeros_like(V)
        taken = (kept_rows >= first) & (kept_rows < last)
        inside = kept_rows[taken] - first
        counting = sampled.counting[taken] * weights**2
        weighted[inside] = parallel.low_pass(V)[inside] * counting[:, :, None]
        back = parallel.low_pass(weighted)
        jacobians = torque_jacobians(model, values, block, noise.position_std * rate)
        acceleration, speed, position = (
            np.pad(jacobian.transpose(0, 2, 1) @ back, ends)
            for jacobian in (jacobians.by_a, jacobians.by_v, jacobians.by_q)
        )
        found = _differences(acceleration, rate, order) - speed
        found = _differences(found, rate, order) + position
        if cutoff:
            found = lowpass(found, rate, cutoff)
        torque = back = np.pad(back, ends)
        if sampled.recording.torque == "held_command":
            torque = held_torque_adjoint(back, order)
        yield found[core], torque[core]


def _differences(x: np.ndarray, rate: float, order: int) -> np.ndarray:
    """Minus the adjoint of central differences, which are antisymmetric.

    Of rows that are zero beyond both ends: the one-sided differences there belong to rows that are
    not used (see `source.prepared`).
    """
    padded = np.pad(x, ((order, order), (0, 0), (0, 0)))
    return central_difference(padded, rate, order)[order:-order]


def block_covariance(
    model: Model,
    values: np.ndarray,
    measured: Dataset,
    instruments: Dataset,
    solution: InstrumentalSolution,
) -> np.ndarray:
    """Return the covariance (p, p) from the scatter of V' O^-1 e between blocks of time.

    Parameters
    ----------
    model, values : (p,) the estimate.
    measured, instruments : recordings behind W and V.
    solution : the estimate's weights and inverse.
    """
    kept, weights = list(solution.basis.independent), solution.weights**2
    scores, recordings = BlockScores(len(kept)), len(measured.recordings)
    for one, other in zip(measured.recordings, instruments.recordings, strict=True):
        own, instrument = sample(one, measured.filter), sample(other, instruments.filter)
        blocks, first, start = time_blocks(own, recordings), scores.count, 0
        columns = zip(instrument.columns(model, values), own.columns(model, values), strict=True)
        for V, W in columns:
            rows = slice(start, start + len(W))
            residual = (own.tau[rows] - W @ values) * weights
            scores.add(blocks[rows], np.einsum("tjr,tj->tr", V[:, :, kept], residual), first)
            start = rows.stop
    covariance = np.zeros((model.size, model.size))
    covariance[np.ix_(kept, kept)] = solution.gain @ scores.meat @ solution.gain.T
    return covariance
