"""Inputs of a regression on what is left at a joint: its motion, its load, its past, and the rest.

All inputs come out in units of their own spread, so that no unit matters. The past of a joint is
what lags and stops see of it: how far it has come, and how its load has changed, within a few
short times (elasticity, delay); and stop operators, the displacement since a reversal as far as a
few distances, which are the elements of rate-independent hysteresis (A. Visintin, Differential
Models of Hysteresis, 1994).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.diagnosis.dependence.residual_record import ResidualRecord, joints_turning_round
from dynident.recording import as_points

LAGS_S = (0.025, 0.1, 0.4)
"""How far lags look back, s: from the sample time of a slow recording to a slow elastic mode."""
STOPS = (0.003, 0.03, 0.3)
"""Distances of stop operators over the spread of the position: from bristles to backlash."""
CIRCLE = np.pi / np.sqrt(3)
"""Spread of an angle that is anywhere on a circle, rad."""
REVERSAL = 0.02
"""Part of a joint's root mean square speed within which its direction counts as changing."""


@dataclass(frozen=True, eq=False, kw_only=True)
class JointInputs:
    """Inputs along all records, one after another, (T, k) or (T,) each, without unit.

    Attributes
    ----------
    position : (T, 1) of the joint; of one that turns round, (T, 2) the point of a circle.
    velocity, direction, acceleration, load : (T, 1) of the joint; the direction is the sign of the
        velocity, smooth across zero.
    past : (T, k) of the joint.
    others : for each other joint that moves, (T, 4 or 5): velocity, direction, acceleration, and
        the position.
    time : (T, 1) on the clock of the session.
    record : (T,) number of the record.
    position_errors : (T, k) what errors of the measured positions do to its torque; k may be 0.
    """

    position: np.ndarray
    velocity: np.ndarray
    direction: np.ndarray
    acceleration: np.ndarray
    load: np.ndarray
    past: np.ndarray
    others: tuple[np.ndarray, ...]
    time: np.ndarray
    record: np.ndarray
    position_errors: np.ndarray

    def rows(self, index: np.ndarray) -> JointInputs:
        """Return the inputs of some rows."""
        return JointInputs(
            **{k: x[index] for k, x in vars(self).items() if k != "others"},
            others=tuple(x[index] for x in self.others),
        )


def joint_inputs(records: tuple[ResidualRecord, ...], joint: int) -> JointInputs:
    """Return the inputs of a regression on the residual of a joint.

    Parameters
    ----------
    records : all records, whole: the past of a row is in the rows before it.
    joint : column of the joint.
    """
    motion = [_motion(records, i) for i in range(records[0].q.shape[1])]
    own = motion[joint]
    load = np.concatenate([one.load[:, joint] for one in records])
    spread = float(np.std(np.concatenate([one.q[:, joint] for one in records])))
    if joints_turning_round(records)[joint]:
        spread = min(spread, CIRCLE)
    past = np.concatenate([_past(one, joint, spread) for one in records])
    session = np.concatenate([one.session for one in records])
    numbers = [np.full(len(one.t), i) for i, one in enumerate(records)]
    return JointInputs(
        velocity=own[:, :1],
        direction=own[:, 1:2],
        acceleration=own[:, 2:3],
        position=own[:, 3:],
        load=_scaled(load[:, None]),
        past=_scaled(past),
        others=tuple(x for i, x in enumerate(motion) if i != joint and np.any(x)),
        time=_scaled(session[:, None]),
        record=np.concatenate(numbers),
        position_errors=np.empty((len(own), 0)),
    )


def _motion(records: tuple[ResidualRecord, ...], joint: int) -> np.ndarray:
    """Velocity, direction, acceleration and position of a joint, (T, 4), or (T, 5) of a point."""
    q, v, a = (np.concatenate([getattr(one, name)[:, joint] for one in records]) for name in "qva")
    speed = float(np.sqrt(np.mean(v**2)))
    direction = np.tanh(v / (REVERSAL * speed)) if speed > 0 else np.zeros_like(v)
    position = as_points(q[:, None], joints_turning_round(records)[[joint]])
    return np.column_stack([_scaled(v[:, None]), direction, _scaled(a[:, None]), _scaled(position)])


def _scaled(x: np.ndarray) -> np.ndarray:
    """Columns (T, k) about their mean, over their spread; zero where they are constant."""
    centred, size = x - x.mean(axis=0), np.abs(x).max(axis=0)
    spread = centred.std(axis=0)
    constant = spread <= 1e-9 * size  # rounding errors, whatever the unit
    return np.where(constant, 0.0, centred / np.where(constant, 1.0, spread))


def _past(one: ResidualRecord, joint: int, spread: float) -> np.ndarray:
    """What lags and stops see of a joint, (T, k)."""
    q, v, load = one.q[:, joint], one.v[:, joint], one.load[:, joint]
    found = []
    for lag in LAGS_S:
        earlier = one.t - lag
        # Less what the present velocity alone would say of the way.
        found.append(q - np.interp(earlier, one.t, q) - lag * v)
        found.append(load - np.interp(earlier, one.t, load))
    found += [_stopped(q, distance * spread) for distance in STOPS]
    return np.column_stack(found)


def _stopped(q: np.ndarray, most: float) -> np.ndarray:
    """Displacement (T,) of a spring with position q that slides beyond a displacement."""
    z, found = 0.0, []
    for step in np.diff(q, prepend=q[:1]).tolist():
        z += step
        if z > most:
            z = most
        elif z < -most:
            z = -most
        found.append(z)
    return np.array(found)
