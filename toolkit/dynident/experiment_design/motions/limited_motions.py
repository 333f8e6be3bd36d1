"""Limits of motions on a grid of instants, as rows of a nonlinear program and their slopes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dynident.experiment_design.columns.mapped import mapped
from dynident.experiment_design.motions.motion_family import MotionFamily
from dynident.late_modules import LateModule

ca: Any = LateModule("casadi")


@dataclass(frozen=True, eq=False)
class MotionGrid:
    """Instants of a motion, and how it follows from its variables there.

    Attributes
    ----------
    times : (T,) s.
    middle : (n,) positions where all variables are zero.
    slopes : of q, v and a of a joint by its own variables, (3, n, T, k).
    """

    times: np.ndarray
    middle: np.ndarray
    slopes: np.ndarray

    @classmethod
    def of(cls, motions: MotionFamily, times: np.ndarray) -> MotionGrid:
        """Return the grid of some instants, (T,) s."""
        limits = motions.limits
        slopes = np.array([limits.speed[:, None, None] * one for one in motions.bases(times)[:3]])
        slopes[0, :, :, 0] += (limits.upper - limits.lower)[:, None] / 2  # of the centre
        return cls(times, (limits.lower + limits.upper) / 2, slopes)

    def inputs(self, variables: np.ndarray) -> np.ndarray:
        """Return q, v, a and the time at all instants, (T, 3 n + 1).

        Parameters
        ----------
        variables : (n, k).
        """
        signals = np.einsum("sjtk,jk->tsj", self.slopes, variables)
        signals[:, 0] += self.middle
        return np.column_stack([signals.reshape(len(self.times), -1), self.times])

    def along(self, by_inputs: np.ndarray) -> np.ndarray:
        """Return the slopes of a number by the variables, (n k,), from those by the inputs.

        Parameters
        ----------
        by_inputs : (T, 3 n + 1).
        """
        signals, n, count, _ = self.slopes.shape
        of_signals = by_inputs[:, :-1].reshape(count, signals, n)
        return np.einsum("tsj,sjtk->jk", of_signals, self.slopes).ravel()


@dataclass(frozen=True, eq=False)
class Rows:
    """Numbers that are to be positive, and their slopes.

    Attributes
    ----------
    values : (r,).
    slopes : (r, u) by the variables.
    """

    values: np.ndarray
    slopes: np.ndarray

    @classmethod
    def below_one(cls, shares: np.ndarray, slopes: np.ndarray) -> Rows:
        """Return what shares (r,) of limits leave of them, on both sides."""
        return cls(np.concatenate([1.0 - shares, 1.0 + shares]), np.concatenate([-slopes, slopes]))

    @classmethod
    def joined(cls, rows: Sequence[Rows]) -> Rows:
        """Return several as one."""
        return cls(
            np.concatenate([one.values for one in rows]),
            np.concatenate([one.slopes for one in rows]),
        )

    def at(self, variables: np.ndarray) -> np.ndarray:
        """Values of linear rows, whose `values` are those where all variables (u,) are zero."""
        return self.values + self.slopes @ variables


@dataclass(frozen=True, eq=False)
class LimitedTorque:
    """Shares of the limits of some torques at some instants.

    Attributes
    ----------
    function : see `torque_shares`.
    grid : instants, each as often as torques are limited there.
    joints : (k,) whose torque is limited at each of them.
    room : (k,) shares of the limits that are left there.
    """

    function: Any
    grid: MotionGrid
    joints: np.ndarray
    room: np.ndarray

    def rows(self, variables: np.ndarray) -> Rows:
        """Return what a motion leaves of the limits.

        Parameters
        ----------
        variables : (n, k).
        """
        signals, n, count, _ = self.grid.slopes.shape
        share, slope = mapped(self.function, self.grid.inputs(variables)[:, None])
        each = np.arange(count)
        by_signals = slope[each, :, self.joints].reshape(count, signals, n)
        found = np.einsum("tsj,sjtk->tjk", by_signals, self.grid.slopes)
        of_room = found.reshape(count, -1) / self.room[:, None]
        return Rows.below_one(share[each, 0, self.joints] / self.room, of_room)


def torque_shares(torque: Any, most: np.ndarray) -> Any:
    """Return the function of an instant that gives shares of limits of torque, and their slopes.

    Parameters
    ----------
    torque : casadi.Function of q, v, a and the time at an instant: torques (n,).
    most : (n,) N m or N; infinite where there is no limit.

    Returns
    -------
    casadi.Function of q, v, a and the time: shares (n,), and their slopes by q, v and a, (n, 3 n).
    """
    x = ca.SX.sym("x", 3 * len(most) + 1)
    share = ca.densify(torque(x) / ca.DM(most))
    slope = ca.densify(ca.jacobian(share, x)[:, : 3 * len(most)])
    return ca.Function("shares", [x], [share, slope])


def linear_limits(motions: MotionFamily, grid: MotionGrid, each: int) -> tuple[Rows, np.ndarray]:
    """Rows of position, speed, acceleration and jerk, and those of every `each`th instant of them.

    The values of the rows are those where all variables are zero.

    Parameters
    ----------
    motions, grid : whose they are, and at which instants.
    each : of so many instants one is taken; and both ends, where the jerk leaps.

    Returns
    -------
    The rows of all instants (r,), and which of them are those of the chosen ones, (r,) bool.
    """
    limits = motions.limits
    most = np.array([(limits.upper - limits.lower) / 2, limits.speed, limits.acceleration])
    shares = list(grid.slopes / most[:, :, None, None])
    if (limited := np.flatnonzero(limits.jerk_limited)).size:
        *_, basis = motions.bases(motions.to_the_end(len(grid.times)))
        of_jerk = np.zeros((motions.n, *basis.shape))
        of_jerk[limited] = (limits.speed / limits.jerk)[limited, None, None] * basis
        shares.append(of_jerk)
    blocks, begun = [], []
    for kind, share in enumerate(shares):
        whole = np.zeros((*share.shape[:2], motions.n, motions.size))
        for j, one in enumerate(share):
            whole[j, :, j] = one
        blocks.append(whole.reshape(-1, motions.n * motions.size))
        # Of each joint and limit at other instants; and at both ends, where the jerk leaps.
        first = (np.indices(share.shape[:2]).sum(axis=0) + kind) % each == 0
        first[:, [0, -1]] = True
        begun.append(first.ravel())
    slopes, imposed = np.concatenate(blocks), np.concatenate(begun)
    moving = np.any(slopes != 0, axis=1)  # at rest, where a motion begins
    rows = Rows.below_one(np.zeros(np.count_nonzero(moving)), slopes[moving])
    return rows, np.tile(imposed[moving], 2)
