"""Columns of a file without names: what they are, from how they move together."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dynident.criteria import DEFAULTS
from dynident.errors import RecordingError
from dynident.model import Model
from dynident.recording import Dataset, Recording
from dynident.robot import Robot
from dynident.study_draft.places import Places
from dynident.study_draft.timing import clock_scale, is_clock
from dynident.wiring.regressions.wiring_regression import WiringRegression
from dynident.wiring.regressions.wiring_rows import WiringRows, rows_of

UNUSED = "-"
_SAMPLES = 6000  # of a file that are looked at
_DERIVATIVE = 0.9  # correlation of a speed with the difference of its position
_SAME = 0.99  # correlation of a position with its reference
_NEAR = 0.15  # of a motion by which a reference misses what follows it
_EXACT = 1e-9  # share that counts as explained in full
_SLOPES = (0.5, 2.0)  # of a speed against that difference
_SHOWN = 0.5 * math.log(2.0)
"""Likelihood from which on a motion without speeds counts: half of the power of each torque."""
_PARTS = 4  # of the time, each predicted from the others
_MEANS = 50  # parts of the time, in whose means noise is little
_TO_AND_FRO = 1.5  # way of these means over their range: 1 where they only rise
_MOST_COLUMNS = 200
_MOST_PAIRS = 400
"""Blocks that are tried as positions and torques; of few joints more, which take less time each."""
_MOST_COLUMN_PAIRS = 2400
"""The same times the joints."""
_MOST_READINGS = 3
_TURN, _DEGREE = 2 * math.pi, math.pi / 180
_WORDS = {"q": "positions", "v": "speeds", "tau": "torques"}


@dataclass(frozen=True, kw_only=True)
class NamedByNumbers:
    """Names for the columns of a file, by position.

    Attributes
    ----------
    readings : first columns of the blocks of "q", "v" (where there are speeds) and "tau", counted
        from 0; the likeliest reading first.
    clock : column of the clock; None where the rate was given.
    columns, joints : how many there are.
    reason : what tells them.
    """

    readings: tuple[Mapping[str, int], ...]
    clock: int | None
    columns: int
    joints: int
    reason: str

    @property
    def choices(self) -> tuple[str, ...]:
        """The readings in words, columns counted from 1."""
        return tuple(
            ", ".join(f"{_WORDS[x]} in {_span(s, self.joints)}" for x, s in one.items())
            for one in self.readings
        )

    def named(self, chosen: int, joints: Sequence[str]) -> tuple[str, ...]:
        """Return a name for each column, or `UNUSED`.

        Parameters
        ----------
        chosen : which of `readings`.
        joints : their names.
        """
        found = [UNUSED] * self.columns
        if self.clock is not None:
            found[self.clock] = "t"
        for signal, start in self.readings[chosen].items():
            for j, joint in enumerate(joints):
                found[start + j] = f"{signal}.{joint}"
        return tuple(found)


def named_by_numbers(
    x: np.ndarray, robot: Robot, rate_hz: float | None, where: str
) -> NamedByNumbers:
    """Find time, positions, speeds and torques among columns that nothing names.

    Signals are looked for in blocks of as many columns as the robot has joints, in their order:
    speeds are the derivative of positions, and torques are what the equations of motion explain.
    Where there are no speeds, positions are those whose motion explains other columns best.

    Parameters
    ----------
    x : (T, m) the file's numbers; NaN in columns of text.
    robot : as it is described.
    rate_hz : of the samples, where the file has no clock.
    where : the file, for messages.

    Returns
    -------
    Names, of which several readings may be left to choose from.

    Raises
    ------
    RecordingError
        If there is no clock and no rate, or no block of columns is a position whose motion explains
        another, with or without its speed.
    """
    x, n = x[:_SAMPLES], robot.n
    remedy = "write a header line, or say which they are, "
    remedy += f'--column "q.{robot.names[0]} = column2", for each position and torque'
    if x.shape[1] > _MOST_COLUMNS:
        what = f"{x.shape[1]} columns have no names, and {_MOST_COLUMNS} are looked at at most"
        raise RecordingError(what, where, remedy)
    clocks = [k for k in range(x.shape[1]) if is_clock(x[:, k])]
    # Beside a clock, what goes up by one is the number of the sample.
    clocks.sort(key=lambda k: bool(np.all(np.diff(x[:, k]) == 1.0)))
    clock = clocks[0] if clocks and rate_hz is None else None
    if clock is None and rate_hz is None:
        rate = "give the samples' rate: --rate 125"
        raise RecordingError("none of its columns is a clock", where, rate)
    if clock is None:
        t = np.arange(len(x)) / (rate_hz or 1.0)
    else:
        t = (x[:, clock] - x[0, clock]) * clock_scale(x[:, clock])[0]
    closed = {*clocks, *np.flatnonzero(np.isnan(x).any(axis=0))}
    starts = [
        s
        for s in range(x.shape[1] - n + 1)
        if not any(s <= k < s + n for k in closed) and np.ptp(x[:, s : s + n], axis=0).any()
    ]
    blocks = _Blocks(x=x, t=t, robot=robot, starts=tuple(starts), where=where, remedy=remedy)
    readings, reason = blocks.with_speeds() or blocks.without_speeds() or ([], "")
    if not readings:
        what = f"no {n} of its columns are positions whose motion explains {n} others as torques"
        raise RecordingError(what, where, remedy)
    return NamedByNumbers(
        readings=tuple(readings), clock=clock, columns=x.shape[1], joints=n, reason=reason
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class _Blocks:
    """Runs of as many columns as there are joints, by the first of each.

    Attributes
    ----------
    x : (T, m) the file's numbers.
    t : (T,) s.
    robot : as it is described.
    starts : of runs that may be a signal: of no clock, and not at rest.
    where, remedy : for messages.
    """

    x: np.ndarray
    t: np.ndarray
    robot: Robot
    starts: tuple[int, ...]
    where: str
    remedy: str

    @cached_property
    def model(self) -> Model:
        """The robot alone."""
        return Model(self.robot)

    def of(self, start: int) -> np.ndarray:
        """Return the columns (T, n) of a block."""
        return self.x[:, start : start + self.robot.n]

    def with_speeds(self) -> tuple[list[dict[str, int]], str] | None:
        """Positions, the speeds that are their derivative, and torques; None without speeds."""
        x, n = self.x, self.robot.n
        starts = self.starts
        pairs = [
            (q, v)
            for q in starts
            for v in starts
            if abs(q - v) >= n and _is_rate(x, self.t, q, v, n)
        ]
        if not pairs:
            return None
        # A reference and its speed are such a pair too: what was measured is rougher.
        first = pairs[0][0]
        alike = [pair for pair in pairs if pair[0] == first or _is_same(x, first, pair[0], n)]
        q, v = max(alike, key=lambda pair: [_roughness(self.of(s)) for s in pair])
        free = [s for s in starts if min(abs(s - q), abs(s - v)) >= n]
        # Accelerations are explained in full, by the rotors alone.
        speeds = {pair[1] for pair in pairs}
        free = [s for s in free if not any(_is_rate(x, self.t, one, s, n) for one in speeds)]
        free = [s for s in free if not _is_same(x, q, s, n) and not _is_same(x, v, s, n)]
        free = [s for s in free if not self._is_place(q, s)]
        scored = sorted(((self.explained(q, s), -s) for s in free), reverse=True)
        what = f"what is in {_span(v, n)} is the derivative of what is in {_span(q, n)}"
        reason = f"{what}, and the equations of motion explain these torques best"
        return self._apart([{"q": q, "v": v, "tau": -s} for _, s in scored]), reason

    def without_speeds(self) -> tuple[list[dict[str, int]], str] | None:
        """Positions and the torques that their motion explains; None where none does."""
        x, n = self.x, self.robot.n
        motions = [q for q in self.starts if _comes_back(self.of(q))]
        pairs = [(q, s) for q in motions for s in self.starts if abs(q - s) >= n]
        pairs = [(q, s) for q, s in pairs if not self._repeats(q, s)]
        most = max(_MOST_PAIRS, _MOST_COLUMN_PAIRS // n)
        if len(pairs) > most:
            what = f"no columns are the derivative of others, and {len(pairs)} pairs of them may "
            what += f"be positions and torques: at most {most} are tried"
            raise RecordingError(what, self.where, self.remedy)
        scored = sorted(((self.explained(q, s), -q, -s) for q, s in pairs), reverse=True)
        shown = [(-q, -s) for score, q, s in scored if score > n * _SHOWN]
        # Either of two may be the positions of which the other is made.
        shown = [(q, s) for q, s in shown if not self._is_place(q, s) and not self._is_place(s, q)]
        shown = [pair for pair in shown if self._holds(*pair)]
        if not shown:
            return None
        # A reference moves as what follows it does: what was measured is rougher.
        best, tau = shown[0]
        alike = [q for q, s in shown if s == tau and (q == best or _is_same(x, best, q, n))]
        q = max(alike, key=lambda one: _roughness(self.of(one)))
        others = [pair for pair in shown if pair[0] not in alike and pair != (tau, q)]
        reason = "no columns are their speeds, and their motion explains these torques best"
        return self._apart([{"q": p, "tau": s} for p, s in ((q, tau), *others)]), reason

    def explained(self, q: int, tau: int) -> float:
        """Logarithmic likelihood per row of a block as torques of a motion, over constants'.

        A temperature is nearly a constant, which friction explains as far as it goes.
        """
        torque, positions = self.of(tau), self.of(q)
        if not np.ptp(torque, axis=0).all():
            return -np.inf
        return max(self._fit(x, torque) for x in _in_radians(positions))

    def _is_place(self, q: int, tau: int) -> bool:
        """Whether a block follows from positions: those of motors or of a tool, and no torques."""
        if q not in self._places:
            self._places[q] = [Places(self.robot, x) for x in _in_radians(self.of(q))]
        return any(one.tell(self.of(tau)) for one in self._places[q])

    @cached_property
    def _places(self) -> dict[int, list[Places]]:
        return {}

    def _holds(self, q: int, tau: int) -> bool:
        """Whether the motion predicts half of the torques in each quarter of the time by the rest.

        What drifts, as temperatures do, is explained by whatever else drifts, and not predicted.
        """
        positions, n = self.of(q), self.robot.n
        order, one = np.arange(n), np.ones(n)
        for x in (positions, positions * _DEGREE):
            rows = self._rows(x, self.of(tau))
            if rows is None:
                continue
            ends = np.linspace(0, len(rows.q), _PARTS + 1).round().astype(int)
            each = [
                WiringRegression.of(self.model, rows.picked(slice(*pair)))
                for pair in itertools.pairwise(ends)
            ]
            missed = np.zeros(n)
            for asked in each:
                rest = [other for other in each if other is not asked]
                values = _together(rest).fit(order, one).values
                missed += asked.power[order, order] - 2.0 * asked.cross[order, order] @ values
                missed += (asked.gram @ values) @ values
            varies = len(rows.tau) * np.var(rows.tau, axis=0)
            if -0.5 * np.sum(np.log(np.maximum(missed / varies, _EXACT))) > n * _SHOWN:
                return True
        return False

    def _rows(self, q: np.ndarray, torque: np.ndarray) -> WiringRows | None:
        criteria = DEFAULTS.wiring
        try:
            one = Recording(t=self.t, q=q, tau=torque, joints=self.robot.names)
            return rows_of(Dataset((one,)), criteria.rows, criteria.independent_hz)
        except RecordingError:
            return None

    def _fit(self, q: np.ndarray, torque: np.ndarray) -> float:
        rows = self._rows(q, torque)
        if rows is None:
            return -np.inf
        n = self.robot.n
        found = WiringRegression.of(self.model, rows).fit(np.arange(n), np.ones(n))
        varies = np.var(rows.tau, axis=0) / np.mean(rows.tau**2, axis=0)
        return -0.5 * float(np.sum(np.log(np.maximum(found.unexplained / varies, _EXACT))))

    def _repeats(self, one: int, other: int) -> bool:
        """Whether a column of one block is that of the same joint in the other once more."""
        a, b = (self.of(s) - self.of(s).mean(axis=0) for s in (one, other))
        return bool(np.any(np.sum((a - b) ** 2, axis=0) < _NEAR**2 * np.sum(a * a, axis=0)))

    def _apart(self, readings: Sequence[dict[str, int]]) -> list[dict[str, int]]:
        """The first readings, less those that overlap one before in part."""
        found: list[dict[str, int]] = []
        for one in readings:
            if all(self._is_other(one, before) for before in found):
                found.append(one)
        return found[:_MOST_READINGS]

    def _is_other(self, one: Mapping[str, int], before: Mapping[str, int]) -> bool:
        """Whether a reading has other positions or torques, and no part of the same ones."""
        shifts = [abs(one[signal] - before[signal]) for signal in ("q", "tau")]
        return any(shifts) and not any(0 < shift < self.robot.n for shift in shifts)


def _in_radians(positions: np.ndarray) -> tuple[np.ndarray, ...]:
    """Positions (T, n) as they are and, where they would be more than a turn, as degrees."""
    turns = np.abs(positions).max() > _TURN
    return (positions, positions * _DEGREE)[: 1 + turns]


def _roughness(x: np.ndarray) -> float:
    """How much columns jump from sample to sample, of how far they go."""
    return float(
        np.sum(np.abs(np.diff(x, 2, axis=0))) / max(float(np.sum(np.ptp(x, axis=0))), 1e-300)
    )


def _comes_back(x: np.ndarray) -> bool:
    """Whether a column of a block goes to and fro, as joints do, and motors that warm up do not."""
    parts = np.array_split(x, min(len(x), _MEANS))
    means = np.array([part.mean(axis=0) for part in parts])
    way = np.sum(np.abs(np.diff(means, axis=0)), axis=0)
    return bool(np.any(way > _TO_AND_FRO * np.ptp(means, axis=0)))


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


def _together(parts: Sequence[WiringRegression]) -> WiringRegression:
    """The second moments of several parts of the time; inertia and friction are not asked."""
    gram, cross, power = (
        np.sum([getattr(one, name) for one in parts], axis=0) for name in ("gram", "cross", "power")
    )
    return replace(parts[0], gram=gram, cross=cross, power=power)


def _is_same(x: np.ndarray, one: int, other: int, n: int) -> bool:
    """Whether a block is another one once more: a reference, or the other way round."""
    a, b = (x[:, s : s + n] - x[:, s : s + n].mean(axis=0) for s in (one, other))
    both = np.linalg.norm(a, axis=0) * np.linalg.norm(b, axis=0)
    return bool(np.all(np.sum(a * b, axis=0) >= _SAME * both) and both.any())


def _span(start: int, count: int) -> str:
    """The columns of a block, counted from 1."""
    if count == 1:
        return f"column {start + 1}"
    return f"columns {start + 1} to {start + count}"
