"""Columns of a file without names: what they are, from how they move together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.errors import RecordingError
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from dynident.study_draft.timing import clock_scale, is_clock
from dynident.wiring.wiring_regression import WiringRegression
from dynident.wiring.wiring_rows import rows_of

UNUSED = "-"
_SAMPLES = 6000  # of a file that are looked at
_DERIVATIVE = 0.9  # correlation of a speed with the difference of its position
_SAME = 0.99  # correlation of a position with its reference
_EXACT = 1e-9  # share that counts as explained in full
_SLOPES = (0.5, 2.0)  # of a speed against that difference


@dataclass(frozen=True, kw_only=True)
class NamedByNumbers:
    """Names for the columns of a file, by position.

    Attributes
    ----------
    names : ours, or `UNUSED`; those of torques are missing.
    torques : first columns of the blocks that may be torques, the likeliest first.
    reason : what tells them.
    """

    names: tuple[str, ...]
    torques: tuple[int, ...]
    joints: int
    reason: str

    @property
    def choices(self) -> tuple[str, ...]:
        """The blocks in words, columns counted from 1."""
        return tuple(f"torques in columns {s + 1} to {s + self.joints}" for s in self.torques)

    def named(self, chosen: int, joints: Sequence[str]) -> tuple[str, ...]:
        """Return the names with those of the torques.

        Parameters
        ----------
        chosen : which of `torques`.
        joints : their names.
        """
        found = list(self.names)
        for j, joint in enumerate(joints):
            found[self.torques[chosen] + j] = f"tau.{joint}"
        return tuple(found)


def named_by_numbers(
    x: np.ndarray, robot: Robot, rate_hz: float | None, where: str
) -> NamedByNumbers:
    """Find time, positions, speeds and torques among columns that nothing names.

    Signals are looked for in blocks of as many columns as the robot has joints, in their order:
    speeds are the derivative of positions, and torques are what the equations of motion explain.

    Parameters
    ----------
    x : (T, m) the file's numbers.
    robot : as it is described.
    rate_hz : of the samples, where the file has no clock.
    where : the file, for messages.

    Returns
    -------
    Names, but for the torques, of which several blocks may be left to choose from.

    Raises
    ------
    RecordingError
        If there is no clock and no rate, or no block of columns is a position and its speed.
    """
    x, n = x[:_SAMPLES], robot.n
    clocks = [k for k in range(x.shape[1]) if is_clock(x[:, k])]
    # Beside a clock, what goes up by one is the number of the sample.
    clocks.sort(key=lambda k: bool(np.all(np.diff(x[:, k]) == 1.0)))
    clock = clocks[0] if clocks and rate_hz is None else None
    if clock is None and rate_hz is None:
        remedy = "give the samples' rate: --rate 125"
        raise RecordingError("none of its columns is a clock", where, remedy)
    if clock is None:
        t = np.arange(len(x)) / (rate_hz or 1.0)
    else:
        t = (x[:, clock] - x[0, clock]) * clock_scale(x[:, clock])[0]
    starts = [
        s
        for s in range(x.shape[1] - n + 1)
        if not any(s <= k < s + n for k in clocks) and np.ptp(x[:, s : s + n], axis=0).any()
    ]
    pairs = [(q, v) for q in starts for v in starts if abs(q - v) >= n and _is_rate(x, t, q, v, n)]
    if not pairs:
        what = f"no {n} of its columns are positions of which {n} others are the speeds"
        raise RecordingError(what, where, "write a header line, or columns = [...] in the study")
    # A reference and its speed are such a pair too: what was measured is rougher.
    alike = [
        pair for pair in pairs if pair[0] == pairs[0][0] or _is_same(x, pairs[0][0], pair[0], n)
    ]
    q, v = max(alike, key=lambda pair: [_roughness(x[:, s : s + n]) for s in pair])
    taken = {clock, *range(q, q + n), *range(v, v + n)}
    free = [s for s in starts if not taken & set(range(s, s + n))]
    free = [s for s in free if not _is_same(x, q, s, n) and not _is_same(x, v, s, n)]
    scored = sorted(((_explained(x, t, q, s, robot), -s) for s in free), reverse=True)
    if not scored:
        what = f"no {n} columns are left that may be torques"
        raise RecordingError(what, where, "write a header line, or columns = [...] in the study")
    tau = -scored[0][1]
    names = [UNUSED] * x.shape[1]
    if clock is not None:
        names[clock] = "t"
    for signal, start in (("q", q), ("v", v)):
        for j, joint in enumerate(robot.names):
            names[start + j] = f"{signal}.{joint}"
    # Blocks that overlap the best one are no choice of their own.
    others = [-s for _, s in scored[1:] if abs(-s - tau) >= n]
    return NamedByNumbers(
        names=tuple(names),
        torques=(tau, *others[:2]),
        joints=n,
        reason=f"columns {v + 1} to {v + n} are the derivative of {q + 1} to {q + n}, and the "
        "equations of motion explain these best",
    )


def _roughness(x: np.ndarray) -> float:
    """How much columns jump from sample to sample, of how far they go."""
    return float(
        np.sum(np.abs(np.diff(x, 2, axis=0))) / max(float(np.sum(np.ptp(x, axis=0))), 1e-300)
    )


def _is_rate(x: np.ndarray, t: np.ndarray, q: int, v: int, n: int) -> bool:
    """Whether a block is the derivative of another, on one scale of time for all of its columns."""
    slopes = []
    for j in range(n):
        position, speed = x[:, q + j], x[:, v + j]
        if np.ptp(position) == 0:
            continue
        change = np.gradient(position, t)
        both = np.linalg.norm(change) * np.linalg.norm(speed)
        if not both or change @ speed < _DERIVATIVE * both:
            return False
        slopes.append(float(change @ speed / (change @ change)))
    if not slopes:
        return False
    usual = float(np.median(slopes))
    return all(_SLOPES[0] < slope / usual < _SLOPES[1] for slope in slopes)


def _is_same(x: np.ndarray, one: int, other: int, n: int) -> bool:
    """Whether a block is another one once more: a reference, or the other way round."""
    a, b = (x[:, s : s + n] - x[:, s : s + n].mean(axis=0) for s in (one, other))
    both = np.linalg.norm(a, axis=0) * np.linalg.norm(b, axis=0)
    return bool(np.all(np.sum(a * b, axis=0) >= _SAME * both) and both.any())


def _explained(x: np.ndarray, t: np.ndarray, q: int, tau: int, robot: Robot) -> float:
    """Logarithmic likelihood per row of a block of columns as torques, over that of constants.

    A temperature is nearly a constant, which friction explains as far as it goes.
    """
    n, criteria = robot.n, DEFAULTS.wiring
    torque = x[:, tau : tau + n]
    if not np.ptp(torque, axis=0).all():
        return -np.inf
    try:
        one = Recording(t=t, q=x[:, q : q + n], tau=torque, joints=robot.names)
        rows = rows_of(Dataset((one,)), criteria.rows, criteria.independent_hz)
    except RecordingError:
        return -np.inf
    found = WiringRegression.of(Model(robot), rows).fit(np.arange(n), np.ones(n))
    varies = np.var(rows.tau, axis=0) / np.mean(rows.tau**2, axis=0)
    return -0.5 * float(np.sum(np.log(np.maximum(found.unexplained / varies, _EXACT))))
