"""Whether the values of a model are possible together, at every state that was recorded.

In: a model, its values with their covariance, and states. Out: what no robot can have. A single
parameter may pass every test and still make friction that drives the joint, or a mass matrix that
is not positive definite, together with the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from dynident.effects import Block, Effect, Parameter
from dynident.model.torque_model import Model
from dynident.tables import number

_FAST = 5.0  # friction widths above which the direction of motion is certain
_ROUNDING = 1e-9  # of an effect's largest value, a standard deviation that stands for none
_SHARE = 0.01  # of the states at which friction may seem to drive


@dataclass(frozen=True, kw_only=True)
class Impossible:
    """Something that no robot can have.

    Attributes
    ----------
    where : the parameter, joint or robot that it is about; of the same in two models it is equal.
    what : in words, with the value.
    """

    where: str
    what: str

    def __str__(self) -> str:
        return self.what


def impossible_at(
    model: Model, values: np.ndarray, covariance: np.ndarray, states: Block, deviations: float
) -> tuple[Impossible, ...]:
    """Return what the values of a model make that no robot can have.

    Parameters
    ----------
    model : a robot with its effects.
    values, covariance : (p,) and (p, p) of its parameters.
    states : (T,) recorded ones, as of `Model.block`.
    deviations : standard deviations by which something must be on the wrong side of zero.

    Returns
    -------
    Parameters beyond their bounds, friction that drives a joint, inertia that is not positive.
    """
    return (
        *_beyond_bounds(model, values, covariance, deviations),
        *_driving_friction(model, values, covariance, states, deviations),
        *_negative_inertia(model, values, covariance, states, deviations),
    )


def _beyond_bounds(
    model: Model, values: np.ndarray, covariance: np.ndarray, deviations: float
) -> Iterator[Impossible]:
    sigma = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    for effect in model.effects:
        own = model.slices[effect.label]
        parameters = effect.parameters(model.robot)
        for parameter, value, s in zip(parameters, values[own], sigma[own], strict=True):
            if not s > _ROUNDING * np.abs(values[own]).max(initial=0.0):
                continue  # the data do not tell it: what it is, is rounding
            slack = deviations * s
            if value < parameter.lower - slack or value > parameter.upper + slack:
                yield Impossible(
                    where=f"{parameter.name} of {effect.label}",
                    what=f"{parameter.name} = {number(value, 3)} {_unit(parameter)}"
                    f"at {effect.joint or 'the robot'}",
                )


def _unit(parameter: Parameter) -> str:
    return "" if parameter.unit == "1" else f"{parameter.unit} "


def _driving_friction(
    model: Model, values: np.ndarray, covariance: np.ndarray, states: Block, deviations: float
) -> Iterator[Impossible]:
    """Joints whose friction, all of it together, works with the motion where that was recorded."""
    for j, joint in enumerate(model.robot.names):
        every = [e for e in model.effects if e.joint == joint and e.opposes_motion]
        if not any(e.name not in ("viscous_friction", "coulomb_friction") for e in every):
            continue  # what these two do alone stands in their bounds
        columns = np.hstack([e.acting_columns(states)[:, 0] for e in every])
        own = np.concatenate([np.r_[model.slices[e.label]] for e in every])
        v = states.v[:, j]
        power = v * (columns @ values[own])
        doubt = np.abs(v) * np.sqrt(np.sum((columns @ covariance[np.ix_(own, own)]) * columns, 1))
        moving = np.abs(v) > _FAST * model.friction_widths[j]
        driving = moving & (power < -deviations * doubt)
        if np.count_nonzero(driving) > _SHARE * max(np.count_nonzero(moving), 1):
            worst = int(np.argmin(np.where(driving, power, np.inf)))
            yield Impossible(
                where=f"friction at {joint}",
                what=f"friction at {joint} that drives it, at {number(v[worst], 2)} "
                f"{model.robot.units[j]}/s",
            )


def _negative_inertia(
    model: Model, values: np.ndarray, covariance: np.ndarray, states: Block, deviations: float
) -> Iterator[Impossible]:
    """The mass matrix, rotors in it, where it is not positive definite."""
    still = replace(states, v=np.zeros_like(states.v), a=np.zeros_like(states.a), rigid=None)
    bodies = [e for e in model.effects if e.is_instantaneous and not e.is_payload]
    at_rest = _accelerated(model, bodies, still)
    n = model.robot.n
    slopes = np.empty((len(states.t), n, n, model.size))  # of M_ij by the values
    for j in range(n):
        a = np.zeros_like(states.a)
        a[:, j] = 1.0
        slopes[:, :, j] = _accelerated(model, bodies, replace(still, a=a)) - at_rest
    least, vectors = np.linalg.eigh(slopes @ values)
    u = vectors[:, :, 0]
    slope = np.einsum("ti,tijp,tj->tp", u, slopes, u)
    doubt = np.sqrt(np.clip(np.sum((slope @ covariance) * slope, axis=1), 0.0, None))
    negative = least[:, 0] < -(deviations * doubt + _ROUNDING * np.abs(least[:, -1]))
    if not np.any(negative & (least[:, 0] < 0)):
        return
    t = int(np.argmin(np.where(negative, least[:, 0], np.inf)))
    j = int(np.argmax(np.abs(u[t])))
    yield Impossible(
        where="mass matrix",
        what=f"a negative inertia felt at {model.robot.names[j]} "
        f"({number(least[t, 0], 2)} in SI units)",
    )


def _accelerated(model: Model, bodies: list[Effect], block: Block) -> np.ndarray:
    """Columns of bodies and of effects that follow from a sample alone, (T, n, p)."""
    block = model.with_regressor(block)
    assert block.rigid is not None
    columns = np.zeros((*block.q.shape, model.size))
    rank = len(model.base.independent)
    columns[:, :, :rank] = block.rigid[:, :, model.base.independent]
    for effect in bodies:
        columns[:, :, model.slices[effect.label]] = effect.columns(block)
    return columns
