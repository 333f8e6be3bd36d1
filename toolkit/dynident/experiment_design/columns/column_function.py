"""What an instant of a motion tells: columns of a model and of rivals, as a CasADi function."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dynident.batch.newton_euler import regressor_equations, torque_equations
from dynident.effects import Effect
from dynident.errors import DesignError, DynidentError
from dynident.experiment_design.columns.mapped import mapped
from dynident.late_modules import LateModule
from dynident.model import Model
from dynident.robot import Robot

ca: Any = LateModule("casadi")
_STEP = 1e-4  # of a change of the bodies, in its unit; the error of the slope is its square


@dataclass(frozen=True, eq=False)
class ColumnFunction:
    """Columns of a model and further effects along a motion.

    Attributes
    ----------
    function : casadi.Function of q, v, a (3 n,) and the time: m columns at n joints, (m, n).
    torque : casadi.Function of the same: the torque (n,) that the model predicts.
    labels : of the columns, (m,): names of parameters.
    n : number of joints.
    """

    function: Any
    torque: Any
    labels: tuple[str, ...]
    n: int

    @classmethod
    def of(
        cls,
        model: Model,
        values: np.ndarray,
        more: Sequence[Effect] = (),
        *,
        carries_payload: bool = False,
    ) -> ColumnFunction:
        """Write the columns of a model out, and those of effects that it does not have.

        Parameters
        ----------
        model : whose effects are functions of an instant of the motion.
        values : (p,) its parameters, for the torque and for columns that depend on it.
        more : effects beside it, at their shapes.
        carries_payload : whether the payload of the model is on board; its columns are zero where
            it is not.

        Returns
        -------
        Functions of an instant of the motion.

        Raises
        ------
        DesignError
            If an effect depends on the past: it is named.
        """
        n, base = model.robot.n, model.base
        x = ca.SX.sym("x", 3 * n + 1)
        robot = _robot(model, values)
        rigid = _rigid_columns(robot, base.independent, x)
        own, torque = [], _rigid_torque(robot, x)
        later: list[tuple[int, Effect]] = []
        for place, effect in enumerate(model.effects):
            own.append(None)
            if effect.needs_torque:
                later.append((place, effect))
                continue
            if effect.is_payload:
                own[place] = _payload_columns(robot, x) * float(carries_payload)
                torque = torque + own[place] @ values[model.slices[effect.label]]
                continue
            own[place] = _effect_columns(model, effect, robot, x, None)
            torque = torque + own[place] @ values[model.slices[effect.label]]
        for place, effect in later:
            own[place] = _effect_columns(model, effect, robot, x, torque)
        whole = torque
        for place, effect in later:
            whole = whole + own[place] @ values[model.slices[effect.label]]
        beside = [_effect_columns(model, effect, robot, x, torque) for effect in more]
        columns = ca.densify(ca.horzcat(rigid, *own, *beside)).T
        labels = [*model.names]
        for effect in more:
            labels += [effect.parameter_name(p.name) for p in effect.parameters(model.robot)]
        # Slopes by what changes the bodies hold the rigid torque several times.
        columns, whole = ca.cse([columns, ca.densify(whole)])
        functions = ca.Function("columns", [x], [columns]), ca.Function("torque", [x], [whole])
        return cls(*functions, tuple(labels), n)

    @property
    def count(self) -> int:
        """Number of columns, m."""
        return len(self.labels)

    def along(self, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return the columns along a motion, (T, n, m).

        Parameters
        ----------
        t : (T,) s.
        q, v, a : (T, n).
        """
        return _along(self.function, t, q, v, a)

    def torque_along(
        self, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray
    ) -> np.ndarray:
        """Return the torque along a motion, (T, n) N m or N.

        Parameters
        ----------
        t : (T,) s.
        q, v, a : (T, n).
        """
        return _along(self.torque, t, q, v, a)[:, 0]


def _along(function: Any, t: np.ndarray, *motion: np.ndarray) -> np.ndarray:
    """A function of an instant along a motion, (T, columns, rows)."""
    inputs = np.hstack([*motion, t[:, None]])
    (found,) = mapped(function, inputs[:, None])
    return found


def _robot(model: Model, values: np.ndarray) -> Robot:
    rigid = values[: model.base.rank]
    return model.robot.with_theta(model.base.lift(rigid, model.robot.theta))


def _signals(x: Any, n: int) -> tuple[Any, Any, Any]:
    return x[:n], x[n : 2 * n], x[2 * n : 3 * n]


def _rigid_columns(robot: Robot, kept: Sequence[int], x: Any) -> Any:
    """Regressor of some parameters, (n, b)."""
    q, v, a = _signals(x, robot.n)
    terms = regressor_equations(robot.joint_tree, tuple(kept))
    inputs = ca.vertcat(ca.cos(q), ca.sin(q), q, v, a)
    found = ca.Function("rigid", [terms.inputs], [terms.expressions])(inputs)
    columns = ca.SX(robot.n, len(kept))
    for k, (row, column) in enumerate(terms.places):
        columns[row, column] = found[k]
    return columns


def _rigid_torque(robot: Robot, x: Any) -> Any:
    q, v, a = _signals(x, robot.n)
    terms = torque_equations(robot.joint_tree)
    inputs = ca.vertcat(ca.cos(q), ca.sin(q), q, v, a, ca.DM(robot.theta))
    found = ca.Function("torque", [terms.inputs], [terms.expressions])(inputs)
    torque = ca.SX(robot.n, 1)
    for k, (row,) in enumerate(terms.places):
        torque[row] = found[k]
    return torque


def _payload_columns(robot: Robot, x: Any) -> Any:
    """Columns of what is added to the last link, (n, 10)."""
    return _rigid_columns(robot, range(10 * robot.tip, 10 * robot.tip + 10), x)


def _effect_columns(model: Model, effect: Effect, robot: Robot, x: Any, torque: Any) -> Any:
    """Columns of an effect, (n, k)."""
    if not effect.is_of_an_instant:
        remedy = "leave it out: what depends on the past or the hour is not designed for"
        raise DesignError("its torque is no function of an instant", effect.label, remedy)
    if effect.needs_bodies:
        return _changes_of_bodies(effect, robot, x)
    n = model.robot.n
    q, v, a = (np.array([[part[i] for i in range(n)]], dtype=object) for part in _signals(x, n))
    block = model.block(np.array([x[3 * n]], dtype=object), q, v, a)
    if torque is not None:
        rows = np.array([[torque[i] for i in range(n)]], dtype=object)
        block = replace(block, torque=rows)
    try:
        found = effect.columns(block)[0]
    except DynidentError:
        raise
    except Exception:  # code that is not symbolic fails in as many ways as there are
        what = "its columns cannot be written as a formula"
        raise DesignError(what, effect.label, "leave it out") from None
    columns = ca.SX(n, found.shape[1])
    for row in range(n):
        for k in range(found.shape[1]):
            columns[row, k] = found[row, k]
    return columns


def _changes_of_bodies(effect: Effect, robot: Robot, x: Any) -> Any:
    """Slopes of the rigid torque by the values of an effect that changes the bodies, at zero."""
    slopes = []
    count = len(effect.parameters(robot))
    for k in range(count):
        sides = []
        for step in (_STEP, -_STEP):
            values = [step * float(i == k) for i in range(count)]
            sides.append(_rigid_torque(effect.simulated_robot(values, robot), x))
        slopes.append((sides[0] - sides[1]) / (2 * _STEP))
    return ca.horzcat(*slopes)
