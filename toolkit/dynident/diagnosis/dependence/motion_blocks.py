"""What is held out together: blocks of time, their repetitions, and a gap on either side.

Neighbouring rows share noise and motion, so that rows are held out in blocks, and rows nearer to a
block than their correlation lasts are in no training set. Where a motion comes again, a regression
that has seen it once could look up the second time, whatever its inputs: all times are held out
together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dynident.diagnosis.dependence.residual_record import ResidualRecord, joints_turning_round
from dynident.recording import as_points

MOST_BLOCKS = 24
FEWEST_BLOCKS = 16
"""Blocks that the records are cut into: the fewer, the less of the motion is left to learn from."""
CORRELATED = 0.1
"""Autocorrelation of the residual down to which neighbours count as one."""
GAP_SHARE = 0.25
"""Gap over the length of a block, at most: the residual itself may vary slowly."""
NEAR = 0.05
"""Distance of two states, in units of their spread, within which they are one state."""
SAME_MOTION = 0.3
"""Part of a block's rows whose states were seen before it, from which its motion comes again."""
_STATES = 20_000
"""Rows in which states are looked for, at most."""
_ASKED = 2000
"""Rows whose states are looked for, about."""


@dataclass(frozen=True, eq=False)
class HeldOutUnit:
    """Rows that are held out together, indices into all rows.

    Attributes
    ----------
    rows : that are predicted.
    left_out : (>= rows) ascending; in no training set meanwhile: these rows and those near them.
    """

    rows: np.ndarray
    left_out: np.ndarray


@dataclass(frozen=True, eq=False)
class MotionBlocks:
    """Blocks of all records.

    Attributes
    ----------
    unit : (T,) number of the unit that a row is held out with.
    record : (T,) number of the record.
    t : (T,) s.
    gap : s.
    """

    unit: np.ndarray
    record: np.ndarray
    t: np.ndarray
    gap: float

    @property
    def count(self) -> int:
        """How many units there are."""
        return len(np.unique(self.unit))

    def units(self, rows: np.ndarray) -> list[HeldOutUnit]:
        """Units among some of the rows, an increasing index (N,); the units count within these."""
        unit, record, t = self.unit[rows], self.record[rows], self.t[rows]
        found = []
        for number in np.unique(unit):
            inside = unit == number
            near = np.zeros(len(rows), dtype=bool)
            for one in np.unique(record[inside]):
                here = np.flatnonzero(record == one)
                own = t[here][inside[here]]
                at = np.clip(np.searchsorted(own, t[here]), 1, max(len(own) - 1, 1))
                before, after = own[at - 1], own[np.minimum(at, len(own) - 1)]
                distance = np.minimum(np.abs(t[here] - before), np.abs(t[here] - after))
                near[here] = distance <= self.gap
            found.append(HeldOutUnit(np.flatnonzero(inside), np.flatnonzero(near | inside)))
        return found


def motion_blocks(records: tuple[ResidualRecord, ...], joints: list[int]) -> MotionBlocks:
    """Cut records into blocks, and put together what shows one motion.

    Parameters
    ----------
    records : all records.
    joints : columns of the joints whose residual is looked at.
    """
    lengths = [min(one.period or np.inf, np.ptp(one.t)) for one in records]
    gap = max((_correlation_time(one, j) for one in records for j in joints), default=0.0)
    wanted = sum(lengths) / max(gap / GAP_SHARE, 1e-12)
    count = int(np.clip(wanted, FEWEST_BLOCKS, MOST_BLOCKS))
    block = _cut(records, lengths, count)
    unit = _earliest_of_motion(records, block)
    if (many := len(np.unique(unit))) < FEWEST_BLOCKS:
        # Most is repetition: as many blocks of what is none.
        count = -(-count * FEWEST_BLOCKS // many)
        unit = _earliest_of_motion(records, _cut(records, lengths, count))
    return MotionBlocks(
        unit=unit,
        record=np.concatenate([np.full(len(one.t), i) for i, one in enumerate(records)]),
        t=np.concatenate([one.t for one in records]),
        gap=min(gap, GAP_SHARE * sum(lengths) / count),
    )


def independent_stretches(records: tuple[ResidualRecord, ...], joint: int) -> float:
    """How often the records are longer than what is left at a joint hangs together in time.

    Noise as slow as a few blocks is alike in neighbours, and so is the motion: a regression learns
    one by the other.

    Parameters
    ----------
    records : all records.
    joint : column of the joint.
    """
    lasting = max((_correlation_time(one, joint) for one in records), default=0.0)
    return sum(float(np.ptp(one.t)) for one in records) / max(lasting, 1e-12)


def _cut(records: tuple[ResidualRecord, ...], lengths: list[float], count: int) -> np.ndarray:
    """Number of the block of each row; a period is cut once, for all its repetitions.

    Parameters
    ----------
    records : all records.
    lengths : of each, s, or of its period.
    count : of blocks, about.
    """
    length = sum(lengths) / count
    blocks, first = [], 0
    for one, own in zip(records, lengths, strict=True):
        many = max(round(own / length), 1) if length > 0 else 1
        passed = one.t - one.t[0]
        phase = np.mod(passed, one.period) if one.period else passed
        blocks.append(first + np.minimum((phase / max(own, 1e-12) * many).astype(int), many - 1))
        first += many
    return np.concatenate(blocks)


def _correlation_time(one: ResidualRecord, joint: int) -> float:
    """Time after which the residual of a joint is no longer correlated, s."""
    e = np.where(one.certain[:, joint], one.residual[:, joint], 0.0)
    e = e - e.mean()
    size = 1 << (2 * len(e) - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(e, size)) ** 2
    correlation = np.fft.irfft(spectrum, size)[: len(e)]
    below = np.flatnonzero(correlation <= CORRELATED * correlation[0])
    lag = int(below[0]) if len(below) else len(e)
    return float(lag * np.median(np.diff(one.t))) if len(e) > 1 else 0.0


def _earliest_of_motion(records: tuple[ResidualRecord, ...], block: np.ndarray) -> np.ndarray:
    """Number of the block (T,) in which the motion of each row was seen first.

    A motion comes again where all joints go through the same states for a while. A single joint
    comes back to its states whatever it does: only its period is then a repetition.
    """
    from scipy.spatial import KDTree

    state = np.concatenate([np.hstack([one.q, one.v]) for one in records])
    size, spread = np.abs(state).max(axis=0), state.std(axis=0)
    moving = spread > 1e-6 * size
    if moving.sum() <= 2:
        return block
    turning = joints_turning_round(records)
    if turning.any():
        angles = np.concatenate([np.hstack([as_points(one.q, turning), one.v]) for one in records])
        state, spread = angles, angles.std(axis=0)
        moving = spread > 1e-6 * np.abs(angles).max(axis=0)
    state = state[:, moving] / spread[moving]
    kept = np.linspace(0, len(state) - 1, min(len(state), _STATES)).round().astype(int)
    asked = kept[:: max(len(kept) // _ASKED, 1)]
    near = KDTree(state[kept]).query_ball_point(state[asked], NEAR * np.sqrt(state.shape[1]))
    first = block[kept[[min(rows) for rows in near]]]
    before = np.bincount(block[asked], weights=first != block[asked], minlength=block.max() + 1)
    again = before >= SAME_MOTION * np.bincount(block[asked], minlength=block.max() + 1)
    first = np.where(again[block[asked]], first, block[asked])
    nearest = np.searchsorted(asked, np.arange(len(block))).clip(max=len(asked) - 1)
    # Of a block that was never seen before, every row is its own.
    return np.where(first[nearest] == block[asked[nearest]], block, first[nearest])
