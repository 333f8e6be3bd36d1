"""The torque that a motion will take, with what is not known of it: limits hold for both.

Recordings of small or slow motions say little of the torque of a large and fast one. What they
leave open the description closes, as far as it is right: each link's mass, its centre and its
inertia are taken for off by a fifth, and the posterior of the two is what is predicted with.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dynident.constraints import ParameterSpace
from dynident.experiment_design.carried_load import payload_effect
from dynident.experiment_design.columns.column_function import ColumnFunction
from dynident.experiment_design.motion_limits import MotionLimits, above_instants
from dynident.inertia import distance_rows
from dynident.model import Model

WRONG = 0.2
"""Relative standard deviation of what a description says of a link."""
CENTRE = 0.05
"""Standard deviation of the centre of mass of a load, m, of which nothing is stated."""
SIGMAS = 3.0
"""Standard deviations of the predicted torque that stay below a limit, too."""
_EFFECTS = 100.0
"""Standard deviation of an effect of which descriptions say nothing: so many times the noise."""
_INDEPENDENT = 0.25
"""Share of the rows of a filtered recording that count: neighbours have their noise in common."""
_COARSER = 10
"""Instants from one at which the deviation is worked out to the next; between them it counts as the
larger of the two, and as what a parabola through three of them has above them."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PredictedTorque:
    """The torque of a model along a motion, and how far it may be from the truth.

    Attributes
    ----------
    model, columns : with its columns, whose torque is that of the posterior mean.
    values : (p,) this mean.
    factor : (p, p) of the posterior covariance, factor @ factor.T.
    """

    model: Model
    columns: ColumnFunction
    values: np.ndarray
    factor: np.ndarray

    @classmethod
    def of(
        cls, model: Model, values: np.ndarray, information: np.ndarray, size: np.ndarray
    ) -> PredictedTorque:
        """Join what recordings and the description say.

        Parameters
        ----------
        model : whose torque it is.
        values : (p,) fitted to the recordings.
        information : (p, p) of the recordings about them.
        size : (p,) of each column on usual motions, over the noise.

        Returns
        -------
        The torque that follows from both.
        """
        space = ParameterSpace.of(model)
        inertial = [np.linalg.inv(distance_rows(one)) * WRONG for one in space.references]
        spread = np.zeros((space.size, space.size))
        for k, one in enumerate(inertial):
            spread[10 * k : 10 * k + 10, 10 * k : 10 * k + 10] = one
        # What no usual motion shows may still make a torque: as little is known of it as of any.
        seen = size[size > 0]
        largest = _EFFECTS / np.where(size > 0, size, seen.min() if len(seen) else np.inf)
        for k, effect in zip(
            range(space.rigid, space.size), range(model.base.rank, model.size), strict=True
        ):
            spread[k, k] = largest[effect]
        before = space.combination @ spread  # factor of the prior covariance
        given = space.combination @ space.given
        # The posterior in units of the prior: what no recording shows stays as it was.
        counted = _INDEPENDENT * information
        weighed = np.eye(before.shape[1]) + before.T @ counted @ before
        lower = np.linalg.cholesky(weighed)
        factor = np.linalg.solve(lower, before.T).T
        mean = given + factor @ (factor.T @ (counted @ (values - given)))
        columns = ColumnFunction.of(model, mean)
        return cls(model=model, columns=columns, values=mean, factor=factor)

    def carrying(self, load: np.ndarray) -> PredictedTorque:
        """Return the torque with a load on the last link, whose size and centre may be others.

        Parameters
        ----------
        load : (10,) inertial parameters about the origin of the last joint's frame.
        """
        payload = payload_effect(self.model.robot)
        model = self.model + payload
        own = model.slices[payload.label]
        values = np.insert(self.values, own.start, load)
        spread = np.column_stack([WRONG * load, np.eye(10)[:, 1:4] * (load[0] * CENTRE)])
        factor = np.zeros((model.size, self.factor.shape[1] + spread.shape[1]))
        others = np.delete(np.arange(model.size), np.arange(own.start, own.stop))
        factor[others, : self.factor.shape[1]] = self.factor
        factor[own, self.factor.shape[1] :] = spread
        columns = ColumnFunction.of(model, values, carries_payload=True)
        return replace(self, model=model, columns=columns, values=values, factor=factor)

    def along(self, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return the torque that is predicted, (T, n) N m or N.

        Parameters
        ----------
        t : (T,) s.
        q, v, a : (T, n).
        """
        return self.columns.torque_along(t, q, v, a)

    def farthest(self, t: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """Return the torque with `SIGMAS` standard deviations away from zero, (T, n) N m or N.

        Parameters
        ----------
        t : (T,) s, evenly spaced over a period.
        q, v, a : (T, n).
        """
        torque = self.along(t, q, v, a)
        some = slice(None, None, _COARSER)
        rows = self.columns.along(t[some], q[some], v[some], a[some]) @ self.factor
        coarse = np.linalg.norm(rows, axis=2)
        coarse = coarse + above_instants(coarse)
        between = np.maximum(coarse, np.roll(coarse, -1, axis=0))
        deviation = np.repeat(between, _COARSER, axis=0)[: len(t)]
        return torque + np.copysign(SIGMAS * deviation, torque)

    @property
    def taken_for_known(self) -> PredictedTorque:
        """The same, as if nothing of it were open."""
        return replace(self, factor=np.zeros_like(self.factor))

    def certain(self, limits: MotionLimits, t: np.ndarray, *motion: np.ndarray) -> np.ndarray:
        """Return the share of each limit that is left to what is predicted along a motion, (n,).

        Parameters
        ----------
        limits : of the torque; where there is none, all of it is left.
        t : (T,) s.
        motion : q, v, a, (T, n) each.
        """
        torque, farthest = (
            np.abs(one(t, *motion)).max(axis=0) for one in (self.along, self.farthest)
        )
        limited = np.isfinite(limits.torque) & (farthest > 0)
        return np.where(limited, torque / np.where(limited, farthest, 1.0), 1.0)
