"""Ipopt's form of the search for a motion: variables, limits on a grid of instants, and a loss."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dynident.experiment_design.geometry.workspace import RoomCut
from dynident.experiment_design.information import Information
from dynident.experiment_design.motions.motion_family import MotionFamily
from dynident.late_modules import LateModule

ca: Any = LateModule("casadi")
_OTHERS = 0.2
"""Weight of the mean of several losses beside the largest. Of the largest alone, joints that the
worst told pair does not need stood still: in `problems/which_of_two` three pairs were told by 15,
13 and 17 standard deviations, and with the mean by 416, 105 and 15."""


NOT_BETTER = "no better motion than a random one"
"""Status of a motion that no search has bettered."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignedMotion:
    """A motion within limits, and how its program ended.

    Attributes
    ----------
    variables : (n, 1 + k).
    loss : see `MotionProgram.loss`.
    status : of Ipopt, in words, or `NOT_BETTER`.
    iterations : of Ipopt.
    """

    variables: np.ndarray
    loss: float
    status: str
    iterations: int

    @property
    def ended_in_words(self) -> str:
        """How the search for it ended, with the solver's own words."""
        if self.status == NOT_BETTER:
            return f"The search for a better motion failed: {self.status}."
        where = "at" if self.status.startswith("Solve") else "short of"
        words = f"(Ipopt: {self.status}, {self.iterations} iterations)"
        return f"The search ended {where} a local optimum {words}."


@dataclass(frozen=True, eq=False, kw_only=True)
class LimitedTorque:
    """Which torques a program limits, and to what.

    Attributes
    ----------
    function : casadi.Function of an instant, the torque (n,).
    most : (n,) N m or N.
    joints : those that are limited.
    """

    function: Any
    most: np.ndarray
    joints: Collection[int]

    def shares(self, inputs: Any, slopes: tuple[np.ndarray, ...]) -> tuple[Any, Any]:
        """Return shares of the limits at some instants, and their slopes.

        The slopes are written out: sought along every variable at once, as CasADi would, they are
        most of a program's time.

        Parameters
        ----------
        inputs : (3 n + 1, T) expression: q, v, a and the time.
        slopes : of q, v and a of a joint by its own variables, (n, T, k) each.

        Returns
        -------
        Expressions: (T, m) of the m limited joints, and (T m, n k), instants of a joint together.
        """
        limited = sorted(self.joints)
        n, instants, _ = slopes[0].shape
        x = ca.SX.sym("x", inputs.shape[0])
        share = self.function(x)[limited] / ca.DM(self.most[limited])
        slope = ca.densify(ca.jacobian(share, x)[:, : 3 * n])
        found, change = (
            ca.Function("along", [x], [one]).map(instants)(inputs) for one in (share, slope)
        )
        # A row for each instant: the slopes of all limited joints by one signal after the other.
        change = ca.reshape(change, 3 * n * len(limited), instants).T

        def block(i: int, j: int) -> Any:
            """Slopes of the torque of a limited joint by the variables of a joint, (T, k)."""
            parts = []
            for signal, of_variables in enumerate(slopes):
                of_signal = change[:, (signal * n + j) * len(limited) + i]
                parts.append(ca.repmat(of_signal, 1, of_variables.shape[2]) * of_variables[j])
            return sum(parts)

        return found.T, ca.blockcat([[block(i, j) for j in range(n)] for i in range(len(limited))])


def joined(losses: Sequence[Any], largest: Any) -> Any:
    """Return one loss of several: the largest, and a part of their mean; of one, itself.

    Parameters
    ----------
    losses : numbers or expressions.
    largest : of them.
    """
    if len(losses) == 1:
        return losses[0]
    return largest + _OTHERS * sum(losses) / len(losses)


def slopes_of(motions: MotionFamily, t: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the slopes of q, v and a of each joint by its own variables, (n, T, k) each.

    Parameters
    ----------
    motions : of which the variables are.
    t : (T,) s.
    """
    limits = motions.limits
    found = [limits.speed[:, None, None] * one for one in motions.bases(t)[:3]]
    found[0][:, :, 0] += (limits.upper - limits.lower)[:, None] / 2  # of the centre
    return tuple(found)


@dataclass(frozen=True, eq=False)
class MotionSolver:
    """Ipopt's function, and the rows that it keeps within bounds.

    Attributes
    ----------
    function : casadi.Function of the variables of a motion, joint by joint; behind them, where
        several things are asked, the largest of their losses.
    rows : of the limits.
    """

    function: Any
    rows: LimitRows

    @classmethod
    def of(
        cls,
        motions: MotionFamily,
        informations: tuple[Information, ...],
        instants: tuple[int, int],
        iterations: int,
        torque: LimitedTorque,
        cuts: Sequence[RoomCut] = (),
    ) -> MotionSolver:
        """Write the program out.

        Parameters
        ----------
        motions : among which one is sought.
        informations : what is asked; of several, see `joined`.
        instants : at which columns are evaluated, and at which limits are imposed.
        iterations : at most.
        torque : what is limited of it.
        cuts : bounds on the position at single instants.

        Returns
        -------
        The solver, to be started anywhere.
        """
        limits = motions.limits
        n, size = motions.n, motions.size
        several = len(informations) > 1
        # One symbol: slopes along several that are joined come out wrong in CasADi 3.8.
        unknown = ca.MX.sym("unknown", n * size + int(several))
        variables = ca.reshape(unknown[: n * size], size, n)  # a column for each joint
        half = (limits.upper - limits.lower) / 2
        speed = ca.diag(ca.DM(limits.speed))

        def along(t: np.ndarray) -> tuple[Any, ...]:
            """Position, speed and acceleration, (T, n) each, and all of an instant."""
            moved, v, a = (ca.DM(one) @ variables @ speed for one in motions.bases(t)[:3])
            centre = ca.DM(limits.lower + half).T + variables[0, :] * ca.DM(half).T
            q = ca.repmat(centre, len(t), 1) + moved
            return q, v, a, ca.vertcat(q.T, v.T, a.T, ca.DM(t).T)

        evaluated, count = instants
        *_, every = along(motions.times(evaluated))
        losses = [one.symbolic_loss(every) for one in informations]
        times = motions.times(count)
        q, v, a, inputs = along(times)
        rows = LimitRows()
        rows.add(q / ca.repmat(ca.DM(half).T, count, 1), limits.lower / half, limits.upper / half)
        ones = np.ones(n)
        rows.add(v / ca.repmat(ca.DM(limits.speed).T, count, 1), -ones, ones)
        rows.add(a / ca.repmat(ca.DM(limits.acceleration).T, count, 1), -ones, ones)
        if (limited := np.flatnonzero(limits.jerk_limited)).size:
            *_, basis = motions.bases(motions.to_the_end(count))
            share = ca.diag(ca.DM((limits.speed / limits.jerk)[limited]))
            jerk = ca.DM(basis) @ variables[:, limited.tolist()] @ share
            rows.add(jerk, -np.ones(limited.size), np.ones(limited.size))
        if torque.joints:
            needed, of_torque = torque.shares(inputs, slopes_of(motions, times))
            rows.add(needed, -np.ones(needed.shape[1]), np.ones(needed.shape[1]), of_torque)
        if cuts:
            held, *_ = along(np.array([one.t for one in cuts]))
            of_room = np.array([one.slope for one in cuts])
            rows.add_bounds(
                ca.sum2(held * ca.DM(of_room)),
                np.array([one.least for one in cuts]),
                np.full(len(cuts), np.inf),
            )
        loss = losses[0]
        if several:
            largest = unknown[-1]  # none is above it
            over = ca.vertcat(*(one - largest for one in losses))
            rows.add_bounds(over, np.full(len(losses), -np.inf), np.zeros(len(losses)))
            loss = joined(losses, largest)
        # Without what no motion changes: the search ends by changes in relation to its size.
        units = [one.unit for one in informations]
        objective = loss - joined(units, max(units))
        program = {"x": unknown, "f": objective, "g": ca.vertcat(*rows.parts)}
        options = _options(iterations) | {"jac_g": rows.jacobian(unknown)}
        return cls(ca.nlpsol("design", "ipopt", program, options), rows)


class LazySolver:
    """A program that limits the torques of those joints alone that come near to what they may.

    Rows of torques are dense, and most of a program's time; most robots' speeds and accelerations
    keep their torques far from their limits.

    Parameters
    ----------
    write : the program that limits some torques, with some cuts.
    torque : what is limited of it so far.
    cuts : see `MotionSolver.of`.
    """

    def __init__(
        self,
        write: Callable[[LimitedTorque, Sequence[RoomCut]], MotionSolver],
        torque: LimitedTorque,
        cuts: Sequence[RoomCut] = (),
    ) -> None:
        self._write, self._cuts = write, tuple(cuts)
        self.torque = torque
        self._written: MotionSolver | None = None

    @property
    def solver(self) -> MotionSolver:
        """The program as it stands."""
        if self._written is None:
            self._written = self._write(self.torque, self._cuts)
        return self._written

    def limit(self, joints: Collection[int]) -> bool:
        """Limit the torques of further joints, from now on; whether there are any."""
        known = frozenset(self.torque.joints)
        if known.issuperset(joints):
            return False
        self.torque = replace(self.torque, joints=known.union(joints))
        self._written = None
        return True

    def cut(self, cuts: Sequence[RoomCut]) -> LazySolver:
        """Return the program with other cuts."""
        return LazySolver(self._write, self.torque, cuts)


def _options(iterations: int) -> dict[str, Any]:
    """Of Ipopt, through CasADi."""
    return {
        "print_time": False,
        "show_eval_warnings": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": 1e-4,
            "max_iter": iterations,
            # Losses are logarithms: fifteen steps that change one by less than this share of it
            # each end a search, however far slopes are from zero.
            "acceptable_tol": 100.0,
            "acceptable_obj_change_tol": 1e-4,
            "acceptable_iter": 15,
            "hessian_approximation": "limited-memory",
            "limited_memory_max_history": 10,
            # One solution of the large system an iteration, not one for each vector of the history.
            "limited_memory_aug_solver": "extended",
        },
    }


class LimitRows:
    """Rows of limits: expressions, their slopes where these are written out, and their bounds."""

    def __init__(self) -> None:
        self.parts: list[Any] = []
        self.slopes: list[Any] = []
        self.lower = np.zeros(0)
        self.upper = np.zeros(0)

    def add(
        self, expression: Any, lower: np.ndarray, upper: np.ndarray, slopes: Any = None
    ) -> None:
        """Add rows.

        Parameters
        ----------
        expression : (T, n).
        lower, upper : (n,) bounds of each column.
        slopes : as for `add_bounds`, of the columns one below the other.
        """
        count = expression.shape[0]
        bounds = np.repeat(lower, count), np.repeat(upper, count)
        self.add_bounds(ca.vec(expression), *bounds, slopes)

    def add_bounds(
        self, expression: Any, lower: np.ndarray, upper: np.ndarray, slopes: Any = None
    ) -> None:
        """Add rows, each with its own bounds.

        Parameters
        ----------
        expression : (k,).
        lower, upper : (k,).
        slopes : (k, u) by the first u variables; where there are none CasADi finds them.
        """
        self.parts.append(expression)
        self.slopes.append(slopes)
        self.lower = np.concatenate([self.lower, lower])
        self.upper = np.concatenate([self.upper, upper])

    def jacobian(self, unknown: Any) -> Any:
        """Return the function of the variables, and of no parameters, that Ipopt asks for.

        Parameters
        ----------
        unknown : (v,) symbols of the variables.

        Returns
        -------
        The rows, and their slopes.
        """
        slopes = []
        for part, known in zip(self.parts, self.slopes, strict=True):
            if known is None:
                slopes.append(ca.jacobian(part, unknown))
                continue
            others = ca.MX(known.shape[0], unknown.shape[0] - known.shape[1])
            slopes.append(ca.horzcat(known, others))
        values = [ca.vertcat(*self.parts), ca.vertcat(*slopes)]
        none = ca.MX.sym("none", 0, 0)
        return ca.Function("nlp_jac_g", [unknown, none], values, ["x", "p"], ["g", "jac_g_x"])
