"""The covariance of an instrumental variable estimate.

White encoder noise reaches the residual as a second difference: its rows are strongly correlated,
and the textbook covariance, which takes them as independent, is 20 to 100 times too wide. Here the
noise is carried to the estimate by the adjoint of what was done to it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from dynident.effects import Block
from dynident.fitting.instrumental.noise_level import NoiseLevel
from dynident.fitting.instrumental.normal_equations import InstrumentalSolution
from dynident.fitting.instrumental.standard_parameters import minimum_norm
from dynident.fitting.sampling import Sampled, sample
from dynident.model import Model
from dynident.recording import Dataset, central_difference, lowpass

if TYPE_CHECKING:
    from dynident.robot.dynamics import TorqueDerivatives

_BLOCK = 8192
_STEP = 1e-6  # rad or m, and per s: derivatives of a torque that is smooth on this scale


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
    cutoff = parallel.filter.position_cutoff_hz
    # Each filter is passed twice: forth to the rows, and back.
    margin = 2 * parallel.overlap + (round(2 * rate / cutoff) if cutoff else 0) + 8
    kept_rows = parallel.rows(motion.samples)[sampled.kept]
    known = sampled.whole_columns(model, values)
    for start in range(0, motion.samples, _BLOCK):
        stop = min(start + _BLOCK, motion.samples)
        first, last = max(0, start - margin), min(motion.samples, stop + margin)
        raw, core = slice(first, last), slice(start - first, stop - first)
        block = model.with_regressor(sampled.block(model, raw))
        here = {label: own[raw] for label, own in known.items()}
        V = model.columns(block, values, here)[:, :, kept]
        weighted = np.zeros_like(V)
        inside = kept_rows[(kept_rows >= first) & (kept_rows < last)] - first
        weighted[inside] = parallel.low_pass(V)[inside] * (weights**2)[:, None]
        back = parallel.low_pass(weighted)
        jacobians = _jacobians(model, values, block, noise.position_std * rate)
        acceleration, speed, position = (
            jacobian.transpose(0, 2, 1) @ back
            for jacobian in (jacobians.by_a, jacobians.by_v, jacobians.by_q)
        )
        found = _differences(_differences(acceleration, rate) - speed, rate) + position
        if cutoff:
            found = lowpass(found, rate, cutoff)
        torque = back
        if sampled.recording.torque == "held_command":
            torque = np.concatenate([(back[:-1] + back[1:]) / 2, back[-1:] / 2])
        yield found[core], torque[core]


def _differences(x: np.ndarray, rate: float) -> np.ndarray:
    """Minus the adjoint of central differences, which are antisymmetric.

    Of rows that are zero beyond both ends: the one-sided differences there belong to rows that are
    not used (see `source.prepared`).
    """
    padded = np.pad(x, ((2, 2), (0, 0), (0, 0)))
    return central_difference(padded, rate)[2:-2]


def _jacobians(
    model: Model, values: np.ndarray, block: Block, speed_noise: np.ndarray
) -> TorqueDerivatives:
    """Derivatives of the predicted torque, but for effects of it or of the whole recording."""
    q, v, a, n = block.q, block.v, block.a, model.robot.n
    found = model.robot.torque_derivatives(q, v, a, minimum_norm(model, values))
    here = _effects(model, values, block, q, v, a)
    for j in range(n):
        unit = np.zeros(n)
        unit[j] = 1.0
        found.by_a[:, :, j] += _effects(model, values, block, q, v, a + unit) - here
        # Dry friction is a step on the scale of the noise: a secant across the noise counts.
        h = max(_STEP, float(speed_noise[j])) * unit
        rise = _effects(model, values, block, q, v + h, a)
        rise -= _effects(model, values, block, q, v - h, a)
        found.by_v[:, :, j] += rise / (2 * h[j])
        h = _STEP * unit
        rise = _effects(model, values, block, q + h, v, a)
        rise -= _effects(model, values, block, q - h, v, a)
        found.by_q[:, :, j] += rise / (2 * h[j])
    return found


def _effects(
    model: Model, values: np.ndarray, block: Block, q: np.ndarray, v: np.ndarray, a: np.ndarray
) -> np.ndarray:
    """Torque of the effects alone, (T, n)."""
    total = np.zeros(q.shape)
    for effect in model.effects:
        if effect.needs_torque or effect.needs_recording:
            continue
        moved = model.ready(effect, replace(block, q=q, v=v, a=a, rigid=None), values)
        total += effect.columns(moved) @ values[model.slices[effect.label]]
    return total
