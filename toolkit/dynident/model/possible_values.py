"""Whether the values of a model are possible together, at every state that was recorded.

In: a model, its values with their covariance, and states. Out: what no robot can have. A single
parameter may pass every test and still make friction that drives the joint, or a mass matrix that
is not positive definite, together with the others; and of friction that falls with speed one
coefficient is negative in a joint that is possible.

Everything is judged by its z score: how many standard deviations it is on the wrong side of zero.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from dynident.criteria import GateCriteria
from dynident.effects import Block, Effect, Parameter
from dynident.model.torque_model import Model
from dynident.tables import number

_ROUNDING = 1e-9  # of a value, a standard deviation that stands for none
_ALONE = ("viscous_friction", "coulomb_friction")


@dataclass(frozen=True, kw_only=True)
class Impossible:
    """Something that no robot can have.

    Attributes
    ----------
    where : the parameter, joint or robot that it is about; of the same in two models it is equal.
    what : in words, with the value.
    value, std : how far it is below what is possible, a negative number, and its standard
        deviation; SI units.
    """

    where: str
    what: str
    value: float
    std: float

    def __str__(self) -> str:
        return self.what


@dataclass(frozen=True, kw_only=True)
class ImpossibleJoint(Impossible):
    """A joint whose inertia or friction is below zero, all parameters taken together.

    Attributes
    ----------
    joint : its name.
    torque : N m or N, about the rms of what this inertia or friction makes at the joint.
    """

    joint: str
    torque: float


def beyond_bounds(
    model: Model, values: np.ndarray, sigma: np.ndarray, criteria: GateCriteria
) -> Iterator[Impossible]:
    """Yield the parameters of effects that are beyond their bounds.

    Parameters
    ----------
    model : a robot with its effects.
    values : (p,) of its parameters.
    sigma : (p,) of them; zero where the data tell a parameter only together with others: what of
        the sum is its own is a choice.
    criteria : how many standard deviations are beyond doubt.
    """
    for effect in model.effects:
        own = model.slices[effect.label]
        parameters = effect.parameters(model.robot)
        for parameter, value, s in zip(parameters, values[own], sigma[own], strict=True):
            if not s > _ROUNDING * np.abs(values[own]).max(initial=0.0):
                continue  # the data do not tell it: what it is, is rounding
            slack = criteria.beyond_bounds * s
            if value < parameter.lower - slack or value > parameter.upper + slack:
                yield Impossible(
                    where=f"{parameter.name} of {effect.label}",
                    what=f"{parameter.name} = {number(value, 3)} {_unit(parameter)}"
                    f"at {effect.joint or 'the robot'}",
                    value=float(min(value - parameter.lower, parameter.upper - value)),
                    std=float(s),
                )


def impossible_joints(
    model: Model,
    values: np.ndarray,
    covariance: np.ndarray,
    states: Block,
    criteria: GateCriteria,
) -> tuple[ImpossibleJoint, ...]:
    """Return the joints whose inertia or friction is negative beyond doubt.

    Judged is what acts: the joint-space inertia, bodies and rotors together, and the power that all
    friction of a joint takes.

    Parameters
    ----------
    model : a robot with its effects.
    values, covariance : (p,) and (p, p) of its parameters.
    states : (T,) recorded ones, as of `Model.block`.
    criteria : how many standard deviations are beyond doubt, and when a joint moves.

    Returns
    -------
    Friction that drives a joint, on average or where it is fast; inertia felt at a joint that is
    negative on average, else the mass matrix where it is not positive definite.
    """
    fitted = _Fitted(model=model, values=values, covariance=covariance, states=states)
    return (*_driving_friction(fitted, criteria), *_negative_inertia(fitted, criteria))


@dataclass(frozen=True, eq=False, kw_only=True)
class _Fitted:
    model: Model
    values: np.ndarray
    covariance: np.ndarray
    states: Block

    def judged(self, combination: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sums (..., p) @ values, their standard deviations, and z: how far they are below zero."""
        value = combination @ self.values
        variance = np.sum((combination @ self.covariance) * combination, axis=-1)
        std = np.sqrt(np.clip(variance, 0.0, None))
        told = std > _ROUNDING * np.abs(value)  # else it is rounding that the data do not tell
        return value, std, np.where(told, -value / np.where(told, std, 1.0), 0.0)


def _unit(parameter: Parameter) -> str:
    return "" if parameter.unit == "1" else f"{parameter.unit} "


def _driving_friction(fitted: _Fitted, criteria: GateCriteria) -> Iterator[ImpossibleJoint]:
    """Joints whose friction, all of it together, works with the motion."""
    model, states = fitted.model, fitted.states
    for j, joint in enumerate(model.robot.names):
        every = [e for e in model.effects if e.joint == joint and e.opposes_motion]
        if not every or not np.any(states.v[:, j]):
            continue
        v = states.v[:, j]
        power = np.zeros((len(v), model.size))
        for effect in every:
            columns = effect.acting_columns(states)[:, 0]
            power[:, model.slices[effect.label]] = v[:, None] * columns
        value, std, z = map(float, fitted.judged(power.mean(axis=0)))
        torque, at = abs(value) / _rms(v), ""
        if not z > criteria.beyond_bounds:
            if all(e.name in _ALONE for e in every):
                continue  # what these two do at one speed stands in their bounds
            moving = np.abs(v) > criteria.surely_moving * model.friction_widths[j]
            each, stds, zs = fitted.judged(power)
            driving = moving & (zs > criteria.beyond_bounds)
            if np.count_nonzero(driving) <= criteria.may_drive * np.count_nonzero(moving):
                continue
            worst = int(np.argmin(np.where(driving, each, np.inf)))
            value, std = float(each[worst]), float(stds[worst])
            torque = abs(value / v[worst])
            at = f" at {number(v[worst], 2)} {model.robot.units[j]}/s"
        yield ImpossibleJoint(
            where=f"friction at {joint}",
            what=f"the friction at {joint} ({number(value, 3)} +- {number(std, 2)} W{at})",
            value=value,
            std=std,
            joint=joint,
            torque=float(torque),
        )


def _negative_inertia(fitted: _Fitted, criteria: GateCriteria) -> Iterator[ImpossibleJoint]:
    """The mass matrix, rotors in it: its mean diagonal, else where it is not positive definite."""
    model, names = fitted.model, fitted.model.robot.names
    slopes = _mass_matrix_by_value(model, fitted.states)
    own = np.diagonal(slopes, axis1=1, axis2=2).mean(axis=0).T  # (n, p)
    values, stds, z = fitted.judged(own)
    for j in np.flatnonzero(z > criteria.beyond_bounds):
        unit = "kg m^2" if model.robot.kinds[j] == "revolute" else "kg"
        what = f"the inertia at {names[j]} ({number(values[j], 3)} +- {number(stds[j], 2)} {unit})"
        torque = float(abs(values[j]) * _rms(fitted.states.a[:, j]))
        yield ImpossibleJoint(
            where=f"inertia at {names[j]}",
            what=what,
            value=float(values[j]),
            std=float(stds[j]),
            joint=names[j],
            torque=torque,
        )
    if np.any(z > criteria.beyond_bounds):
        return
    least, vectors = np.linalg.eigh(slopes @ fitted.values)
    u = vectors[:, :, 0]
    _, stds, z = fitted.judged(np.einsum("ti,tijp,tj->tp", u, slopes, u))
    negative = (z > criteria.beyond_bounds) & (least[:, 0] < -_ROUNDING * np.abs(least[:, -1]))
    if np.any(negative):
        t = int(np.argmin(np.where(negative, least[:, 0], np.inf)))
        j = int(np.argmax(np.abs(u[t])))
        along = np.sum(fitted.states.a * u[t], axis=1)
        yield ImpossibleJoint(
            where="mass matrix",
            what=f"the inertia felt at {names[j]} with the others moving "
            f"({number(least[t, 0], 3)} +- {number(stds[t], 2)} in SI units)",
            value=float(least[t, 0]),
            std=float(stds[t]),
            joint=names[j],
            torque=float(abs(least[t, 0] * u[t, j]) * _rms(along)),
        )


def _mass_matrix_by_value(model: Model, states: Block) -> np.ndarray:
    """Slopes (T, n, n, p) of the mass matrix by the values of the model, gravity off."""
    still = replace(states, v=np.zeros_like(states.v), a=np.zeros_like(states.a), rigid=None)
    bodies = [e for e in model.effects if e.is_instantaneous and not e.is_payload]
    at_rest = _accelerated(model, bodies, still)
    n = model.robot.n
    slopes = np.empty((len(states.t), n, n, model.size))
    for j in range(n):
        a = np.zeros_like(states.a)
        a[:, j] = 1.0
        slopes[:, :, j] = _accelerated(model, bodies, replace(still, a=a)) - at_rest
    return slopes


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


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))
