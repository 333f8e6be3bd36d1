"""Columns of a model at one joint, without those that are zero throughout.

A link loads no joint beyond it, and friction its own joint only: of a long chain's columns most
joints have less than half. The rows of a column lie side by side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from dynident.evidence.noise_model import NoiseModel
from dynident.evidence.stacks import Stack
from dynident.moments.second_moments import SecondMoments
from dynident.robot import Robot

_STATES = 16
"""States at which a link is seen to load a joint, or not to."""


@lru_cache(64)
def _loading(robot: Robot) -> np.ndarray:
    """Which columns of the rigid body's regressor are not zero at each joint, (n, 10 n) mask."""
    rng = np.random.default_rng(0)
    q, v, a = rng.uniform(-1.0, 1.0, (3, _STATES, robot.n))
    return np.any(robot.regressor(q, v, a) != 0.0, axis=0)


@dataclass(frozen=True, eq=False)
class RigidColumns:
    """Columns of the base parameters along one motion, joint by joint.

    Attributes
    ----------
    size : number of base parameters, b.
    places : for each joint, which of them load it, (u,).
    rows : for each joint, (u, T).
    """

    size: int
    places: tuple[np.ndarray, ...]
    rows: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, robot: Robot, base: Sequence[int], columns: np.ndarray) -> RigidColumns:
        """Return columns joint by joint.

        Parameters
        ----------
        robot : whose they are.
        base : numbers of the base parameters among the standard ones.
        columns : (T, n, b) of the base parameters.

        Returns
        -------
        The same, without what is zero in any motion.
        """
        loading = _loading(robot)[:, list(base)]
        places = tuple(np.flatnonzero(one) for one in loading)
        rows = tuple(np.ascontiguousarray(columns[:, j, p].T) for j, p in enumerate(places))
        return cls(len(base), places, rows)

    def among(self, rows: slice) -> RigidColumns:
        """Return some rows of the motion."""
        return replace(self, rows=tuple(one[:, rows] for one in self.rows))

    def times(self, values: np.ndarray) -> np.ndarray:
        """Torque (T, n) of values (b,) of the base parameters."""
        pairs = zip(self.places, self.rows, strict=True)
        return np.stack([values[places] @ rows for places, rows in pairs]).T

    def dense(self) -> np.ndarray:
        """All columns, (T, n, b)."""
        found = np.zeros((self.rows[0].shape[1], len(self.rows), self.size))
        for j, (places, rows) in enumerate(zip(self.places, self.rows, strict=True)):
            found[:, j, places] = rows.T
        return found


@dataclass(frozen=True, eq=False)
class JointColumns:
    """Columns of a model and the torque at one joint, along one motion.

    Attributes
    ----------
    size : number of the model's parameters and one for the torque, which is last.
    places : (u,) which of them the columns are that are not zero throughout.
    parts : (T, u_i) these columns, one part after the other.
    """

    size: int
    places: np.ndarray
    parts: tuple[np.ndarray, ...]

    def among(self, rows: slice) -> JointColumns:
        """Return some rows of the motion."""
        return replace(self, parts=tuple(part[rows] for part in self.parts))

    @property
    def used(self) -> np.ndarray:
        """All of them in one piece, (T, u)."""
        return np.concatenate([part.T for part in self.parts]).T

    def with_torque(self, torque: np.ndarray) -> JointColumns:
        """Return the columns with another torque (T,)."""
        return replace(self, parts=(*self.parts[:-1], torque[:, None]))

    def times(self, combination: np.ndarray) -> np.ndarray:
        """Sum of the columns, each times its number of (p + 1,); (T,)."""
        chosen, first = combination[self.places], 0
        found = np.zeros(len(self.parts[0]))
        for part in self.parts:
            last = first + part.shape[1]
            found += part @ chosen[first:last]
            first = last
        return found

    def dense(self) -> np.ndarray:
        """All columns and the torque, (T, p + 1)."""
        found = np.zeros((len(self.parts[0]), self.size))
        found[:, self.places] = self.used
        return found


@dataclass(frozen=True, eq=False, kw_only=True)
class WhiteColumns:
    """Columns of a model and the torque at one joint in runs that are alike, whitened and folded.

    Attributes
    ----------
    stack : whose rows they are.
    noise : by which the rows are whitened.
    size, places : as of `JointColumns`.
    parts : of each run, of each replicate, the columns that were whitened.
    rows : (B, u, P, L) whitened, but for a factor.
    squares : (B, u, u) moments of these rows.
    factor : by which the rows are to be multiplied.
    """

    stack: Stack
    noise: NoiseModel
    size: int
    places: np.ndarray
    parts: tuple[tuple[tuple[np.ndarray, ...], ...], ...]
    rows: np.ndarray
    squares: SecondMoments
    factor: float = 1.0

    @classmethod
    def of(
        cls,
        stack: Stack,
        joint: int,
        noise: NoiseModel,
        columns: Sequence[Sequence[JointColumns]],
    ) -> WhiteColumns:
        """Whiten the columns of each replicate of some runs.

        Parameters
        ----------
        stack, joint : where they are columns.
        noise : of that joint.
        columns : of each run, of each replicate.

        Returns
        -------
        With their moments.
        """
        one = columns[0][0]
        parts = tuple(tuple(each.parts for each in some) for some in columns)
        rows = stack.whitened(parts, joint, noise)
        return cls(
            stack=stack,
            noise=noise,
            size=one.size,
            places=one.places,
            parts=parts,
            rows=rows,
            squares=stack.moments(rows, rows),
        )

    def again(
        self, stack: Stack, noise: NoiseModel, columns: Sequence[Sequence[JointColumns]]
    ) -> WhiteColumns | None:
        """Return columns that are these, maybe of another model, whitened by another noise.

        Parameters
        ----------
        stack, noise, columns : as for `of`.

        Returns
        -------
        None where they are others, or the other noise is more than a factor.
        """
        if not (stack.are(self.stack) and self._are_of(columns)):
            return None
        one, factor = columns[0][0], 1.0
        if noise is not self.noise:
            if not (self.noise.is_flat and noise.is_flat):
                return None
            factor = _flat_weight(noise) / _flat_weight(self.noise)
        return replace(self, size=one.size, places=one.places, factor=factor)

    def _are_of(self, columns: Sequence[Sequence[JointColumns]]) -> bool:
        """Whether these are the very arrays that were whitened."""
        return all(
            len(one.parts) == len(parts)
            and all(new is old for new, old in zip(one.parts, parts, strict=True))
            for some, known in zip(columns, self.parts, strict=True)
            for one, parts in zip(some, known, strict=True)
        )

    @staticmethod
    def moments(every: Sequence[WhiteColumns]) -> SecondMoments:
        """Moments of a model's columns and the torque over all joints, (B, p + 1, p + 1)."""
        return _summed(every, [one.squares for one in every])

    @staticmethod
    def pooled(every: Sequence[WhiteColumns]) -> SecondMoments:
        """The same of all blocks together, (p + 1, p + 1), in less time."""
        return _summed(every, [one.squares.pooled() for one in every])

    def moments_with(self, white: np.ndarray) -> SecondMoments:
        """Moments of the same with other whitened columns (B, k, P, L), (B, p + 1, k)."""
        found = self.stack.moments(self.rows, white)
        shape = self.size, white.shape[1]
        return _spread(found, shape, (slice(None), self.places), self.factor)

    def times(self, combination: np.ndarray) -> np.ndarray:
        """Sum of the columns, each times its number of (p + 1,); (B, 1, P, L)."""
        blocks, columns, *shape = self.rows.shape
        factors = self.factor * combination[self.places]
        return (factors @ self.rows.reshape(blocks, columns, -1)).reshape(blocks, 1, *shape)

    def dense(self) -> np.ndarray:
        """All columns and the torque of each run, (R, P, S, p + 1)."""
        rows = self.stack.unfolded(self.rows)
        found = np.zeros((*rows.shape[:3], self.size))
        found[..., self.places] = self.factor * rows
        return found


def _flat_weight(noise: NoiseModel) -> float:
    """What flat noise multiplies a signal by."""
    return float(noise.colour[0] / (noise.scales[0] * noise.std))


def _summed(every: Sequence[WhiteColumns], moments: Sequence[SecondMoments]) -> SecondMoments:
    """Sum moments (..., u, u) of several joints' columns at their places, (..., p + 1, p + 1)."""
    first, size = moments[0], every[0].size
    total = np.zeros((*first.total.shape[:-2], size, size))
    free = None if first.noise_free is None else np.zeros(total.shape)
    for one, own in zip(every, moments, strict=True):
        places = ..., one.places[:, None], one.places
        total[places] += one.factor**2 * own.total
        if free is not None:
            free[places] += one.factor**2 * own.signal
    return SecondMoments(total, sum(own.counts for own in moments), None, free)


def _spread(
    moments: SecondMoments, shape: tuple[int, int], places: Any, factor: float
) -> SecondMoments:
    """Moments of blocks times a factor, at their places in larger ones that are zero elsewhere."""

    def spread(products: np.ndarray) -> np.ndarray:
        found = np.zeros((len(products), *shape))
        found[places] = factor * products
        return found

    free = None if moments.noise_free is None else spread(moments.noise_free)
    return SecondMoments(spread(moments.total), moments.counts, None, free)
