"""The motion that tells the most within limits: a nonlinear program, solved by SLSQP.

Variables are amplitudes; position, speed, acceleration and jerk are linear in them, and the torque
is not. Linear limits hold on a grid of instants while the program is solved, or on a part of it.
Then the motion is looked at on ten times as many: where it exceeds a limit or leaves the workspace
it is bounded there and solved again, and at last made smaller about its centre until nothing is
exceeded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice

import numpy as np

from dynident.errors import DesignError
from dynident.experiment_design.columns.predicted_torque import PredictedTorque
from dynident.experiment_design.geometry.workspace import RoomCut, Workspace
from dynident.experiment_design.information import Information
from dynident.experiment_design.motion_limits import MotionLimits, above_instants
from dynident.experiment_design.motion_solver import (
    CENTRES,
    DesignedMotion,
    MotionSolver,
    joined,
    terms_of,
)
from dynident.experiment_design.motions.limited_motions import torque_shares
from dynident.experiment_design.motions.motion_family import MotionFamily

_PER_WAVE = 14  # instants
_LEAST, _LEAST_NARROW = 64, 300
FINER = 10
"""Instants at which limits are checked, over those at which they were imposed."""
_TRIED, _GLANCES = 20, 4  # random motions for each search, and those of them that are bettered
_GLANCE = 8  # iterations, after which the best of these are sought on from
_MORE = 10  # that are drawn at most, over those whose centre is free
_NARROW_STARTS = 2
"""Searches for narrow laws, over those for others: they end at many places. To go to them by way of
wider laws leads to no better motions than as many searches from elsewhere do."""
_MANY, _EACH = 120, 3
"""Variables over which a search begins with the limits of every third instant; between these a
motion may use a fifth more, at most 1 / cos(3 pi / 14) of a limit. With seven joints of 14
harmonics (189 variables) all parameters took 50 s in place of 86, of 20 harmonics 131 s in place of
more than 280, and sigma was the same to 2 %; with 8 (105 variables) and fewer nothing was gained,
and the first glances, if they have fewer limits, are at worse motions."""
_ITERATIONS, _ITERATIONS_ALL = 150, 300  # of a search, and of all that go on from where one ended
_ROUNDS = 12  # of these
_SHRINKS, _LEAST_SHRINK = 100, 1.0 - 1e-3  # the latter of a motion that is just beyond
_SHRINKS_CLEAR, _SHRINK_CLEAR = 20, 0.85
_USUAL = 0.3  # of a random motion's size
_NEAR = 0.7  # of a limit of torque, from which on the search imposes it from the beginning
_LARGE = 0.5  # of a limit of torque, from which on an instant of such a joint counts
_TIGHTER = 0.998  # of what is left of a limit of torque that turns out exceeded between instants
_LOST = 0.02  # of a loss, for each logarithm that it sums, by making a motion smaller: no matter


def instants_of(motions: MotionFamily) -> int:
    """Return at how many instants limits are imposed on motions."""
    return max(_LEAST, _PER_WAVE * motions.waves)


@dataclass(frozen=True, eq=False, kw_only=True)
class MotionProgram:
    """The search for the motion that tells the most.

    Attributes
    ----------
    informations : what is asked; of several, the one that is told least counts, and the others
        a little.
    motions : among which it is sought.
    torque : that is limited.
    narrow : whether a law among them acts in a narrow range of speeds: then there are more instants
        and more searches.
    workspace : that the robot stays in.
    """

    informations: tuple[Information, ...]
    motions: MotionFamily
    torque: PredictedTorque
    narrow: bool = False
    workspace: Workspace = field(default_factory=Workspace)

    @property
    def information(self) -> Information:
        """The first of what is asked."""
        return self.informations[0]

    @property
    def instants(self) -> int:
        """Instants at which columns are evaluated."""
        return max(_LEAST_NARROW if self.narrow else 0, instants_of(self.motions))

    @property
    def limits(self) -> MotionLimits:
        """Of the motion."""
        return self.motions.limits

    # --- what a motion tells ------------------------------------------------------------------

    def told(self, information: Information, variables: np.ndarray) -> np.ndarray:
        """Return what the motion of some variables adds to what is known, on a fine grid, (k, k).

        Parameters
        ----------
        information : what is asked.
        variables : (n, 1 + k).
        """
        return self._matrix(information, variables, FINER * self.instants)

    def loss(self, variables: np.ndarray, finer: int = 1) -> float:
        """Return the loss of some variables; of several informations, see `joined`.

        Parameters
        ----------
        variables : (n, 1 + k).
        finer : instants, over those of the program.
        """
        losses = self._losses(variables, finer)
        return joined(losses, max(losses))

    def _losses(self, variables: np.ndarray, finer: int = 1) -> list[float]:
        count = finer * self.instants
        return [one.loss(self._matrix(one, variables, count)) for one in self.informations]

    def _matrix(self, information: Information, variables: np.ndarray, count: int) -> np.ndarray:
        t = self.motions.times(count)
        return information.matrix(t, self.motions.trajectory(variables).at(t))

    def within(self, variables: np.ndarray) -> np.ndarray | None:
        """Return the motion, made smaller until no limit is exceeded; None where that fails.

        Parameters
        ----------
        variables : (n, 1 + k).
        """
        found = self._limited(variables)
        if found is None or self.workspace.is_free:
            return found
        if not self.workspace.admits(self.motions.centre(found)[None]):
            return None  # no shrinking helps
        # Most motions that leave the workspace do so at few instants already, which cost little.
        coarse, fine = (self.motions.times(k * self.instants) for k in (1, FINER))
        for _ in range(_SHRINKS_CLEAR):
            if self._is_inside(found, coarse) and self._is_inside(found, fine):
                return found
            found[:, 1:] *= _SHRINK_CLEAR
        return None

    def _is_inside(self, variables: np.ndarray, t: np.ndarray) -> bool:
        return self.workspace.admits(self.motions.trajectory(variables).at(t)[0])

    def _limited(self, variables: np.ndarray, finer: int = FINER) -> np.ndarray | None:
        """The motion within the limits at `finer` times the instants, in the workspace or not."""
        t = self.motions.times(finer * instants_of(self.motions))
        found = np.array(variables)
        found[:, 0] = np.clip(found[:, 0], -CENTRES, CENTRES)
        still = np.array(found)
        still[:, 1:] = 0.0
        # What its own weight takes of a drive where the robot stands, no smaller motion gives back.
        at_rest = self._shares(still, t[:1])
        if at_rest.max() >= 1.0:
            return None
        for _ in range(_SHRINKS):
            used = self._shares(found, t)
            if used.max() <= 1.0:
                return found
            if np.all(np.isfinite(used)):
                # As if shares grew evenly from those at rest; those of torques grow faster.
                more = used > 1.0
                left = (1.0 - at_rest[more]) / (used[more] - at_rest[more])
                found[:, 1:] *= min(left.min(), _LEAST_SHRINK)
            else:
                found[:, 1:] *= 0.5
        return None

    def excess(self, variables: np.ndarray, t: np.ndarray) -> float:
        """Return the largest share of a limit that a motion uses.

        Parameters
        ----------
        variables : (n, 1 + k).
        t : (T,) s, at which it is looked at, evenly spaced over a period.
        """
        return float(self._shares(variables, t).max())

    def _shares(self, variables: np.ndarray, t: np.ndarray) -> np.ndarray:
        """The largest share of each limit that a motion uses, (5 n,)."""
        q, v, a = self.motions.trajectory(variables).at(t)
        torque = self.torque.farthest(t, q, v, a)
        shares = self.limits.shares(q, (v, a, torque), self.motions.centre(variables))
        if not self.limits.jerk_limited.any():
            return np.append(shares, np.zeros(self.motions.n))
        jerk = self.motions.jerk(variables, self.motions.to_the_end(len(t)))
        return np.append(shares, self.limits.jerk_shares(jerk))

    # --- the program --------------------------------------------------------------------------

    def solved(
        self, starts: int, seed: int, progress: Callable[[str], None] = lambda _: None
    ) -> DesignedMotion:
        """Return the best motion of several starts.

        Parameters
        ----------
        starts : how many searches there are, of each question but narrow ones, which have twice as
            many.
        seed : of the random motions that they begin with.
        progress : is called with what is being done.

        Raises
        ------
        DesignError
            If no start ends at a motion within the limits.
        """
        solver = self.solver()
        progress("looking for beginnings")
        begins = self._begins(starts * (_NARROW_STARTS if self.narrow else 1), seed)
        found = list(begins)
        for number, begin in enumerate(begins, 1):
            progress(f"start {number} of {len(begins)}")
            found += self.ends(solver, begin.variables)
        if not found:
            what = "no motion was found within the limits"
            if not self.workspace.is_free:
                what += f" that {self.workspace.in_words()}"
            raise DesignError(what, remedy="widen them, or shorten the motion's reach")
        # Narrow laws have many optima: what was found by chance may be better. And instants that
        # the program does not see count here.
        fine = [replace(one, loss=self.loss(one.variables, FINER)) for one in found]
        return min(fine, key=lambda one: one.loss)

    def solver(self) -> MotionSolver:
        """Return the search, to be started anywhere."""
        return self._solver(self.instants, _ITERATIONS)

    def _solver(self, evaluated: int, iterations: int) -> MotionSolver:
        each = _EACH if self.motions.n * self.motions.size > _MANY else 1
        instants = evaluated, instants_of(self.motions), each
        shares = torque_shares(self.torque.columns.torque, self._torque_left)
        return MotionSolver.of(self.motions, self.informations, instants, iterations, shares)

    @cached_property
    def _torque_left(self) -> np.ndarray:
        """Limits of the torque that is predicted, so that what is not known of it has room."""
        motions, t = self.motions, self.motions.times(instants_of(self.motions))
        usual = motions.trajectory(motions.random(0) * _USUAL).at(t)
        return self.limits.torque * self.torque.certain(self.limits, t, *usual)

    def _large_torques(self, variables: np.ndarray, joints: np.ndarray) -> set[tuple[float, int]]:
        """Instants (s) at which the torques of some joints, (n,) mask, are large, and the joints.

        Where it peaks alone is not enough: then it peaks elsewhere. And of many rows that are
        nearly the same from one instant to the next SLSQP fails to make a step.
        """
        t = self.motions.times(instants_of(self.motions))
        torque = self.torque.along(t, *self.motions.trajectory(variables).at(t))
        large = (np.abs(torque) > _LARGE * self._torque_left) & joints
        return {(float(t[k]), int(j)) for k, j in np.argwhere(large)}

    def _torque_shares(self, variables: np.ndarray) -> np.ndarray:
        """The largest share of each limit of torque that a motion uses, (n,)."""
        t, n = self.motions.times(FINER * instants_of(self.motions)), self.motions.n
        return self._shares(variables, t)[3 * n : 4 * n]

    def _begins(self, starts: int, seed: int) -> list[DesignedMotion]:
        """The best motions that a few iterations make of random ones, within the limits."""
        tried = starts * _TRIED
        numbers = np.random.default_rng(seed).integers(0, 2**31, _MORE * tried)
        drawn = (self.motions.random(int(number)) for number in numbers)
        # About a centre that is not free there is no room for a motion of any size.
        free = (one for one in drawn if self.workspace.admits(self.motions.centre(one)[None]))
        some = (self._limited(one, finer=1) for one in islice(free, tried))
        found = [
            DesignedMotion(variables=one, loss=self.loss(one)) for one in some if one is not None
        ]
        found.sort(key=lambda one: one.loss)
        # Fine grids and distances are costly: they are looked at from the best motion on.
        clear = (one for begin in found for one in self._within(begin))
        begins = list(islice(clear, _GLANCES * starts))
        short = self._solver(instants_of(self.motions), _GLANCE)
        for begin in tuple(begins):
            near = self._torque_shares(begin.variables) > _NEAR
            torques = self._large_torques(begin.variables, near)
            begins += self._within(self._ended(short.limiting(torques), begin.variables))
        return sorted(begins, key=lambda one: one.loss)[:starts]

    def _within(self, motion: DesignedMotion) -> list[DesignedMotion]:
        """The motion, made smaller until it is within all limits; none where that fails.

        Where that costs it much, it is at no optimum any more.
        """
        if not np.all(np.isfinite(motion.variables)):
            return []
        best = self.within(motion.variables)
        if best is None:
            return []
        found = replace(motion, variables=best, loss=self.loss(best))
        return [replace(found, settled=motion.settled and not self._is_worse(found, motion))]

    def _is_worse(self, smaller: DesignedMotion, motion: DesignedMotion) -> bool:
        """Whether a motion has lost much by being made smaller."""
        lost = smaller.loss - self.loss(motion.variables)
        return lost > _LOST * terms_of(self.informations)

    def _ended(self, solver: MotionSolver, start: np.ndarray) -> DesignedMotion:
        """Where a search ends, each joint whose range the motion fits into moved to within that.

        Between the instants of a search a motion may be a little beyond one end of a range. About a
        centre that is near it, it would have to be made very small.
        """
        ended = solver.ended(start)
        if not np.all(np.isfinite(ended.variables)):
            return ended
        limits, found = self.limits, ended.variables
        q = self.motions.trajectory(found).at(self.motions.times(FINER * self.instants))[0]
        reach = above_instants(q).max(axis=0)
        below, above = limits.lower - q.min(axis=0) + reach, q.max(axis=0) + reach - limits.upper
        moved = np.where(below + above < 0, np.maximum(below, 0.0) - np.maximum(above, 0.0), 0.0)
        centre = found[:, 0] + moved / ((limits.upper - limits.lower) / 2)
        centre = np.clip(centre, -CENTRES, CENTRES)
        return replace(ended, variables=np.column_stack([centre, found[:, 1:]]))

    def ends(self, solver: MotionSolver, start: np.ndarray) -> list[DesignedMotion]:
        """Return the motion at which the search from a start ends; none if none is within limits.

        Parameters
        ----------
        solver : the search, of motions within the linear limits that it imposes. Where a motion is
            beyond others, beyond those of torque, or out of the workspace, it is bounded there, and
            the search goes on.
        start : (n, 1 + k), of a motion within all limits and in the workspace.
        """
        torques = self._large_torques(start, self._torque_shares(start) > _NEAR)
        room, cuts = np.ones(self.motions.n), []
        inside, best, spent = start, None, 0
        for _ in range(_ROUNDS):
            limited = solver.limiting(torques, room)
            ended = self._ended(limited.cut(cuts), start)
            spent += ended.iterations
            every = [ended]
            if not ended.settled and start is not inside:
                ended = self._ended(limited.cut(cuts, inside), inside)
                spent += ended.iterations
                every.append(ended)
            for one in every:
                (within,) = self._within(one) or (None,)
                if within is not None and (best is None or within.loss < best.loss):
                    best, inside = replace(within, iterations=spent), within.variables
            done = within is not None and not self._is_worse(within, ended)
            if done or spent >= _ITERATIONS_ALL or not np.all(np.isfinite(ended.variables)):
                break
            # It goes on from there, or one bound pushes it to where it is beyond another.
            start = ended.variables
            wider = solver.imposing(start)
            if wider is not solver:
                solver = wider
                continue  # torques of a motion that is too fast say nothing
            shares = self._torque_shares(start)
            beyond, new = shares > 1.0, self._cuts(start)
            if not beyond.any() and not new:
                break
            room = np.where(beyond, room * _TIGHTER / np.maximum(shares, 1.0), room)
            torques, cuts = torques | self._large_torques(start, beyond), cuts + new
        return [] if best is None else [best]

    def _cuts(self, variables: np.ndarray) -> list[RoomCut]:
        if self.workspace.is_free:
            return []
        t = self.motions.times(FINER * self.instants)
        return self.workspace.cuts(t, self.motions.trajectory(variables).at(t)[0])
