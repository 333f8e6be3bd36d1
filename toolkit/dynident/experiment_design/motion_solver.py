"""The search for a motion by SciPy's SLSQP: variables, limits on a grid of instants, and a loss.

There are few variables (nine or so a joint) and thousands of limits, nearly all of them linear, of
which few are used at the end. That is what a method of active sets is for: on the arm of
`problems/seven_joint_arm` SLSQP told joint zero from spring better after 48 iterations in 1.2 s
than Ipopt after 150 in 14 s. Its time grows with the rows: it may begin with the limits of some
instants, and others come in where a motion turns out too large. Torques are not linear, and rows of
them at all instants, which are nearly the same from one to the next, made SLSQP fail in one of four
searches: they are limited where they turn out too large, too.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dynident.experiment_design.geometry.workspace import RoomCut
from dynident.experiment_design.information import Information, LossAlong
from dynident.experiment_design.motions.limited_motions import (
    LimitedTorque,
    MotionGrid,
    Rows,
    linear_limits,
)
from dynident.experiment_design.motions.motion_family import MotionFamily

_OTHERS = 0.2
"""Weight of the mean of several losses beside the largest. Of the largest alone, joints that the
worst told pair does not need stood still: in `problems/which_of_two` three pairs were told by 15,
13 and 17 standard deviations, and with the mean by 416, 105 and 15."""
CENTRES = 0.999
"""Of half a joint's range: how far the centre of a motion may be from its middle."""
_ROUNDING = 1e-6  # of what is left of a limit
_CLOSE = 0.8  # share of a limit from which on it is imposed where others turn out exceeded
_LOOSEST = 1e-3  # tolerance of SLSQP, which is that of limits, too
_SETTLED = 1e-4  # change of a loss, a logarithm, at which the search ends, for each that it sums


NOT_BETTER = "no better motion than a random one"
"""Status of a motion that no search has bettered."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignedMotion:
    """A motion within limits, and how its program ended.

    Attributes
    ----------
    variables : (n, 1 + k).
    loss : see `MotionProgram.loss`.
    status : of SLSQP, in words, or `NOT_BETTER`.
    iterations : of SLSQP.
    settled : whether it ended at a local optimum, and was not made smaller to be within limits.
    """

    variables: np.ndarray
    loss: float
    status: str = NOT_BETTER
    iterations: int = 0
    settled: bool = False

    @property
    def ended_in_words(self) -> str:
        """How the search for it ended, with the solver's own words."""
        if self.status == NOT_BETTER:
            return f"The search for a better motion failed: {self.status}."
        where = "at" if self.settled else "short of"
        words = f"(SLSQP: {self.status}, {self.iterations} iterations)"
        if not self.settled and self.status.startswith("Optimization terminated"):
            words += ": to be within all limits it was made smaller"
        return f"The search ended {where} a local optimum {words}."


def joined(losses: Sequence[float] | np.ndarray, largest: float) -> float:
    """Return one loss of several: the largest, and a part of their mean; of one, itself.

    Parameters
    ----------
    losses : of each question.
    largest : of them.
    """
    return losses[0] if len(losses) == 1 else largest + _OTHERS * float(np.mean(losses))


def terms_of(informations: Sequence[Information]) -> int:
    """Return how many logarithms the loss of some questions is the sum of."""
    return max(one.terms for one in informations)


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionSolver:
    """The search, to be started anywhere.

    Attributes
    ----------
    motions : among which one is sought.
    grid : of the instants at which columns are evaluated.
    losses : of each question.
    terms : logarithms that the loss is the sum of.
    limits : rows of position, speed, acceleration and jerk at all instants.
    imposed : (r,) which of them are.
    shares : see `torque_shares`.
    iterations : at most.
    torque : that is limited, if any is.
    cuts : bounds on positions, if there are any.
    """

    motions: MotionFamily
    grid: MotionGrid
    losses: tuple[LossAlong, ...]
    terms: int
    limits: Rows
    imposed: np.ndarray
    shares: Any
    iterations: int
    torque: LimitedTorque | None = None
    cuts: Rows | None = None

    @classmethod
    def of(
        cls,
        motions: MotionFamily,
        informations: tuple[Information, ...],
        instants: tuple[int, int, int],
        iterations: int,
        shares: Any,
    ) -> MotionSolver:
        """Write the program out.

        Parameters
        ----------
        motions : among which one is sought.
        informations : what is asked; of several, see `joined`.
        instants : at which columns are evaluated, at which there are limits, and of how many of
            these it is given the limits of one, see `imposing`.
        iterations : at most.
        shares : see `torque_shares`.

        Returns
        -------
        The solver, which limits no torque yet.
        """
        evaluated, count, each = instants
        grid, limited = (MotionGrid.of(motions, motions.times(one)) for one in (evaluated, count))
        rows, imposed = linear_limits(motions, limited, each)
        return cls(
            motions=motions,
            grid=grid,
            losses=tuple(LossAlong(one, evaluated) for one in informations),
            terms=terms_of(informations),
            limits=rows,
            imposed=imposed,
            shares=shares,
            iterations=iterations,
        )

    @property
    def linear(self) -> Rows:
        """What is imposed and is linear in the variables."""
        limits = Rows(self.limits.values[self.imposed], self.limits.slopes[self.imposed])
        return limits if self.cuts is None else Rows.joined([limits, self.cuts])

    def imposing(self, variables: np.ndarray) -> MotionSolver:
        """Return the search with more limits where a motion exceeds some that are not imposed.

        Parameters
        ----------
        variables : (n, k).
        """
        left = self.limits.at(variables.ravel())
        if left[~self.imposed].min(initial=0.0) >= -_LOOSEST:
            return self
        return replace(self, imposed=self.imposed | (left < 1.0 - _CLOSE))

    def limiting(
        self, torques: Collection[tuple[float, int]], room: np.ndarray | None = None
    ) -> MotionSolver:
        """Return the search with limits on the torques of some joints at some instants alone.

        Parameters
        ----------
        torques : instants, in s, and joints.
        room : (n,) shares of the limits that may be used; None for all of them.
        """
        if not torques:
            return replace(self, torque=None)
        times, joints = (np.array(one) for one in zip(*sorted(torques), strict=True))
        grid = MotionGrid.of(self.motions, times)
        left = np.ones(len(joints)) if room is None else room[joints]
        return replace(self, torque=LimitedTorque(self.shares, grid, joints, left))

    def cut(self, cuts: Sequence[RoomCut], inside: np.ndarray | None = None) -> MotionSolver:
        """Return the search with bounds on the position at single instants, and no others.

        Parameters
        ----------
        cuts : the bounds.
        inside : (n, k) of a motion that needs none, to begin at: a bound that it does not meet, as
            room is not linear, is moved to where it does. None for bounds as they are.
        """
        if not cuts:
            return replace(self, cuts=None)
        grid = MotionGrid.of(self.motions, np.array([one.t for one in cuts]))
        slopes = np.array(
            [one.slope[:, None] * grid.slopes[0, :, k] for k, one in enumerate(cuts)]
        ).reshape(len(cuts), -1)
        least = np.array([one.least - one.slope @ grid.middle for one in cuts])
        if inside is not None:
            least = np.minimum(least, slopes @ inside.ravel())
        return replace(self, cuts=Rows(-least, slopes))

    def found_losses(self, variables: np.ndarray) -> Rows:
        """Return the loss of each question, and their slopes.

        Parameters
        ----------
        variables : (n, k).
        """
        inputs = self.grid.inputs(variables)
        found = [one(inputs) for one in self.losses]
        return Rows(
            np.array([value for value, _ in found]),
            np.array([self.grid.along(slopes) for _, slopes in found]),
        )

    def ended(self, start: np.ndarray) -> DesignedMotion:
        """Return where the search from a start ends, within the limits or not.

        Parameters
        ----------
        start : (n, k).
        """
        from scipy.optimize import minimize

        from dynident.nlp.ipopt import interruptible

        program = _Program(self, start)
        bound = np.full(start.shape, np.inf)
        bound[:, 0] = CENTRES
        bounds, begin = bound.ravel(), start.ravel()
        if program.several:
            begin = np.append(begin, self.found_losses(start).values.max())
            bounds = np.append(bounds, np.inf)
        spent = 0
        while True:
            with interruptible():  # it arrives now, and not as the design ends
                ended = minimize(
                    program.objective,
                    begin,
                    jac=True,
                    method="SLSQP",
                    bounds=np.column_stack([-bounds, bounds]),
                    constraints={"type": "ineq", "fun": program.left, "jac": program.slopes_left},
                    options={
                        "maxiter": self.iterations - spent,
                        "ftol": min(_SETTLED * self.terms / program.scale, _LOOSEST),
                    },
                )
            spent += int(ended.nit)
            if ended.success:
                x = ended.x
                break
            # It fails where its idea of the curvature has gone wrong: from the best motion within
            # limits it begins with none. Where it found none it goes nowhere.
            x = begin if program.lowest is None else program.lowest
            if spent >= self.iterations or np.array_equal(x, begin):
                break
            begin = x
        variables = x[: start.size].reshape(start.shape)
        losses = self.found_losses(variables).values
        return DesignedMotion(
            variables=variables,
            loss=joined(losses, float(losses.max())),
            status=str(ended.message),
            iterations=spent,
            settled=bool(ended.success),
        )


class _Program:
    """What SLSQP calls; values and slopes of a point are worked out once.

    Of several questions the largest loss is a variable of its own, the last one, which none is
    above.
    """

    def __init__(self, solver: MotionSolver, start: np.ndarray) -> None:
        self._solver, self._shape, self._size = solver, start.shape, start.size
        self._linear = solver.linear
        self.several = len(solver.losses) > 1
        self._at: dict[str, tuple[bytes, Rows]] = {}
        self.lowest: np.ndarray | None = None
        """Of the points at which rows were positive, the one of the lowest loss."""
        self._least = np.inf
        # The first step is as long as the slope: a share of each joint's range and speed.
        self.scale = float(np.linalg.norm(solver.found_losses(start).slopes.mean(axis=0))) or 1.0

    def losses(self, x: np.ndarray) -> Rows:
        """Of the questions, at a point (u,)."""
        return self._once("losses", self._solver.found_losses, x)

    def objective(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """The loss that is minimised, and its slopes."""
        found = self.losses(x)
        if not self.several:
            return float(found.values[0]) / self.scale, found.slopes[0] / self.scale
        slopes = np.append(_OTHERS * found.slopes.mean(axis=0), 1.0)
        return joined(found.values, float(x[-1])) / self.scale, slopes / self.scale

    def left(self, x: np.ndarray) -> np.ndarray:
        """What is left of each limit."""
        found = [self._linear.at(x[: self._size])]
        if self._solver.torque is not None:
            found.append(self._once("torque", self._solver.torque.rows, x).values)
        if self.several:
            found.append(x[-1] - self.losses(x).values)
        left, (loss, _) = np.concatenate(found), self.objective(x)
        if loss < self._least and left.min() >= -_ROUNDING:
            self.lowest, self._least = np.array(x), loss
        return left

    def slopes_left(self, x: np.ndarray) -> np.ndarray:
        """Slopes of `left`."""
        found = [self._linear.slopes]
        if self._solver.torque is not None:
            found.append(self._once("torque", self._solver.torque.rows, x).slopes)
        if not self.several:
            return np.concatenate(found)
        found.append(-self.losses(x).slopes)
        slopes = np.concatenate(found)
        last = np.zeros((len(slopes), 1))
        last[-len(self._solver.losses) :] = 1.0
        return np.hstack([slopes, last])

    def _once(self, name: str, work: Callable[[np.ndarray], Rows], x: np.ndarray) -> Rows:
        key = x[: self._size].tobytes()
        if self._at.get(name, (b"",))[0] != key:
            self._at[name] = key, work(x[: self._size].reshape(self._shape))
        return self._at[name][1]
