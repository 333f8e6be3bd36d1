"""Derivatives of a model's torque along a motion, effects included."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from dynident.effects import Block
from dynident.fitting.instrumental.standard_parameters import minimum_norm
from dynident.model import Model

if TYPE_CHECKING:
    from dynident.robot.dynamics import TorqueDerivatives

_STEP = 1e-6  # rad or m, and per s: derivatives of a torque that is smooth on this scale


def torque_jacobians(
    model: Model, values: np.ndarray, block: Block, speed_noise: np.ndarray
) -> TorqueDerivatives:
    """Return derivatives of the predicted torque, but for effects of it or of a whole recording.

    Parameters
    ----------
    model, values : (p,) that predict.
    block : samples with their regressor.
    speed_noise : (n,) rad/s or m/s, over which dry friction is a secant.
    """
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
