"""Motors that turn the next joint too, as those of hollow wrists do: what shows it.

Where the motor of joint k also turns joint k + 1, whose own motor sits before joint k, positions
are q_(k+1) = m_(k+1) - m_k, say, each m behind its own gear. Friction and rotors are the motors'
own and fit either way, so that the torques tell only where the links behind the joint are heavy
enough; both readings are given every friction that either of them needs, and are compared on blocks
of time that the fit has not seen. What a light wrist leaves open, limits of speed may suggest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from dynident.criteria import DEFAULTS
from dynident.errors import DynidentError
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from dynident.wiring.regressions.wiring_rows import WiringRows, rows_of
from dynident.wiring.speed_limits import WITHIN, over_speed, speed_reached

_BLOCKS, _FOLDS = 16, 4  # of time; every fourth is held out
_ROUNDS = 3  # of weighting joints by what is left at them
_RIDGE = 1e-9
_LEAST = 1e-5  # share of the torque's power below which a residual is as good as none
_SPEED_ROWS = 3000


@dataclass(frozen=True, kw_only=True)
class Coupling:
    """A joint that the motor of the one before it turns too.

    Attributes
    ----------
    joint, by : names of the joint, and of the one whose motor turns it.
    turns : of `joint` for each turn of `by`.
    """

    joint: str
    by: str
    turns: float

    @property
    def words(self) -> str:
        """What turns what."""
        more = "less" if self.turns < 0 else "plus"
        times = "" if math.isclose(abs(self.turns), 1.0) else f"{abs(self.turns):.4g} times "
        return f"{self.joint} is its motor's turn {more} {times}that of {self.by}"


def couplings_of(motors: np.ndarray, robot: Robot) -> tuple[Coupling, ...]:
    """Return what motors that turn several joints make of these.

    Parameters
    ----------
    motors : (n, n) turns of the motors, behind their gears, from those of the joints.
    robot : for the joints' names.
    """
    return tuple(
        Coupling(joint=robot.names[i], by=robot.names[k], turns=-float(motors[i, k]))
        for i, k in np.argwhere(motors - np.eye(robot.n))
    )


@dataclass(frozen=True, kw_only=True)
class CouplingGuess:
    """What recordings say of motors that turn two joints.

    Attributes
    ----------
    found : couplings that are as likely as each other; at least one.
    reason : what shows it.
    """

    found: tuple[Coupling, ...]
    reason: str


@dataclass(frozen=True, eq=False, kw_only=True)
class _Compared:
    """How much better than without it a coupling fits, per row, in the fit and held out."""

    coupling: Coupling
    gain: float
    held_out: float


def coupling_by_torques(robot: Robot, rows: WiringRows) -> CouplingGuess | None:
    """Look for a motor that turns the joint after its own by what the links behind it weigh.

    Parameters
    ----------
    robot : as it is described.
    rows : of recordings as if each motor turned one joint.

    Returns
    -------
    One coupling where it wins by far; None where none does.
    """
    compared = [_compared(robot, rows, one) for one in _couplings(robot)]
    enough = _enough(rows)
    winners = [one for one in compared if min(one.gain, one.held_out) >= enough]
    if not winners:
        return None
    best = max(winners, key=lambda one: one.held_out)
    times = float(np.exp(best.held_out))
    reason = (
        "on blocks of time that a fit has not seen, with every friction that either reading needs, "
        f"the residual shrinks by the factor {times:.3g} (of a joint, or of several together)"
    )
    return CouplingGuess(found=(best.coupling,), reason=reason)


def coupling_by_speeds(robot: Robot, recordings: Sequence[Recording]) -> CouplingGuess | None:
    """Look for a joint that would be faster than it can, while all others keep their limits.

    Parameters
    ----------
    robot : with its limits of speed.
    recordings : as if each motor turned one joint.

    Returns
    -------
    The couplings that bring it within its limit, and that the torques do not speak against by far;
    None where there are none, or where nothing shows that the limits are those of the drives.
    """
    criteria = DEFAULTS.wiring
    dataset = Dataset(tuple(recordings))
    try:
        few, rows = (
            rows_of(dataset, most, criteria.independent_hz) for most in (criteria.rows, _SPEED_ROWS)
        )
    except DynidentError:
        return None
    over = over_speed(robot, rows.v)
    if over is None:
        return None
    i, found, speeds = robot.names.index(over.joint), [], []
    for one in _couplings(robot):
        if one.joint != over.joint or _compared(robot, few, one).gain <= -_enough(few):
            continue
        v = rows.v[:, i] + one.turns * rows.v[:, robot.names.index(one.by)]
        speed = float(speed_reached(v))
        if speed <= WITHIN * over.limit:
            found.append(one)
            speeds.append(f"{speed:.3g} {over.unit}")
    if not found:
        return None
    words = " or ".join(one.words for one in found)
    reason = (
        f"nobody has said otherwise and the torques do not tell; but so {over.words}. "
        f"If {words}, it reaches {' or '.join(speeds)}; a wrong ratio or limit would look alike"
    )
    return CouplingGuess(found=tuple(found), reason=reason)


def _enough(rows: WiringRows) -> float:
    """Logarithmic likelihood per row by which a reading wins by far."""
    return max(DEFAULTS.wiring.gain, DEFAULTS.wiring.evidence / rows.independent)


def _couplings(robot: Robot) -> list[Coupling]:
    return [
        Coupling(joint=joint.name, by=robot.names[joint.parent], turns=turns)
        for joint in robot.joints
        if joint.kind == "revolute"
        and joint.parent >= 0
        and robot.kinds[joint.parent] == "revolute"
        for turns in (-1.0, 1.0)
    ]


def _compared(robot: Robot, rows: WiringRows, coupling: Coupling) -> _Compared:
    """Fits with and without a coupling, both with every friction that either needs."""
    i, k = robot.names.index(coupling.joint), robot.names.index(coupling.by)
    f = coupling.turns
    change, back = np.eye(robot.n), np.eye(robot.n)
    change[i, k], back[k, i] = f, -f
    turned = replace(rows.moved(change), tau=rows.tau @ back.T)
    speeds = (rows.v[:, k], rows.v[:, i], turned.v[:, i])
    rates = (rows.a[:, k], rows.a[:, i])
    width = Model(robot).friction_widths[[k, i]].mean()
    shared = np.stack([*speeds[:2], *rates, *(np.tanh(v / width) for v in speeds)], axis=1)
    before, after = (_Scores.of(robot, one, (k, i), shared) for one in (rows, turned))
    return _Compared(
        coupling=coupling,
        gain=after.fitted - before.fitted,
        held_out=after.held_out - before.held_out,
    )


@dataclass(frozen=True, kw_only=True)
class _Scores:
    """Logarithmic likelihood per row of a fit, on its own rows and on blocks that it has not seen.

    The torques of the two joints count by the determinant of their residuals' covariance, which is
    the same on the motors' side.
    """

    fitted: float
    held_out: float

    @classmethod
    def of(
        cls, robot: Robot, rows: WiringRows, pair: tuple[int, int], shared: np.ndarray
    ) -> _Scores:
        X, y = _columns(robot, rows, pair, shared), rows.tau
        power = np.mean(y**2, axis=0) + 1e-300
        weight = 1.0 / power
        everywhere = np.ones(len(y), dtype=bool)
        left = y
        for _ in range(_ROUNDS):
            left = y - X @ _solved(X, y, weight, everywhere)
            weight = 1.0 / np.maximum(np.mean(left**2, axis=0), _LEAST * power)
        unseen = np.empty_like(y)
        block = np.arange(len(y)) * _BLOCKS // len(y) % _FOLDS
        for fold in range(_FOLDS):
            out = block == fold
            unseen[out] = y[out] - X[out] @ _solved(X, y, weight, ~out)
        return cls(fitted=_score(left, power, pair), held_out=_score(unseen, power, pair))


def _columns(
    robot: Robot, rows: WiringRows, pair: tuple[int, int], shared: np.ndarray
) -> np.ndarray:
    """Columns (T, n, p): the rigid body's, five of each joint's own, those that a pair shares."""
    model = Model(robot)
    base = robot.regressor(rows.q, rows.v, rows.a)[:, :, list(model.base.independent)]
    samples, n = rows.q.shape
    parts = [base]
    for j in range(n):
        v, a, q = rows.v[:, j], rows.a[:, j], rows.q[:, j]
        own = [np.ones(samples), q]
        if j not in pair:
            own += [v, np.tanh(v / model.friction_widths[j]), a]
        parts.append(_at(np.stack(own, axis=1), j, n))
    return np.concatenate([*parts, *(_at(shared, j, n) for j in pair)], axis=2)


def _at(own: np.ndarray, joint: int, n: int) -> np.ndarray:
    found = np.zeros((len(own), n, own.shape[1]))
    found[:, joint] = own
    return found


def _solved(X: np.ndarray, y: np.ndarray, weight: np.ndarray, kept: np.ndarray) -> np.ndarray:
    X, y = X[kept] * np.sqrt(weight)[:, None], y[kept] * np.sqrt(weight)
    X, y = X.reshape(-1, X.shape[2]), y.ravel()
    size = np.linalg.norm(X, axis=0)
    size = np.where(size > 0, size, 1.0)
    A = (X / size).T @ (X / size) + _RIDGE * np.eye(X.shape[1])
    return cho_solve(cho_factor(A), (X / size).T @ y) / size


def _score(left: np.ndarray, power: np.ndarray, pair: tuple[int, int]) -> float:
    others = np.delete(np.arange(left.shape[1]), pair)
    ours = left[:, pair]
    floor = _LEAST * np.diag(power[list(pair)])
    both = np.linalg.det(ours.T @ ours / len(ours) + floor)
    alone = np.mean(left[:, others] ** 2, axis=0) + _LEAST * power[others]
    return -0.5 * float(np.log(both) + np.sum(np.log(alone)))
