"""Recordings that are cut alike: their rows are whitened, and summed, all at once.

A search asks for little of each of many short recordings, and how often it has to ask costs more
than what it asks for.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np

from dynident.evidence.noise_model import NoiseModel
from dynident.evidence.runs import Run
from dynident.moments.replicates import (
    Kind,
    in_blocks,
    out_of_blocks,
    replicate_moments,
)
from dynident.moments.second_moments import SecondMoments

_ROWS = 50_000
"""Rows, over all replicates, up to which recordings are taken together: they lie in memory."""


@dataclass(frozen=True, eq=False)
class Stack:
    """Consecutive recordings whose replicates, rows and blocks are alike.

    Attributes
    ----------
    runs : the recordings.
    first : number of the first of them among all.
    """

    runs: tuple[Run, ...]
    first: int = 0

    @classmethod
    def of(cls, runs: Sequence[Run]) -> tuple[Stack, ...]:
        """Return all recordings in their order, those that are alike together."""
        found: list[Stack] = []
        for _, like in groupby(runs, key=_cut):
            alike = tuple(like)
            first = sum(len(one.runs) for one in found)
            most = max(1, _ROWS // max(1, alike[0].index.size))
            found += [
                cls(alike[start : start + most], first + start)
                for start in range(0, len(alike), most)
            ]
        return tuple(found)

    @property
    def numbers(self) -> range:
        """Which of all recordings they are."""
        return range(self.first, self.first + len(self.runs))

    @property
    def kind(self) -> Kind:
        """How their replicates come about."""
        return self.runs[0].kind

    def are(self, other: Stack) -> bool:
        """Whether these are the very same recordings."""
        same = len(self.runs) == len(other.runs)
        return same and all(one is two for one, two in zip(self.runs, other.runs, strict=True))

    def whitened(
        self,
        signals: Sequence[Sequence[Sequence[np.ndarray]]],
        joint: int,
        noise: NoiseModel,
    ) -> np.ndarray:
        """Whiten columns of a joint, and arrange them block by block.

        Parameters
        ----------
        signals : for each recording, for each replicate, parts (T, k_i) of the columns, of rows at
            a constant rate.
        joint : whose they are.
        noise : of that joint.

        Returns
        -------
        (B, k of all, P, L) as of `in_blocks`, B over all recordings; zero where the joint's dry
        friction is not known. Of simulated motions P = 1: there is one replicate, without noise.
        """
        if self._simulated:
            signals = [each[-1:] for each in signals]
        elif self.kind == "repeated":
            signals = [each[:1] for each in signals]
        of, weights = self._latest_weights.get(joint, (None, np.empty(0)))
        if of is not noise:  # every candidate is whitened by the same
            weights = noise.weights(self._speeds[joint])
            self._latest_weights[joint] = noise, weights
        told = None if self._told is None else self._told[joint]
        white = noise.whitened(signals, weights, told)
        last = white.shape[1] - 1
        folded = [white[:, min(p, last)][..., rows] for p, rows in enumerate(self._repetitions)]
        return in_blocks(folded, self.runs[0].edges)

    def moments(self, left: np.ndarray, right: np.ndarray) -> SecondMoments:
        """Second moments of whitened columns, (B, ..., a, P, L) and (B, ..., b, P, L)."""
        kind: Kind = "single" if self._simulated else self.kind
        return replicate_moments(left, right, self._counts, kind)

    def unfolded(self, white: np.ndarray) -> np.ndarray:
        """Whitened columns (R, P, S, k), as they follow each other in each recording."""
        return out_of_blocks(white, self.runs[0].edges)

    @property
    def _simulated(self) -> bool:
        return self.runs[0].columns_from == "simulation"

    @cached_property
    def _counts(self) -> np.ndarray:
        """Instants of each block, (B,)."""
        return np.tile(np.diff(self.runs[0].edges), len(self.runs))

    @cached_property
    def _latest_weights(self) -> dict[int, tuple[NoiseModel, np.ndarray]]:
        """Of each joint: the noise that was asked for last, and its weights (R, T)."""
        return {}

    @cached_property
    def _speeds(self) -> np.ndarray:
        """Velocity of each joint, (n, R, T)."""
        place = -1 if self._simulated else 0
        return np.stack([run.replicates[place].v.T for run in self.runs], axis=1)

    @cached_property
    def _told(self) -> np.ndarray | None:
        """Rows whose dry friction is known at each joint, (n, R, T) mask; None for all of them."""
        if all(run.uncertain is None for run in self.runs):
            return None
        told = np.ones(self._speeds.shape, dtype=bool)
        for joint, joints_rows in enumerate(told):
            for run, rows in zip(self.runs, joints_rows, strict=True):
                known = run.told(joint)
                if known is not None:
                    rows[:] = known
        return told

    @cached_property
    def _repetitions(self) -> tuple[np.ndarray | slice, ...]:
        """The rows of `index`, as slices where nothing is left out of them."""
        index = self.runs[0].index
        return tuple(
            slice(int(rows[0]), int(rows[-1]) + 1)
            if len(rows) and np.all(np.diff(rows) == 1)
            else rows
            for rows in (index[:1] if self._simulated else index)
        )


def _cut(run: Run) -> Hashable:
    """What runs that are taken together have in common."""
    return (
        run.kind,
        run.columns_from,
        bool(run.recording.payload),  # their models have other columns
        len(run.replicates),
        len(run.replicates[0].t),
        run.index.shape,
        run.index.tobytes(),
        run.edges.tobytes(),
    )
