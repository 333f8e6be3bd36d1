"""The motion that tells the most within limits: a nonlinear program, solved by Ipopt.

Variables are amplitudes; position, speed and acceleration are linear in them, and the torque is
not. The limits hold on a grid of instants while the program is solved; then the motion is looked at
on ten times as many, and made smaller about its centre until none is exceeded there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import lazy_loader
import numpy as np

from dynident.errors import DesignError
from dynident.experiment_design.information import Information
from dynident.experiment_design.motion_limits import MotionLimits
from dynident.experiment_design.periodic import PeriodicMotions

ca: Any = lazy_loader.load("casadi")
_PER_HARMONIC = 22  # instants
_LEAST = 100
FINER = 10
"""Instants at which limits are checked, over those at which they were imposed."""
_TRIED = 150  # random motions for each start
_ITERATIONS = 150
_SHRINKS = 100
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignedMotion:
    """A motion within limits, and how its program ended.

    Attributes
    ----------
    variables : (n, 2 H - 1).
    loss : of its information.
    status : of Ipopt, in words.
    iterations : of Ipopt.
    """

    variables: np.ndarray
    loss: float
    status: str
    iterations: int


def instants_of(motions: PeriodicMotions) -> int:
    """Return at how many instants limits are imposed, and columns evaluated."""
    return max(_LEAST, _PER_HARMONIC * motions.harmonics)


@dataclass(frozen=True, eq=False)
class MotionProgram:
    """The search for the motion that tells the most.

    Attributes
    ----------
    information : what is asked.
    motions : among which it is sought.
    """

    information: Information
    motions: PeriodicMotions

    @property
    def instants(self) -> int:
        """Instants at which limits are imposed and columns evaluated."""
        return instants_of(self.motions)

    @property
    def limits(self) -> MotionLimits:
        """Of the motion."""
        return self.motions.limits

    # --- what a motion tells ------------------------------------------------------------------

    def loss(self, variables: np.ndarray) -> float:
        """Return the loss of some variables, on the grid of the program."""
        t = self.motions.times(self.instants)
        motion = self.motions.fourier(variables).at(t)
        return self.information.loss(self.information.matrix(t, motion))

    def within(self, variables: np.ndarray) -> np.ndarray | None:
        """Return the motion, made smaller until no limit is exceeded; None where that fails.

        Parameters
        ----------
        variables : (n, 2 H - 1).
        """
        t = self.motions.times(FINER * self.instants)
        found = np.array(variables)
        found[:, 0] = np.clip(found[:, 0], -0.999, 0.999)
        for _ in range(_SHRINKS):
            over = self.excess(found, t)
            if over <= 1.0:
                return found
            found[:, 1:] *= (1.0 - _ROUNDING) / over if np.isfinite(over) else 0.5
        return None

    def excess(self, variables: np.ndarray, t: np.ndarray) -> float:
        """Return the largest share of a limit that a motion uses.

        Parameters
        ----------
        variables : (n, 2 H - 1).
        t : (T,) s, at which it is looked at.
        """
        limits = self.limits
        series = self.motions.fourier(variables)
        q, v, a = series.at(t)
        torque = self.information.columns.torque_along(t, q, v, a)
        moved = q - series.centre
        shares = [
            moved / np.where(moved > 0, limits.upper - series.centre, series.centre - limits.lower),
            np.abs(v) / limits.speed,
            np.abs(a) / limits.acceleration,
            np.abs(torque) / limits.torque,
        ]
        used = np.abs(np.concatenate(shares, axis=1))
        # What is no number is within no limit.
        return float(used.max()) if np.all(np.isfinite(used)) else float("inf")

    # --- the program --------------------------------------------------------------------------

    def solved(
        self, starts: int, seed: int, progress: Callable[[str], None] = lambda _: None
    ) -> DesignedMotion:
        """Return the best motion of several starts.

        Parameters
        ----------
        starts : how many random motions the search begins at.
        seed : of these.
        progress : is called with what is being done.

        Raises
        ------
        DesignError
            If no start ends at a motion within the limits.
        """
        begins = self._begins(starts, seed)
        solver, rows = self._solver()
        found: list[DesignedMotion] = []
        for number, begin in enumerate(begins, 1):
            progress(f"start {number} of {len(begins)}")
            one = self._from(solver, rows, begin.variables)
            # Narrow laws have many optima: what was found by chance may be better.
            found += [begin] if one is None else [one, begin]
        if not found:
            remedy = "widen them, or shorten the motion's reach"
            raise DesignError("no motion was found within the limits", remedy=remedy)
        return min(found, key=lambda one: one.loss)

    def _begins(self, starts: int, seed: int) -> list[DesignedMotion]:
        """The best of many random motions within the limits."""
        rng = np.random.default_rng(seed)
        found = []
        for number in rng.integers(0, 2**31, starts * _TRIED):
            variables = self.within(self.motions.random(int(number)))
            if variables is not None:
                status = "no better motion than a random one"
                loss = self.loss(variables)
                found.append(
                    DesignedMotion(variables=variables, loss=loss, status=status, iterations=0)
                )
        return sorted(found, key=lambda one: one.loss)[:starts]

    def _from(self, solver: Any, rows: _LimitRows, start: np.ndarray) -> DesignedMotion | None:
        from dynident.nlp.ipopt import interruptible

        bound = np.full(start.shape, np.inf)
        bound[:, 0] = 0.999
        with interruptible():
            result = solver(
                x0=start.ravel(),
                lbx=-bound.ravel(),
                ubx=bound.ravel(),
                lbg=rows.lower,
                ubg=rows.upper,
            )
        stats = solver.stats()
        variables = result["x"].full().reshape(start.shape)
        if not np.all(np.isfinite(variables)):
            return None
        best = self.within(variables)
        if best is None:
            return None
        return DesignedMotion(
            variables=best,
            loss=self.loss(best),
            status=str(stats["return_status"]).replace("_", " "),
            iterations=int(stats["iter_count"]),
        )

    def _solver(self) -> tuple[Any, _LimitRows]:
        motions, limits, count = self.motions, self.limits, self.instants
        n, size = motions.n, motions.size
        t = motions.times(count)
        bases = [ca.DM(one) for one in motions.bases(t)]
        z = ca.MX.sym("z", n * size)
        variables = ca.reshape(z, size, n)  # a column for each joint
        half = (limits.upper - limits.lower) / 2
        centre = ca.DM(limits.lower + half).T + variables[0, :] * ca.DM(half).T
        speed = ca.diag(ca.DM(limits.speed))
        moved, v, a = (one @ variables @ speed for one in bases)
        q = ca.repmat(centre, count, 1) + moved
        inputs = ca.vertcat(q.T, v.T, a.T, ca.DM(t).T)
        columns = self.information.columns
        wide = columns.function.map(count)(inputs)
        loss = self.information.symbolic_loss(wide, count)
        rows = _LimitRows()
        rows.add(q / ca.repmat(ca.DM(half).T, count, 1), limits.lower / half, limits.upper / half)
        ones = np.ones(n)
        rows.add(v / ca.repmat(ca.DM(limits.speed).T, count, 1), -ones, ones)
        rows.add(a / ca.repmat(ca.DM(limits.acceleration).T, count, 1), -ones, ones)
        limited = np.flatnonzero(np.isfinite(limits.torque))
        if len(limited):
            torque = columns.torque.map(count)(inputs).T[:, limited.tolist()]
            torque = torque / ca.repmat(ca.DM(limits.torque[limited]).T, count, 1)
            rows.add(torque, -np.ones(len(limited)), np.ones(len(limited)))
        options = {
            "print_time": False,
            "show_eval_warnings": False,
            "ipopt": {
                "print_level": 0,
                "sb": "yes",
                "tol": 1e-4,
                "max_iter": _ITERATIONS,
                "hessian_approximation": "limited-memory",
                "limited_memory_max_history": 20,
            },
        }
        program = {"x": z, "f": loss, "g": ca.vertcat(*rows.parts)}
        return ca.nlpsol("design", "ipopt", program, options), rows


class _LimitRows:
    """Rows of limits: expressions, and their bounds."""

    def __init__(self) -> None:
        self.parts: list[Any] = []
        self.lower = np.zeros(0)
        self.upper = np.zeros(0)

    def add(self, expression: Any, lower: np.ndarray, upper: np.ndarray) -> None:
        """Add (T, n) rows with bounds (n,) each."""
        count = expression.shape[0]
        self.parts.append(ca.vec(expression))
        self.lower = np.concatenate([self.lower, np.repeat(lower, count)])
        self.upper = np.concatenate([self.upper, np.repeat(upper, count)])
