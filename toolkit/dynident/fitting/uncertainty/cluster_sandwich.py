"""The covariance of an estimate from the scatter of its scores between blocks of time.

Nothing is assumed of the errors but that those of different blocks are independent: they may be
correlated within a block, larger in one than in another, or no noise at all but what the model
lacks. Of a motion that repeats, what the model lacks repeats too: a block there is a part of the
period, over all repetitions.

Source: K.-Y. Liang and S. L. Zeger, "Longitudinal data analysis using generalized linear models",
Biometrika 73 (1986).
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from dynident.fitting.sampling import Sampled

BLOCKS = 20
"""Of all recordings together. Taste: fewer scatter too much themselves, more are too short to hold
what hangs together."""
_LEAST = 4  # in a recording
_LEVEL = 1e-3
"""Chance that scatter between blocks of time which is noise alone counts as more."""
_WIDEST = 10.0
"""Factor of sigma beyond which the scatter is that of a direction that the data hardly know, where
few blocks measure nothing. Taste."""


def time_blocks(sampled: Sampled, recordings: int) -> np.ndarray:
    """Return the number of the block of each row, (T,).

    Parameters
    ----------
    sampled : a recording.
    recordings : how many there are.
    """
    count = max(_LEAST, -(-BLOCKS // recordings))
    share = (sampled.t - sampled.t[0]) / (sampled.t[-1] - sampled.t[0])
    if period := sampled.recording.period:
        share = np.mod((sampled.t - sampled.t[0]) / period, 1.0)
    return np.minimum((share * count).astype(int), count - 1)


class BlockScores:
    """Sums of scores, block by block.

    Parameters
    ----------
    rank : number of scores, r.
    """

    def __init__(self, rank: int) -> None:
        self._sums: list[np.ndarray] = []
        self._rank = rank

    def add(self, blocks: np.ndarray, scores: np.ndarray, first: int) -> None:
        """Add rows of a recording.

        Parameters
        ----------
        blocks : (T,) of these rows, from `time_blocks`.
        scores : (T, r) instrument times weighted residual, summed over joints.
        first : blocks of the recordings before.
        """
        missing = first + int(blocks.max()) + 1 - len(self._sums)
        self._sums += [np.zeros(self._rank) for _ in range(missing)]
        for block in np.unique(blocks):
            self._sums[first + block] += scores[blocks == block].sum(axis=0)

    def join(self, other: BlockScores) -> None:
        """Take in the blocks of other recordings."""
        self._sums += other._sums

    @property
    def count(self) -> int:
        """Number of blocks so far."""
        return len(self._sums)

    @property
    def meat(self) -> np.ndarray:
        """Covariance of the sum of all scores, (r, r)."""
        sums = np.array(self._sums)
        return sums.T @ sums * self.count / (self.count - 1)


def scatter_factors(noise: np.ndarray, bread: np.ndarray, scores: BlockScores) -> np.ndarray:
    """Return factors (r,) of the deviations of noise where blocks of time scatter by far more.

    What the model lacks is no noise of any colour; it shows as estimates that differ from one
    stretch of the motion to the next.

    Parameters
    ----------
    noise : (r, r) covariance as noise in the rows makes it.
    bread : (r, r) inverse of the weighted normal matrix.
    scores : of the same r parameters.
    """
    scatter = np.diag(bread @ scores.meat @ bread) / np.diag(noise)
    freedom = scores.count - 1
    return np.where(
        scatter > chdtri(freedom, _LEVEL) / freedom, np.minimum(np.sqrt(scatter), _WIDEST), 1.0
    )
