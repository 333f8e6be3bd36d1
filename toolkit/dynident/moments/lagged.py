"""Products of rows with later rows: what the covariance of an estimate needs of correlated errors.

In: blocks of columns and residuals, stretch by stretch of rows at a constant rate. Out: for each
joint and lag, sums of products of columns, and of residuals.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dynident.moments.window_spectra import windowed_products

_STRETCH = 64
"""Rows that follow each other where not all are multiplied: several times the lags, and few, for
rows far apart show more of a motion than as many that are neighbours. Also rows of a window."""

RowBlock = tuple[bool, np.ndarray, np.ndarray, np.ndarray]
"""Whether a new stretch begins; columns (T, n, p); residual (T, n); mask of what counts (T, n)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LaggedProducts:
    """Sums over pairs of rows that lie some lags apart.

    Attributes
    ----------
    columns : (n, K + 1, p, p) sums of x(t) x(t + k)' of each joint, k = 0 ... K.
    residual : (n, K + 1) sums of e(t) e(t + k).
    pairs : (n, K + 1) number of such pairs at each joint, of rows that both count.
    """

    columns: np.ndarray
    residual: np.ndarray
    pairs: np.ndarray

    @property
    def lags(self) -> int:
        """The longest lag, K."""
        return self.pairs.shape[1] - 1


def lagged_products(blocks: Iterable[RowBlock], lags: int) -> LaggedProducts:
    """Sum products over rows and those that follow them in the same stretch.

    Parameters
    ----------
    blocks : consecutive rows; those of other stretches are never paired.
    lags : K, the longest lag in rows.

    Returns
    -------
    The sums over all stretches.

    Raises
    ------
    ValueError
        If there is no block.
    """
    joints: list[_Joint] = []
    pairs = _Pairs(lags)
    size = 0
    for begins, columns, residual, counts in blocks:
        pairs.add(begins, residual, counts)
        if not joints:
            size = columns.shape[2]
            joints = [_Joint(size, lags) for _ in range(columns.shape[1])]
        every = np.array(counts.all(axis=0))
        for j, joint in enumerate(joints):
            # What does not count stays as rows of zeros, so that lags remain lags.
            here = columns[:, j] if every[j] else columns[:, j] * counts[:, j, None]
            joint.add(begins, here)
    if not joints:
        raise ValueError("no rows")
    found = np.array([joint.sums for joint in joints])
    return LaggedProducts(columns=found, residual=pairs.products, pairs=pairs.counts)


def lagged_residuals(
    blocks: Iterable[tuple[bool, np.ndarray, np.ndarray]], lags: int
) -> tuple[np.ndarray, np.ndarray]:
    """Sum the products of residuals alone.

    Parameters
    ----------
    blocks : whether a new stretch begins; residual (T, n); mask of what counts (T, n).
    lags : K, the longest lag in rows.

    Returns
    -------
    residual, pairs : (n, K + 1) as of `LaggedProducts`.
    """
    pairs = _Pairs(lags)
    for begins, residual, counts in blocks:
        pairs.add(begins, residual, counts)
    return pairs.products, pairs.counts


class LaggedColumns:
    """Products of columns with those of later rows, gathered while rows pass by.

    Of very many rows some are enough: how errors of rows add up is a property of the motion. They
    lie in stretches that are evenly apart.

    Parameters
    ----------
    lags : K, the longest lag in rows.
    share : of the rows that are multiplied.
    """

    def __init__(self, lags: int, share: float = 1.0) -> None:
        self.lags, self.share, self.complete = lags, share, share >= 1.0
        self._length = _STRETCH
        self._spacing = max(_STRETCH, round(_STRETCH / share))
        self._joints: list[_Joint] = []
        self._pairs = np.zeros(lags + 1)

    @property
    def columns(self) -> np.ndarray:
        """Sums of x(t) x(t + k)' of each joint, (n, K + 1, p, p)."""
        return np.array([joint.sums for joint in self._joints])

    @property
    def pairs(self) -> np.ndarray:
        """Number of pairs behind them, (K + 1,)."""
        return self._pairs

    def like(self) -> LaggedColumns:
        """Return what gathers alike and has seen nothing yet."""
        return LaggedColumns(self.lags, self.share)

    def join(self, other: LaggedColumns) -> None:
        """Take in what another one, that gathers alike, has seen of other recordings."""
        if not self._joints:
            self._joints = other._joints
        else:
            for mine, theirs in zip(self._joints, other._joints, strict=True):
                mine.sums += theirs.sums
        self._pairs = self._pairs + other._pairs

    def add(self, first: int, columns: np.ndarray) -> None:
        """Add rows (T, n, p) of a recording, the first of which is its row number `first`."""
        if not self._joints:
            self._joints = [_Joint(columns.shape[2], self.lags) for _ in range(columns.shape[1])]
        stretches = list(self._stretches(first, first + len(columns)))
        if not stretches:
            return
        pieces = [slice(start - first, stop - first) for _, start, stop in stretches]
        begins = stretches[0][0] == stretches[0][1]
        for j, joint in enumerate(self._joints):
            joint.add(begins, columns[:, j], pieces)
        k = np.arange(self.lags + 1)
        for begin, start, stop in stretches:
            self._pairs += np.maximum(stop - begin - np.maximum(start - begin, k), 0)

    def _stretches(self, first: int, last: int) -> Iterator[tuple[int, int, int]]:
        """Where stretches begin, and from which to before which of some rows they have."""
        if self.complete:
            yield 0, first, last
            return
        offset = (self._spacing - self._length) // 2
        for k in range(max(0, (first - offset) // self._spacing), last // self._spacing + 1):
            begin = k * self._spacing + offset
            start, stop = max(begin, first), min(begin + self._length, last)
            if stop > start:
                yield begin, start, stop


class _Pairs:
    """Products of residuals with later ones, and how many there are."""

    def __init__(self, lags: int) -> None:
        self._lags = lags
        self._before = np.zeros((0, 2, 0))
        self._sums = np.zeros((0, 0, 0))

    @property
    def products(self) -> np.ndarray:
        """Sums of e(t) e(t + k), (n, K + 1)."""
        return self._sums[0]

    @property
    def counts(self) -> np.ndarray:
        """Number of pairs, (n, K + 1)."""
        return self._sums[1]

    def add(self, begins: bool, residual: np.ndarray, counts: np.ndarray) -> None:
        """Add rows (T, n), and which of them count."""
        here = np.stack([residual.T * counts.T, counts.T])
        if not self._sums.size:
            self._sums = np.zeros((2, residual.shape[1], self._lags + 1))
            self._before = here[:, :, :0]
        before = here[:, :, :0] if begins else self._before
        rows, old = np.concatenate([before, here], axis=2), before.shape[2]
        for k in range(self._lags + 1):
            # Pairs that end in this block; those before it are counted already.
            late = rows[:, :, max(old, k) :]
            early = rows[:, :, max(old, k) - k : rows.shape[2] - k]
            self._sums[:, :, k] += np.einsum("ijt,ijt->ij", early[:, :, : late.shape[2]], late)
        self._before = rows[:, :, max(0, rows.shape[2] - self._lags) :]


class _Joint:
    """Products of a joint's columns with later rows, of columns that are not zero throughout."""

    def __init__(self, size: int, lags: int) -> None:
        self.sums = np.zeros((lags + 1, size, size))
        self._lags = lags
        self._before = np.zeros((0, size))

    def add(
        self, begins: bool, columns: np.ndarray, pieces: Sequence[slice] = (slice(None),)
    ) -> None:
        """Add rows.

        Parameters
        ----------
        begins : whether the first piece begins a stretch, or goes on with the rows before.
        columns : (T, p)
        pieces : which of the rows follow each other; every piece but the first begins a stretch.
        """
        before = self._before[:0] if begins else self._before
        some = columns[0] != 0.0
        for name in np.flatnonzero(~some):
            some[name] = columns[:, name].any() or before[:, name].any()
        used = np.flatnonzero(some)
        if len(used):
            self._add_products(before, columns, pieces, used)
        after = columns[pieces[-1]]
        after = after[max(0, len(after) - self._lags) :]
        if len(pieces) == 1:
            after = np.concatenate([before, after])
        self._before = np.array(after[max(0, len(after) - self._lags) :])

    def _add_products(
        self, before: np.ndarray, columns: np.ndarray, pieces: Sequence[slice], used: np.ndarray
    ) -> None:
        """Add the products of some columns."""
        index, beyond = _windows([range(*one.indices(len(columns))) for one in pieces], self._lags)
        windows = np.empty((len(used), *index.shape))
        # Column by column, as blocks have them.
        for place, name in enumerate(used):
            windows[place] = np.take(columns[:, name], index, mode="clip")
        windows[:, beyond] = 0.0
        found = windowed_products(windows, self._lags)
        last, old = before[:, used].T, len(before)
        for k in range(1, self._lags + 1):
            found[k] += last[:, max(0, old - k) :] @ windows[:, 0, max(0, k - old) : k].T
        self.sums[:, used[:, None], used] += found


def _windows(pieces: Sequence[range], lags: int) -> tuple[np.ndarray, np.ndarray]:
    """Which rows are in the windows of `windowed_products`, and which of these are not there.

    Parameters
    ----------
    pieces : of rows.
    lags : K.

    Returns
    -------
    (S, N) numbers of rows, and whether they are beyond their piece.
    """
    starts = [np.arange(one.start, one.stop, _STRETCH) for one in pieces]
    stops = np.repeat([one.stop for one in pieces], [len(some) for some in starts])
    index = np.concatenate(starts)[:, None] + np.arange(_STRETCH + lags)
    return index, index >= stops[:, None]
