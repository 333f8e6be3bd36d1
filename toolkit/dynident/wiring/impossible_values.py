"""Values of a fitted model that no robot has: inertia or friction below zero."""

from __future__ import annotations

import numpy as np

from dynident.criteria import WiringCriteria
from dynident.model import Model
from dynident.wiring.wiring_rows import WiringRows

_FRICTION = (
    "viscous_friction",
    "coulomb_friction",
    "stribeck_friction",
    "asymmetric_friction",
    "quadratic_drag",
)
"""Effects that together take power out of a joint, at every speed."""
_STATES = 12


def impossible_values(
    model: Model,
    values: np.ndarray,
    covariance: np.ndarray,
    rows: WiringRows,
    criteria: WiringCriteria,
) -> tuple[str, ...]:
    """Say which joints have an inertia, or a friction, that is negative beyond doubt.

    Judged is what acts: the joint-space inertia, bodies and rotor together, averaged over recorded
    positions, and the power that all friction effects of a joint take at recorded speeds. One
    coefficient alone may be negative in a joint that is possible.

    Parameters
    ----------
    model : that was fitted.
    values, covariance : (p,) and (p, p) of its parameters.
    rows : of the recordings.
    criteria : how many standard deviations are beyond doubt, and what is worth a word.

    Returns
    -------
    A clause for each.
    """
    found = []
    for j, name in enumerate(model.robot.names):
        unit = "kg m^2" if model.robot.kinds[j] == "revolute" else "kg"
        for what, combination, size in (
            (f"the inertia at {name} ({{}} {unit})", _inertia(model, rows, j), _rms(rows.a[:, j])),
            (f"the friction at {name} ({{}} W)", _friction(model, rows, j), 0.0),
        ):
            value = float(combination @ values)
            std = float(np.sqrt(max(combination @ covariance @ combination, 0.0)))
            power = _rms(rows.tau[:, j]) * (_rms(rows.v[:, j]) if size == 0.0 else 1.0)
            matters = abs(value) * (size or 1.0) > criteria.worth_a_word * power
            if matters and value < -criteria.impossible_z * std and np.any(combination):
                found.append(what.format(f"{value:.3g} +- {std:.2g}"))
    return tuple(found)


def _inertia(model: Model, rows: WiringRows, joint: int) -> np.ndarray:
    """Mean joint-space inertia as a combination (p,) of the parameters."""
    robot, kept = model.robot, list(model.base.independent)
    q = rows.q[np.linspace(0, len(rows.q) - 1, min(_STATES, len(rows.q))).round().astype(int)]
    rest, pushed = np.zeros_like(q), np.zeros_like(q)
    pushed[:, joint] = 1.0
    found = np.zeros(model.size)
    difference = robot.regressor(q, rest, pushed) - robot.regressor(q, rest, rest)
    found[: len(kept)] = difference[:, joint, kept].mean(axis=0)
    for effect in model.effects:
        if effect.name == "rotor_inertia" and effect.joint == robot.names[joint]:
            found[model.slices[effect.label]] = 1.0
    return found


def _friction(model: Model, rows: WiringRows, joint: int) -> np.ndarray:
    """Mean power that friction takes, as a combination (p,) of the parameters."""
    block = model.block(np.zeros(len(rows.q)), rows.q, rows.v, rows.a)
    found = np.zeros(model.size)
    for effect in model.effects:
        if effect.name in _FRICTION and effect.joint == model.robot.names[joint]:
            columns = effect.columns(block)[:, joint, :]
            found[model.slices[effect.label]] = (rows.v[:, [joint]] * columns).mean(axis=0)
    return found


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))
